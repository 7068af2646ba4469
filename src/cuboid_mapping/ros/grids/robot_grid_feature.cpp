// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/grids/robot_grid_feature.h"

#include "cuboid_mapping/ros/parameters/parameter_table.h"

namespace cuboid_mapping_ros {
namespace {

using P = NodeParameters;

}  // namespace

std::vector<ParameterDeclaration> RobotGridFeature::declare() {
  return {
      {"robot_grid/frame", "", frame({&P::robot_grid, &RobotGridParameters::frame_id}, true),
       "Frame of the robot. robot_grid moves with it. Empty: there is no robot_grid."},
      {"robot_grid/size", "m", number({&P::robot_grid, &RobotGridParameters::size_m}, 0.1, 1000.0),
       "Extent of robot_grid along x and y, rounded up to a multiple of 16 voxels."},
      {"robot_grid/min_z", "m", number({&P::robot_grid, &RobotGridParameters::min_z_m}),
       "Cells below this height over the origin of the robot's frame are not in robot_grid."},
      {"robot_grid/max_z", "m", number({&P::robot_grid, &RobotGridParameters::max_z_m}),
       "Cells above this height over the origin of the robot's frame are not in robot_grid."},
  };
}

std::vector<ParameterError> RobotGridFeature::check(const LoadedParameters& loaded) {
  const RobotGridParameters& robot_grid = loaded.parameters.robot_grid;
  std::vector<ParameterError> errors;
  checkOrder(loaded, "robot_grid/min_z", robot_grid.min_z_m, "robot_grid/max_z", robot_grid.max_z_m,
             errors);
  return errors;
}

}  // namespace cuboid_mapping_ros
