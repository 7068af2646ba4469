// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/mapping/map_feature.h"

#include <atomic>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

struct StartParameters {
  std::string box;  ///< The six numbers of start_free; empty: none.
};

/// Makes the unknown voxels around the robot free with the first cloud of a map, also after ~reset and ~load_map, as a
/// passing beam does: the sensor does not see the place where it stands, and a planner would find no way out of it.
/// Parameter start_free.
class StartVolume : public MapFeature {
 public:
  explicit StartVolume(const MapHost& host);
  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  [[nodiscard]] static std::vector<ParameterError> check(const LoadedParameters& loaded);
  [[nodiscard]] static bool isOn(const NodeParameters& parameters) {
    return !parameters.of<StartParameters>().box.empty();
  }
  [[nodiscard]] std::string name() const override { return "start_free"; }
  void onReplaced() override { is_done_ = false; }
  void onCloud(const MappedCloud& cloud) override;

 private:
  const MapHost& host_;
  MetricBox box_base_;
  std::atomic<bool> is_done_{false};
};

/// Makes the unknown voxels free whose centre lies in a box. @param box_base  In a frame with this pose in the map.
ChangeSet freeUnknown(CuboidMap& map, const Eigen::Isometry3d& T_map_base,
                      const MetricBox& box_base);

}  // namespace cuboid_mapping_ros
