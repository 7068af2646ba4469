// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"

#include <Eigen/Core>

#include <algorithm>
#include <limits>
#include <variant>

namespace cuboid_mapping {

/// A half-line along which a range sensor measures, map frame.
struct Beam {
  /// @param direction_map  Not zero; scaled to length 1.
  Beam(const Eigen::Vector3d& start_map, const Eigen::Vector3d& direction_map);

  Eigen::Vector3d start;              ///< Metres.
  Eigen::Vector3d direction;          ///< Length 1.
  Eigen::Vector3d inverse_direction;  ///< 1 / direction per axis, infinite where that is zero.
};

/// A box rotated about its vertical axis.
struct RotatedBox {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d half_size_m = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
};

/// An upright cylinder.
struct Cylinder {
  Eigen::Vector2d axis_m = Eigen::Vector2d::Zero();  ///< x and y of its axis.
  double radius_m = 0.0;
  double bottom_m = 0.0;  ///< z of the lower face.
  double top_m = 0.0;     ///< z of the upper face.
};

/// Closed volume of a simulated world, map frame.
using Shape = std::variant<MetricBox, RotatedBox, Cylinder>;

/// The distance along the beam at which it first meets the shape.
///
/// Cases:
///   - the beam starts inside: 0;
///   - the shape is missed, or lies behind the start: infinity;
///   - the beam only touches an edge or slides along a face: hit or miss, depending on rounding.
[[nodiscard]] double computeRange(const Shape& shape, const Beam& beam);

/// As above; inline, since a lidar calls it for each beam and most solids.
[[nodiscard]] inline double computeRange(const MetricBox& box, const Beam& beam);

/// The distance from a point to the surface in metres, negative inside.
[[nodiscard]] double computeSignedDistance(const Shape& shape, const Eigen::Vector3d& point_map);

/// The smallest axis-aligned box around the shape.
[[nodiscard]] MetricBox computeBounds(const Shape& shape);

/// The shape moved by an offset in metres.
[[nodiscard]] Shape computeMoved(const Shape& shape, const Eigen::Vector3d& offset_m);

// A beam in a plane of a face gives 0 * infinity = NaN here. The order of the arguments of min and
// max keeps NaN out of the results.
double computeRange(const MetricBox& box, const Beam& beam) {
  double enter = 0.0;
  double leave = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double to_min = (box.min_m[axis] - beam.start[axis]) * beam.inverse_direction[axis];
    const double to_max = (box.max_m[axis] - beam.start[axis]) * beam.inverse_direction[axis];
    enter = std::max(enter, std::min(to_min, to_max));
    leave = std::min(leave, std::max(to_min, to_max));
  }
  return enter <= leave ? enter : std::numeric_limits<double>::infinity();
}

}  // namespace cuboid_mapping
