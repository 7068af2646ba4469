// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/mapping/map_feature.h"
#include "cuboid_mapping/ros/middleware/grid_publisher.h"
#include "cuboid_mapping/ros/middleware/names.h"

#include <nav_msgs/OccupancyGrid.h>

#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Grid of the map for the topic robot_grid; nothing, and a warning, without a transform of the robot's frame.
[[nodiscard]] std::optional<nav_msgs::OccupancyGrid> findRobotGrid(
    const GuardedMap& map, const tf2::BufferCore& buffer, const NodeParameters& parameters);

/// The topics robot_grid and robot_grid_updates: parameters robot_grid/*.
class RobotGridFeature : public MapFeature {
 public:
  explicit RobotGridFeature(const MapHost& host)
      : grid_(host.nh, {kRobotGridTopic, kRobotGridUpdatesTopic, host.parameters.keyframe_period_s},
              [&host] { return findRobotGrid(host.map, host.tf, host.parameters); }) {}
  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  [[nodiscard]] static bool isOn(const NodeParameters& parameters) {
    return !parameters.robot_grid.frame_id.empty();
  }
  [[nodiscard]] std::string name() const override { return kRobotGridTopic; }

  void publish() override {
    grid_.publish();
    grid_.publishKeyframe();
  }

 private:
  GridPublisher grid_;
};

}  // namespace cuboid_mapping_ros
