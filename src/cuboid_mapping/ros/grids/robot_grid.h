// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/middleware/grid_publisher.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <nav_msgs/OccupancyGrid.h>
#include <ros/node_handle.h>
#include <tf2/buffer_core.h>

#include <Eigen/Core>

#include <optional>
#include <string>

namespace cuboid_mapping_ros {

/// Grid of a band of heights around a robot, seen from above: 100 if any voxel in it is occupied, else 0 if
/// any is free, else -1.
///
/// The grid is a square along the axes of the map, at least `size` wide, and starts at a multiple of 8 voxels:
/// it moves in steps, and the robot is at most 4 voxels from its centre. Empty if it would leave the map's
/// range.
/// @param robot_map  Origin of the robot's frame. @complexity O(bricks of the band).
[[nodiscard]] nav_msgs::OccupancyGrid makeRobotGrid(const CuboidMap& map,
                                                    const RobotGridParameters& parameters,
                                                    const Eigen::Vector3d& robot_map);

/// Grid of the map for the topic robot_grid; nothing, and a warning, without a transform of the robot's frame.
[[nodiscard]] std::optional<nav_msgs::OccupancyGrid> findRobotGrid(
    const GuardedMap& map, const tf2::BufferCore& buffer, const NodeParameters& parameters);

}  // namespace cuboid_mapping_ros
