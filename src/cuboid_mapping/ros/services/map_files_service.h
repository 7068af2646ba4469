// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/LoadMap.h"
#include "cuboid_mapping/LoadMapAction.h"
#include "cuboid_mapping/SaveMap.h"
#include "cuboid_mapping/SaveMapAction.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/map/map_storage.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/ros/services/long_call.h"

#include <ros/node_handle.h>
#include <ros/wall_timer.h>

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

/// ~save_map and ~load_map, as services and actions; and saves to autosave_file, and of the window to its
/// store, with locked boxes, after each period with changes and at the end of the node.
///
/// Thread rule: all work runs one after the other in its own thread, so that neither clouds
/// nor queries wait for a disk.
class MapFilesService {
 public:
  /// @param private_nh  Its queue takes goals and cancels of actions. @param map, guard  Must outlive this
  ///                    object.
  MapFilesService(const ros::NodeHandle& private_nh, const NodeParameters& parameters,
                  GuardedMap& map, CallbackGuard& guard);
  ~MapFilesService();
  MapFilesService(const MapFilesService&) = delete;
  MapFilesService& operator=(const MapFilesService&) = delete;

  /// Error of the last save to autosave_file or of locked boxes, or the reason why none can succeed; empty: none.
  /// Thread-safe.
  [[nodiscard]] std::string autosaveError() const;

 private:
  void onSave(const SaveMap::Request& request, SaveMap::Response& response,
              const CallProgress& progress);
  void onLoad(const LoadMap::Request& request, LoadMap::Response& response,
              const CallProgress& progress);
  StorageAnswer load(const std::string& file, const LoadMap::Request& request,
                     const CallProgress& progress);
  void autosave();
  /// @return Error; empty: it is saved, with its locked boxes.
  [[nodiscard]] std::string saveToAutosaveFile();
  /// saveLocks(); returns its error, and logs it.
  [[nodiscard]] std::string trySaveLocks(const std::string& map_file);
  /// Moves the previous save beside the file, to the earlier ones.
  void keepEarlier();
  /// Chooses another file if this one has a map that the node has neither read nor written.
  void chooseAutosaveFile();
  /// Logs at the start where saves go, and whether they will fail.
  void announceAutosave();

  GuardedMap& map_;
  CallbackGuard& guard_;
  std::string frame_id_;
  SnapshotLimits limits_;  ///< Limits of loaded files.
  std::string autosave_file_;
  int num_earlier_;               ///< Number of saves beside it.
  bool is_earlier_kept_ = false;  ///< The last save has failed, and its earlier save is kept.
  bool is_autosave_own_;          ///< This node has read or written it.
  std::string window_file_;       ///< Store of the window; empty: none.
  /// Revision and locked boxes of the map in these files, or of older ones.
  std::pair<std::uint64_t, std::vector<CellBox>> saved_;
  mutable std::mutex error_mutex_;
  std::string autosave_error_;
  GuardedThread thread_;
  std::optional<LongCall<SaveMap, SaveMapAction>> save_call_;
  std::optional<LongCall<LoadMap, LoadMapAction>> load_call_;
  ros::WallTimer autosave_timer_;
};

}  // namespace cuboid_mapping_ros
