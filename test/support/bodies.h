// SPDX-License-Identifier: BSD-3-Clause
// Bodies and poses of tests; lengths are in metres.
#pragma once

#include "cuboid_mapping/query/pose_query.h"
#include "support/random_shapes.h"

#include <cmath>

namespace cuboid_mapping::test {

/// An upright pose.
inline Eigen::Isometry3d yawed(const Eigen::Vector3d& position, double yaw) {
  return Eigen::Translation3d(position) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
}

/// A body of one box with its origin in the middle.
inline Body boxBody(const Eigen::Vector3d& size_m) {
  return {{}, {{Eigen::Isometry3d::Identity(), size_m}}};
}

/// A body enlarged on all sides.
inline Body grown(Body body, double margin_m) {
  for (BodySphere& sphere : body.spheres) sphere.radius_m += margin_m;
  for (BodyBox& box : body.boxes) box.size_m.array() += 2.0 * margin_m;
  return body;
}

inline Eigen::Isometry3d randomTurnedPose(Random& random, double half_edge_m) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = randomPoint(random, half_edge_m);
  // Rotations about one axis of the map, or by multiples of 90 degrees, have parallel edges.
  const int kind = random.integer(0, 3);
  if (kind == 0) return pose;
  const Eigen::Vector3d axis =
      kind == 1 ? Eigen::Vector3d::UnitZ() : randomDirection(random).normalized().eval();
  const double angle = kind == 2 ? M_PI / 2 * random.integer(0, 3) : random.real(-M_PI, M_PI);
  pose.linear() = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  return pose;
}

/// A body of up to two spheres and two boxes. @param edge_m  Edge of a voxel; parts have 0.01 to 3, rarely 14 voxels.
inline Body randomBody(Random& random, double edge_m) {
  Body body;
  const auto size = [&] { return edge_m * random.real(0.01, random.chance(0.2) ? 14.0 : 3.0); };
  const int num_spheres = random.integer(0, 2);
  for (int i = 0; i < num_spheres; ++i) {
    body.spheres.push_back({randomPoint(random, 0.5), 0.5 * size()});
  }
  const int num_boxes = random.integer(num_spheres == 0 ? 1 : 0, 2);
  for (int i = 0; i < num_boxes; ++i) {
    body.boxes.push_back({randomTurnedPose(random, 0.5), {size(), size(), size()}});
  }
  return body;
}

}  // namespace cuboid_mapping::test
