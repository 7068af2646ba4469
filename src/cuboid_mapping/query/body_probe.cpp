// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/body_probe.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace cuboid_mapping {
namespace {

/// The growth of a body that stands still: none.
struct NoGrowth {
  [[nodiscard]] double of(const BodySphere& /*sphere*/) const { return 0.0; }
  [[nodiscard]] Eigen::Vector3d of(const BodyBox& /*box*/) const { return Eigen::Vector3d::Zero(); }
};

/// Growth of radii and half edges, in metres, with which a part covers its sway: a turn moves a point p by at most
/// angle * |axis x p|, perpendicular to the axis.
struct SwayGrowth {
  const Sway& sway;

  [[nodiscard]] double of(const BodySphere& sphere) const {
    return sway.shift_body.norm() + sway.turn_body.cross(sphere.center_body).norm();
  }
  [[nodiscard]] Eigen::Vector3d of(const BodyBox& box) const {
    double turned_m = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      turned_m = std::max(turned_m, sway.turn_body.cross(cornerOf(box, corner)).norm());
    }
    const Eigen::Vector3d axis_body = sway.turn_body.normalized();
    Eigen::Vector3d growth_m;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d edge_body = box.T_body_box.linear().col(i);
      growth_m[i] =
          std::abs(edge_body.dot(sway.shift_body)) + turned_m * axis_body.cross(edge_body).norm();
    }
    return growth_m;
  }
};

/// Whether a matrix is a rotation; false with NaN.
bool isTurn(const Eigen::Matrix3d& turn) {
  constexpr double kTolerance = 1e-6;
  const Eigen::Vector3d x = turn.col(0);
  const Eigen::Vector3d y = turn.col(1);
  return std::abs(x.squaredNorm() - 1.0) < kTolerance &&
         std::abs(y.squaredNorm() - 1.0) < kTolerance && std::abs(x.dot(y)) < kTolerance &&
         (x.cross(y) - turn.col(2)).squaredNorm() < kTolerance * kTolerance;
}

}  // namespace

/// An obstacle that a shape meets, or a voxel outside the region, valid until the next call; null: none, or the
/// budget is spent.
template <typename ShapeT>
const Cell* BodyProbe::findMet(const ShapeT& shape) {
  if (region_ && !region_->contains(shape.bounds())) return keep(shape.bounds().min);
  if constexpr (std::is_same_v<ShapeT, Ball>) {
    return near_.findMet(shape);
  } else {
    const auto met = findMetByBrick(shape, cache_);
    return met ? keep(*met) : nullptr;
  }
}

template <typename GrowthT>
std::optional<PoseContact> BodyProbe::find(const Eigen::Isometry3d& T_map_body,
                                           const GrowthT& growth) {
  ++num_poses_;
  std::size_t part = 0;
  for (const BodySphere& sphere : body_.spheres) {
    const Eigen::Vector3d center_map =
        T_map_body.linear() * sphere.center_body + T_map_body.translation();
    const double radius_m = sphere.radius_m + growth.of(sphere) + margin_body_.maxCoeff();
    const Ball ball(grid_.toCellUnits(center_map), radius_m * grid_.inverseResolution());
    if (const Cell* voxel = findMet(ball)) return PoseContact{part, *voxel};
    ++part;
  }
  for (const BodyBox& box : body_.boxes) {
    const Eigen::Isometry3d T_map_box = T_map_body * box.T_body_box;
    const Eigen::Vector3d half_m = 0.5 * box.size_m + growth.of(box) +
                                   box.T_body_box.linear().cwiseAbs().transpose() * margin_body_;
    const TurnedBox turned(grid_.toCellUnits(T_map_box.translation()), T_map_box.linear(),
                           grid_.toCellUnits(half_m));
    if (const Cell* voxel = findMet(turned)) return PoseContact{part, *voxel};
    ++part;
  }
  return std::nullopt;
}

std::optional<PoseContact> BodyProbe::findContact(const Eigen::Isometry3d& T_map_body) {
  return find(T_map_body, NoGrowth());
}

std::optional<PoseContact> BodyProbe::findContact(const Eigen::Isometry3d& T_map_body,
                                                  const Sway& sway) {
  return find(T_map_body, SwayGrowth{sway});
}

double rangeOf(const Body& body, const Grid& grid) {
  return (Grid::kMaxCell - 1) * grid.resolution() - reachOf(body);
}

bool isPose(const Eigen::Isometry3d& pose, double range_m) {
  return (pose.translation().array().abs() <= range_m).all() && isTurn(pose.linear());
}

}  // namespace cuboid_mapping
