// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/LoadMap.h"
#include "cuboid_mapping/SaveMap.h"
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/ros/map/map_storage.h"
#include "cuboid_mapping/ros/mapping/map_feature.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/node_handle.h>
#include <ros/service_server.h>

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

/// ~save_map and ~load_map; and saves to autosave_file, and of the window to its store, with locked boxes,
/// after each period with changes and at the end of the node, which ends running calls.
///
/// Thread rule: all work runs one after the other in the threads of services, so that neither clouds
/// nor queries wait for a disk. The node stops these threads before it destroys this object.
class MapFiles : public MapFeature {
 public:
  explicit MapFiles(const MapHost& host);
  ~MapFiles() override;
  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  [[nodiscard]] static std::vector<ParameterError> check(const LoadedParameters& loaded);
  [[nodiscard]] std::string name() const override { return "files"; }
  void report(NodeReport& report) override;

 private:
  void onSave(const SaveMap::Request& request, SaveMap::Response& response);
  void onLoad(const LoadMap::Request& request, LoadMap::Response& response);
  StorageAnswer load(const std::string& file, const LoadMap::Request& request);
  void autosave();
  /// @return Error; empty: it is saved, with its locked boxes.
  [[nodiscard]] std::string saveToAutosaveFile();
  /// saveLocks(); returns its error, and logs it.
  [[nodiscard]] std::string trySaveLocks(const std::string& map_file);
  /// The node has read or written a file: if it is autosave_file, saves may replace it.
  void noteOwn(const std::string& file);
  /// Whether autosave_file is as this node has last read or written it.
  [[nodiscard]] bool isOwn() const;
  /// Chooses another file if this one has a map that the node has neither read nor written, as of another node.
  void chooseAutosaveFile();
  /// Logs at the start where saves go, and whether they will fail.
  void announceAutosave();

  const MapHost& host_;
  GuardedMap& map_;
  std::string frame_id_;
  SnapshotLimits limits_;  ///< Limits of loads and saves.
  std::string autosave_file_;
  /// The file as this node has last read or written it; nothing: not yet.
  std::optional<FileVersion> autosave_version_;
  std::string window_file_;  ///< Store of the window; empty: none.
  /// Revision and locked boxes of the map in these files, or of older ones.
  std::pair<std::uint64_t, std::vector<CellBox>> saved_;
  mutable std::mutex error_mutex_;
  /// Error of the last save to autosave_file or of locked boxes, or the reason why none can succeed; empty: none.
  std::string autosave_error_;
  std::mutex work_mutex_;
  std::vector<ros::ServiceServer> servers_;
  Timer autosave_timer_;
};

}  // namespace cuboid_mapping_ros
