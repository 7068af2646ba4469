// SPDX-License-Identifier: BSD-3-Clause
// Tests parts of a body against cubes of the grid. All lengths are in voxels.
#pragma once

#include "cuboid_mapping/geometry/grid.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace cuboid_mapping {

/// Overlaps up to this, in voxels, do not count, as in Grid::toCellBox.
constexpr double kNoOverlap = 1e-6;

/// std::floor() without a call, to 2^-22. @pre The value lies in the range of cells.
[[nodiscard]] inline std::int32_t floorToCell(double value) {
  constexpr double kOffset = 2147483648.0;
  return static_cast<std::int32_t>(static_cast<std::int64_t>(value + kOffset) -
                                   static_cast<std::int64_t>(kOffset));
}

/// A box that contains all cells that a shape with this centre and reach may overlap by more than kNoOverlap.
[[nodiscard]] inline CellBox cellsAround(const Eigen::Vector3d& center,
                                         const Eigen::Vector3d& reach) {
  constexpr double kSure = 0.5 * kNoOverlap;
  CellBox box;
  for (int axis = 0; axis < 3; ++axis) {
    box.min[axis] = floorToCell(center[axis] - reach[axis] + kSure);
    box.max[axis] = floorToCell(center[axis] + reach[axis] - kSure) + 1;
  }
  return box;
}

/// A cube of the grid: a voxel or a brick.
struct Cube {
  Eigen::Vector3d center;
  double half;  ///< Half of an edge.

  [[nodiscard]] static Cube of(const Cell& least, double edge) {
    return {toVector(least).array() + 0.5 * edge, 0.5 * edge};
  }
};

/// A ball.
class Ball {
 public:
  Ball(const Eigen::Vector3d& center, double radius)
      : center_(center), radius_(radius), square_((radius - kNoOverlap) * (radius - kNoOverlap)) {}

  [[nodiscard]] const Eigen::Vector3d& center() const { return center_; }
  [[nodiscard]] Cell centerCell() const {
    return {floorToCell(center_.x()), floorToCell(center_.y()), floorToCell(center_.z())};
  }
  [[nodiscard]] double radius() const { return radius_; }
  [[nodiscard]] CellBox bounds() const {
    return cellsAround(center_, Eigen::Vector3d::Constant(radius_));
  }
  [[nodiscard]] bool meets(const Cube& cube) const {
    const Eigen::Array3d away = (center_ - cube.center).array().abs() - cube.half;
    return away.max(0.0).square().sum() < square_;
  }

 private:
  Eigen::Vector3d center_;
  double radius_;
  double square_;
};

/// A rotated box.
class TurnedBox {
 public:
  /// @param turn  Columns: directions of the edges.
  TurnedBox(const Eigen::Vector3d& center, const Eigen::Matrix3d& turn, const Eigen::Vector3d& half)
      : center_(center), bounds_(cellsAround(center, turn.cwiseAbs() * half)) {
    for (int i = 0; i < 3; ++i) add(Eigen::Vector3d::Unit(i), turn, half);
    for (int i = 0; i < 3; ++i) add(turn.col(i), turn, half);
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) add(Eigen::Vector3d::Unit(i).cross(turn.col(k)), turn, half);
    }
  }

  [[nodiscard]] const CellBox& bounds() const { return bounds_; }
  [[nodiscard]] bool meets(const Cube& cube) const {
    const Eigen::Vector3d apart = cube.center - center_;
    return std::all_of(axes_.begin(), axes_.begin() + num_axes_, [&](const Axis& axis) {
      return std::abs(axis.normal.dot(apart)) <
             axis.reach + cube.half * axis.reach_of_cube - kNoOverlap;
    });
  }

 private:
  /// An axis on which the projections may not overlap.
  struct Axis {
    Eigen::Vector3d normal;
    double reach;          ///< Distance from the box's centre to a corner.
    double reach_of_cube;  ///< The same for a cube with edges of length 2.
  };

  /// gcc 9.3 ends with an internal error where it puts this into the loops of the constructor.
  __attribute__((noinline)) void add(const Eigen::Vector3d& axis, const Eigen::Matrix3d& turn,
                                     const Eigen::Vector3d& half) {
    // Edges are parallel: the other axes decide.
    constexpr double kParallel = 1e-6;
    const double length = axis.norm();
    if (length < kParallel) return;
    const Eigen::Vector3d normal = axis / length;
    axes_[num_axes_++] = {normal, (turn.transpose() * normal).cwiseAbs().dot(half),
                          normal.cwiseAbs().sum()};
  }

  Eigen::Vector3d center_;
  CellBox bounds_;
  std::array<Axis, 15> axes_;
  std::ptrdiff_t num_axes_ = 0;
};

}  // namespace cuboid_mapping
