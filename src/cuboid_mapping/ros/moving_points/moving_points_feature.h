// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/clouds/moving_filter.h"
#include "cuboid_mapping/ros/mapping/map_feature.h"

#include <ros/publisher.h>

#include <functional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Publishes points of moving objects, or keeps them out of the map: the parameter moving_points.
class MovingPointsFeature : public MapFeature {
 public:
  explicit MovingPointsFeature(const MapHost& host);

  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  [[nodiscard]] static bool isOn(const NodeParameters& parameters);

  [[nodiscard]] std::string name() const override { return "moving points"; }
  [[nodiscard]] const ScanUpdate& filter(const ScanUpdate& update,
                                         const CloudInWork& cloud) override;
  void onReplaced() override { filter_.reset(); }
  [[nodiscard]] std::function<void()> prepareMove(const VoxelMotion& motion) override;

 private:
  std::string frame_id_;
  MovingFilter filter_;
  ros::Publisher publisher_;
};

}  // namespace cuboid_mapping_ros
