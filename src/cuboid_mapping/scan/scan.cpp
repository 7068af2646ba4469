// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/scan.h"

#include "cuboid_mapping/geometry/float_anchor.h"

namespace cuboid_mapping {
namespace {

std::vector<Eigen::Vector3f> transform(const Eigen::Isometry3f& T_anchor_cloud,
                                       const std::vector<Eigen::Vector3f>& points_cloud) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(points_cloud.size());
  for (const Eigen::Vector3f& point : points_cloud) points.emplace_back(T_anchor_cloud * point);
  return points;
}

}  // namespace

Scan makeScan(const Eigen::Isometry3d& T_map_cloud, const Eigen::Vector3d& origin_map,
              const std::vector<Eigen::Vector3f>& points_cloud,
              const std::vector<Eigen::Vector3f>& no_returns_cloud) {
  Scan scan;
  scan.anchor_map = (origin_map / kAnchorSpacing_m).array().round().matrix() * kAnchorSpacing_m;
  scan.origin = (origin_map - scan.anchor_map).cast<float>();
  Eigen::Isometry3d T_anchor_cloud = T_map_cloud;
  T_anchor_cloud.translation() -= scan.anchor_map;
  const Eigen::Isometry3f T_anchor_cloud_float = T_anchor_cloud.cast<float>();
  scan.points = transform(T_anchor_cloud_float, points_cloud);
  scan.no_returns = transform(T_anchor_cloud_float, no_returns_cloud);
  return scan;
}

}  // namespace cuboid_mapping
