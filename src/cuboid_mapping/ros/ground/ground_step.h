// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/mapping/sensor_step.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Limits of the ground: the ground_filter of octomap_server.
struct GroundFilterConfig : StepParameters {
  double distance_m = 0.04;        ///< Maximum distance of a point from its plane.
  double angle_rad = 0.15;         ///< Maximum angle between the plane's normal and z of the base.
  double plane_distance_m = 0.07;  ///< Largest distance of the plane from z = 0 of the base.
};

/// Ground and other points, each in the order of the cloud.
struct GroundSplit {
  std::vector<Eigen::Vector3f> ground;
  std::vector<Eigen::Vector3f> others;
  bool is_plane_found = false;
};

/// Separates the points of the ground from the others.
///
/// Planes that are nearly level are segmented (PCL, RANSAC with a fixed seed) until one lies near
/// z = 0 of the base frame: its points are the ground. Cases:
///   - no such plane: the points within plane_distance_m of z = 0 of the base frame;
///   - fewer than 50 points: none is ground.
///
/// @param T_base_cloud  Takes the points to the robot's base, whose z is up and 0 on the ground.
/// @complexity O(planes n), at most 200 tries a plane.
[[nodiscard]] GroundSplit splitGround(const std::vector<Eigen::Vector3f>& points_cloud,
                                      const Eigen::Isometry3d& T_base_cloud,
                                      const GroundFilterConfig& config);

/// Points of the ground are no obstacles: beams to them free the voxels before their last one, and do not observe that
/// one.
class GroundStep : public SensorStep {
 public:
  GroundStep(const NodeParameters& parameters, const SourceParameters& source)
      : base_frame_id_(parameters.base_frame_id),
        crop_base_(source.crop),
        config_(source.of<GroundFilterConfig>()) {}

  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  [[nodiscard]] static bool isOn(const NodeParameters& /*parameters*/,
                                 const SourceParameters& source) {
    return source.filter_ground;
  }

  [[nodiscard]] std::vector<StepFrame> frames() const override {
    return {{base_frame_id_, "base_frame_id"}};
  }
  void apply(SensorPart& part, const StepPoses& poses, CloudFigures& figures) const override;

 private:
  std::string base_frame_id_;
  MetricBox crop_base_;
  GroundFilterConfig config_;
};

}  // namespace cuboid_mapping_ros
