// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cuboid_mapping {
namespace {

constexpr double kNoHit = std::numeric_limits<double>::infinity();

/// A vector rotated about the vertical axis.
Eigen::Vector3d computeTurned(const Eigen::Vector3d& vector, double yaw_rad) {
  const double c = std::cos(yaw_rad);
  const double s = std::sin(yaw_rad);
  return {c * vector.x() - s * vector.y(), s * vector.x() + c * vector.y(), vector.z()};
}

/// Distance from a point to a box around the origin, negative inside; any number of axes.
template <typename VectorT>
double computeDistanceToCentredBox(const VectorT& point, const VectorT& half_size) {
  const VectorT outside = point.cwiseAbs() - half_size;
  return outside.cwiseMax(0.0).norm() + std::min(outside.maxCoeff(), 0.0);
}

/// The first range at which the beam is within the circle, and within z of the cylinder.
double computeCylinderRange(const Cylinder& cylinder, const Beam& beam) {
  const Eigen::Vector2d from_axis = beam.start.head<2>() - cylinder.axis_m;
  const Eigen::Vector2d direction = beam.direction.head<2>();
  const double to_bottom = (cylinder.bottom_m - beam.start.z()) * beam.inverse_direction.z();
  const double to_top = (cylinder.top_m - beam.start.z()) * beam.inverse_direction.z();
  double enter = std::max(0.0, std::min(to_bottom, to_top));
  double leave = std::min(kNoHit, std::max(to_bottom, to_top));

  // |from_axis + t * direction|^2 = radius^2, as a t^2 + 2 b t + c = 0.
  const double a = direction.squaredNorm();
  const double c = from_axis.squaredNorm() - cylinder.radius_m * cylinder.radius_m;
  if (a == 0.0) {
    if (c > 0.0) return kNoHit;  // parallel to the axis, outside
  } else {
    const double b = from_axis.dot(direction);
    const double discriminant = b * b - a * c;
    if (discriminant < 0.0) return kNoHit;
    const double root = std::sqrt(discriminant);
    enter = std::max(enter, (-b - root) / a);
    leave = std::min(leave, (-b + root) / a);
  }
  return enter <= leave ? enter : kNoHit;
}

struct RangeAlong {
  const Beam& beam;

  double operator()(const MetricBox& box) const { return computeRange(box, beam); }
  double operator()(const RotatedBox& box) const {
    const Beam turned(computeTurned(beam.start - box.center_m, -box.yaw_rad),
                      computeTurned(beam.direction, -box.yaw_rad));
    return computeRange(MetricBox{-box.half_size_m, box.half_size_m}, turned);
  }
  double operator()(const Cylinder& cylinder) const { return computeCylinderRange(cylinder, beam); }
};

struct DistanceTo {
  const Eigen::Vector3d& point;

  double operator()(const MetricBox& box) const {
    return computeDistanceToCentredBox<Eigen::Vector3d>(point - (box.min_m + box.max_m) / 2,
                                                        (box.max_m - box.min_m) / 2);
  }
  double operator()(const RotatedBox& box) const {
    return computeDistanceToCentredBox<Eigen::Vector3d>(
        computeTurned(point - box.center_m, -box.yaw_rad), box.half_size_m);
  }
  double operator()(const Cylinder& cylinder) const {
    const double middle = (cylinder.bottom_m + cylinder.top_m) / 2;
    return computeDistanceToCentredBox<Eigen::Vector2d>(
        {(point.head<2>() - cylinder.axis_m).norm(), point.z() - middle},
        {cylinder.radius_m, cylinder.top_m - middle});
  }
};

struct Bounds {
  MetricBox operator()(const MetricBox& box) const { return box; }
  MetricBox operator()(const RotatedBox& box) const {
    const double c = std::abs(std::cos(box.yaw_rad));
    const double s = std::abs(std::sin(box.yaw_rad));
    const Eigen::Vector3d half(c * box.half_size_m.x() + s * box.half_size_m.y(),
                               s * box.half_size_m.x() + c * box.half_size_m.y(),
                               box.half_size_m.z());
    return {box.center_m - half, box.center_m + half};
  }
  MetricBox operator()(const Cylinder& cylinder) const {
    const Eigen::Vector2d radius = Eigen::Vector2d::Constant(cylinder.radius_m);
    MetricBox bounds;
    bounds.min_m << cylinder.axis_m - radius, cylinder.bottom_m;
    bounds.max_m << cylinder.axis_m + radius, cylinder.top_m;
    return bounds;
  }
};

struct MovedBy {
  const Eigen::Vector3d& offset_m;

  Shape operator()(const MetricBox& box) const {
    return MetricBox{box.min_m + offset_m, box.max_m + offset_m};
  }
  Shape operator()(const RotatedBox& box) const {
    return RotatedBox{box.center_m + offset_m, box.half_size_m, box.yaw_rad};
  }
  Shape operator()(const Cylinder& cylinder) const {
    return Cylinder{cylinder.axis_m + offset_m.head<2>(), cylinder.radius_m,
                    cylinder.bottom_m + offset_m.z(), cylinder.top_m + offset_m.z()};
  }
};

}  // namespace

Beam::Beam(const Eigen::Vector3d& start_map, const Eigen::Vector3d& direction_map)
    : start(start_map),
      direction(direction_map.normalized()),
      inverse_direction(direction.cwiseInverse()) {}

double computeRange(const Shape& shape, const Beam& beam) {
  return std::visit(RangeAlong{beam}, shape);
}

double computeSignedDistance(const Shape& shape, const Eigen::Vector3d& point_map) {
  return std::visit(DistanceTo{point_map}, shape);
}

MetricBox computeBounds(const Shape& shape) { return std::visit(Bounds{}, shape); }

Shape computeMoved(const Shape& shape, const Eigen::Vector3d& offset_m) {
  return std::visit(MovedBy{offset_m}, shape);
}

}  // namespace cuboid_mapping
