// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/grids/robot_grid_feature.h"

#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <ros/console.h>

#include <Eigen/Core>

#include <algorithm>
#include <cmath>

namespace cuboid_mapping_ros {
namespace {

using G = RobotGridParameters;

constexpr double kGridLogPeriod_s = 30.0;

/// Voxels that the grid shows.
std::optional<CellBox> findBand(const CuboidMap& map, const RobotGridParameters& parameters,
                                const Eigen::Vector3d& robot_map) {
  const double resolution_m = map.grid().resolution();
  const auto half =
      kBrickEdge * std::max(1, static_cast<std::int32_t>(std::ceil(
                                   0.5 * parameters.size_m / (kBrickEdge * resolution_m) - 1e-6)));
  // Rounds to the nearest border of bricks.
  const Eigen::Vector3d shift(0.5 * kBrickEdge * resolution_m, 0.5 * kBrickEdge * resolution_m,
                              0.0);
  const auto cell = map.grid().toCell(robot_map + shift);
  const auto heights = map.grid().toCellBox(
      {robot_map + Eigen::Vector3d(0.0, 0.0, parameters.min_z_m),
       robot_map + Eigen::Vector3d(resolution_m, resolution_m, parameters.max_z_m)});
  if (!cell || !heights) return std::nullopt;
  const Cell centre = brickOf(*cell);
  return CellBox{{centre.x - half, centre.y - half, heights->min.z},
                 {centre.x + half, centre.y + half, heights->max.z}};
}

/// Grid of a band of heights around a robot, seen from above: 100 if any voxel in it is occupied, else 0 if
/// any is free, else -1.
///
/// The grid is a square along the axes of the map, at least `size` wide, and starts at a multiple of 8 voxels:
/// it moves in steps, and the robot is at most 4 voxels from its centre. Empty if it would leave the map's
/// range.
/// @param robot_map  Origin of the robot's frame. @complexity O(bricks of the band).
nav_msgs::OccupancyGrid makeRobotGrid(const CuboidMap& map, const RobotGridParameters& parameters,
                                      const Eigen::Vector3d& robot_map) {
  nav_msgs::OccupancyGrid grid;
  const auto band = findBand(map, parameters, robot_map);
  layOut(band.value_or(CellBox()), map.grid().resolution(), grid);
  if (!band) return grid;
  map.voxels().forEachIn(*band, [&](const VoxelBrick& brick) {
    const BrickMask seen = BrickMask::ofBox(intersect(*band, brickBox(brick.brick)));
    (brick.voxels.known() & seen).forEach([&](int voxel) {
      const Cell at = brick.brick + Cell{voxel & 7, voxel >> 3 & 7, 0} - band->min;
      auto& value = grid.data[static_cast<std::size_t>(at.y) * grid.info.width +
                              static_cast<std::size_t>(at.x)];
      value = std::max(value, brick.voxels.occupied().test(voxel) ? kOccupiedCell : kFreeCell);
    });
  });
  return grid;
}

}  // namespace

std::optional<nav_msgs::OccupancyGrid> findRobotGrid(const GuardedMap& map,
                                                     const tf2::BufferCore& buffer,
                                                     const NodeParameters& parameters) {
  const RobotGridParameters& options = parameters.of<RobotGridParameters>();
  const std::string frame_id = withoutSlash(parameters.frame_id);
  const TfLookup lookup = lookupTransform(buffer, frame_id, options.frame_id, ros::Time());
  if (!lookup.T_target_source) {
    ROS_WARN_STREAM_THROTTLE_NAMED(kGridLogPeriod_s, kNodeName,
                                   "no " << kRobotGridTopic << ": " << lookup.error);
    return std::nullopt;
  }
  return map.read([&](const CuboidMap& content, const ros::Time& stamp) {
    auto grid = makeRobotGrid(content, options, lookup.T_target_source->translation());
    grid.header.frame_id = frame_id;
    grid.header.stamp = grid.info.map_load_time = stamp;
    return grid;
  });
}

std::vector<ParameterDeclaration> RobotGridFeature::declare() {
  return {
      {"robot_grid/frame", "", frame(&G::frame_id, true),
       "Frame of the robot. robot_grid moves with it. Empty: there is no robot_grid."},
      {"robot_grid/size", "m", number(&G::size_m, 0.1, 1000.0),
       "Extent of robot_grid along x and y, rounded up to a multiple of 16 voxels."},
      {"robot_grid/min_z", "m", number(&G::min_z_m),
       "Cells below this height over the origin of the robot's frame are not in robot_grid.",
       "robot_grid/max_z"},
      {"robot_grid/max_z", "m", number(&G::max_z_m),
       "Cells above this height over the origin of the robot's frame are not in robot_grid."},
  };
}

}  // namespace cuboid_mapping_ros
