// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/ground/ground_step.h"

#include "cuboid_mapping/ros/ground/ground_filter.h"
#include "cuboid_mapping/scan/scan_filter.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <utility>

namespace cuboid_mapping_ros {

std::vector<ParameterDeclaration> GroundStep::declare() {
  using O = OctomapServerParameters;
  using P = NodeParameters;
  using S = SourceParameters;
  return {
      {"base_frame_id", "", frame({&P::octomap_server, &O::base_frame_id}, false),
       "Frame of the robot with z = 0 on the ground. Used by filter_ground and start_free."},
      {"filter_ground", "", boolean(&S::filter_ground),
       "true: points on the ground are no obstacles, but their beams clear space."},
      {"ground_filter/distance", "m",
       number({&S::ground_filter, &GroundFilterConfig::distance_m}, 0.001, 1.0),
       "Points closer to the ground plane than this belong to the ground."},
      {"ground_filter/angle", "rad",
       number({&S::ground_filter, &GroundFilterConfig::angle_rad}, 0.001, 15.0),
       "Largest angle between the ground plane and the xy plane of base_frame_id."},
      {"ground_filter/plane_distance", "m",
       number({&S::ground_filter, &GroundFilterConfig::plane_distance_m}, 0.001, 1.0),
       "Largest height of the ground plane above or below z = 0 of base_frame_id."},
  };
}

void GroundStep::apply(SensorPart& part, const StepPoses& poses, CloudFigures& figures) const {
  std::vector<Eigen::Vector3f>& points = part.points.points;
  const Eigen::Isometry3d T_base_points =
      poses.at(0).inverse() * part.T_map_cloud * Eigen::Translation3d(part.points.anchor_cloud);
  // As octomap_server: points outside the limits do not take part in the search for the ground.
  const auto is_outside = [&](const Eigen::Vector3f& point) {
    return !isInside(crop_base_, T_base_points * point.cast<double>());
  };
  const auto end = std::remove_if(points.begin(), points.end(), is_outside);
  figures.num_filtered += static_cast<std::uint64_t>(std::distance(end, points.end()));
  points.erase(end, points.end());
  GroundSplit split = splitGround(points, T_base_points, config_);
  points = std::move(split.others);
  part.open_ends = std::move(split.ground);
}

}  // namespace cuboid_mapping_ros
