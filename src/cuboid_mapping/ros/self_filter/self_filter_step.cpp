// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/self_filter/self_filter_step.h"

#include "cuboid_mapping/ros/self_filter/self_filter.h"

namespace cuboid_mapping_ros {

void SelfFilterStep::readReferences(NodeParameters& parameters, const FindText& find_text) {
  loadRobotParts(parameters, find_text);
}

std::vector<StepFrame> SelfFilterStep::frames() const {
  std::vector<StepFrame> frames;
  for (const RobotPart& part : parameters_.parts) {
    frames.push_back({part.frame_id, "a frame of self_filter; see self_filter/ignored_links"});
  }
  return frames;
}

void SelfFilterStep::apply(SensorPart& part, const StepPoses& poses, CloudFigures& figures) const {
  const Eigen::Isometry3d T_map_points =
      part.T_map_cloud * Eigen::Translation3d(part.points.anchor_cloud);
  std::vector<Eigen::Isometry3d> T_part_points;
  for (const Eigen::Isometry3d& T_map_part : poses) {
    T_part_points.push_back(T_map_part.inverse() * T_map_points);
  }
  figures.num_on_robot += removePointsOnRobot(parameters_.parts, T_part_points, part.points.points);
}

std::vector<Eigen::Vector3f> SelfFilterStep::findFreePoints(
    const StepPoses& poses, const Eigen::Vector3d& anchor_map) const {
  if (!parameters_.keep_free) return {};
  return findRobotVoxels(parameters_.parts, poses, grid_, anchor_map);
}

}  // namespace cuboid_mapping_ros
