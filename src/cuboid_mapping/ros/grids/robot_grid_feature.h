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

/// The grid that follows the robot.
struct RobotGridParameters {
  std::string frame_id;  ///< Frame of the robot; "": no grid.
  double size_m = 20.0;  ///< Minimum edge of the grid.
  double min_z_m = 0.1;  ///< Lower end of its heights, above the origin of the frame.
  double max_z_m = 1.5;  ///< Upper end.
};

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
    return !parameters.of<RobotGridParameters>().frame_id.empty();
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
