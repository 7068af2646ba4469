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

/// ~save_map, ~load_map, as services and actions, and the saves to autosave_file and of the window to its store: each period in which the map has
/// changed, and at the end of the node.
///
/// Thread rule: all of it comes one after the other in a thread of its own, so that neither clouds
/// nor queries wait for a disk.
class MapFilesService {
 public:
  /// @param private_nh  Its queue takes goals and cancels of actions. @param map, guard  Must outlive this object.
  MapFilesService(const ros::NodeHandle& private_nh, const NodeParameters& parameters,
                  GuardedMap& map, CallbackGuard& guard);
  ~MapFilesService();
  MapFilesService(const MapFilesService&) = delete;
  MapFilesService& operator=(const MapFilesService&) = delete;

  /// Why the last save to autosave_file failed, or none can succeed; empty: neither. Of any thread.
  [[nodiscard]] std::string autosaveError() const;

 private:
  using SaveMap = cuboid_mapping::SaveMap;
  using LoadMap = cuboid_mapping::LoadMap;

  void advertise(const ros::NodeHandle& nh);
  void onSave(const SaveMap::Request& request, SaveMap::Response& response,
              const CallProgress& progress);
  void onLoad(const LoadMap::Request& request, LoadMap::Response& response,
              const CallProgress& progress);
  StorageAnswer load(const LoadMap::Request& request, const CallProgress& progress);
  void autosave();
  /// Puts the save before this one beside it, with those before that.
  void keepEarlier();
  /// Chooses another file where that one holds what this node has neither read nor written.
  void chooseAutosaveFile();
  /// Says at the start where saves go, and whether they cannot.
  void announceAutosave();

  GuardedMap& map_;
  CallbackGuard& guard_;
  std::string frame_id_;
  cuboid_mapping::SnapshotLimits limits_;  ///< Limits of loaded files.
  std::string autosave_file_;
  int num_earlier_;               ///< Saves that stay beside it.
  bool is_earlier_kept_ = false;  ///< Of what is there now: the last save has failed.
  bool is_autosave_own_;          ///< It was read, or written.
  /// Revision and locked boxes of the map in autosave_file, or older ones.
  std::pair<std::uint64_t, std::vector<cuboid_mapping::CellBox>> saved_;
  mutable std::mutex error_mutex_;
  std::string autosave_error_;
  GuardedThread thread_;
  std::optional<LongCall<SaveMap, cuboid_mapping::SaveMapAction>> save_call_;
  std::optional<LongCall<LoadMap, cuboid_mapping::LoadMapAction>> load_call_;
  ros::WallTimer autosave_timer_;
};

}  // namespace cuboid_mapping_ros
