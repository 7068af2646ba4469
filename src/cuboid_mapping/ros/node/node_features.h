// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/diagnostics/diagnostics.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/mapping/map_feature.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <diagnostic_updater/diagnostic_updater.h>

#include <functional>
#include <vector>

namespace cuboid_mapping_ros {

/// The features of a node, called in the order of the list. What one throws is counted, and keeps the others from
/// nothing; only make(), start(), filter(), prepareMove(), setParameters(), report() and addStatus() pass exceptions on.
///
/// Thread rule: that of each function of MapFeature.
class NodeFeatures {
 public:
  explicit NodeFeatures(CallbackGuard& guard) : guard_(guard) {}
  ~NodeFeatures();
  NodeFeatures(const NodeFeatures&) = delete;
  NodeFeatures& operator=(const NodeFeatures&) = delete;

  void make(const MapHost& host);
  void start();
  void stop() noexcept;

  /// The voxels of a cloud that enter the map: those that the features leave of it.
  [[nodiscard]] const ScanUpdate& filter(const ScanUpdate& update, const CloudInWork& cloud);
  void noteMapped(const MappedCloud& cloud);
  void noteReplaced();
  /// Prepares a move of the whole map. @return To be called once it has moved.
  [[nodiscard]] std::function<void()> prepareMove(const VoxelMotion& motion);

  /// Takes the changes of the map once, gives them to each feature, and lets each publish.
  void publish(GuardedMap& map);
  void setParameters(const NodeParameters& parameters);

  void report(NodeReport& report);
  void addStatus(diagnostic_updater::Updater& diagnostics);

 private:
  CallbackGuard& guard_;
  MapFeatures features_;
  std::vector<bool> is_behind_;  ///< Features that have missed changes. Publishing thread.
};

}  // namespace cuboid_mapping_ros
