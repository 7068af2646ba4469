// SPDX-License-Identifier: BSD-3-Clause
// The oracle of robots that turn about z: the columns of voxels that a rectangle covers, one by one. Lengths are in voxels.
#pragma once

#include "cuboid_mapping/query/motion_query.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace cuboid_mapping::test {

/// A box on a grid with voxels of 1 m, whose poses are x, y and heading.
class FlatRobot {
 public:
  struct Shape {
    Eigen::Vector2d half{1.0, 1.0};    ///< Half edges.
    Eigen::Vector2d offset{0.0, 0.0};  ///< Offset of the middle from the axis of its turns.
    double low = -0.5;                 ///< Bottom and top, relative to its origin.
    double high = 0.5;
  };
  using Columns = std::set<std::pair<std::int32_t, std::int32_t>>;

  static constexpr int kHeadings = 16;
  static constexpr std::array<Cell, 10> kSteps{{{1, 0, 0},
                                                {-1, 0, 0},
                                                {0, 1, 0},
                                                {0, -1, 0},
                                                {1, 1, 0},
                                                {1, -1, 0},
                                                {-1, 1, 0},
                                                {-1, -1, 0},
                                                {0, 0, 1},
                                                {0, 0, -1}}};
  /// Room on all sides with which checkMotion() must not refuse a motion: its tolerance in the direction of a corner,
  /// and half a sample.
  static constexpr double kSureMargin = M_SQRT2 * kMotionTolerance + 0.02;

  /// @param margin  Enlarges the robot on all sides.
  FlatRobot(const Shape& shape, double margin) : shape_(shape), margin_(margin) {
    for (int heading = 0; heading < kHeadings; ++heading) {
      const Eigen::Vector3d here(0.5, 0.5, kTurn * heading);
      for (const Cell& by : kSteps) {
        steps_[{heading, by}] = sweep(here, here + Eigen::Vector3d(by.x, by.y, kTurn * by.z));
      }
    }
  }

  [[nodiscard]] Body body() const {
    BodyBox box;
    box.T_body_box.translation() << shape_.offset, 0.5 * (shape_.low + shape_.high);
    box.size_m << 2.0 * shape_.half, shape_.high - shape_.low;
    return {{}, {box}};
  }
  [[nodiscard]] double low() const { return shape_.low; }
  [[nodiscard]] double high() const { return shape_.high; }

  /// Columns that the robot covers on the straight way from pose to pose, with an even turn, in samples.
  [[nodiscard]] Columns sweep(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
    Eigen::Vector3d by = to - from;
    by.z() = std::remainder(by.z(), 2.0 * M_PI);
    const double travel = by.head<2>().norm() + std::abs(by.z()) * reach();
    const int num_samples = static_cast<int>(std::ceil(travel / 0.04));
    Columns columns;
    for (int i = 0; i <= num_samples; ++i) {
      addColumns(from + by * (num_samples == 0 ? 0.0 : 1.0 * i / num_samples), columns);
    }
    return columns;
  }
  /// Columns of a step from the centre of voxel (0, 0).
  [[nodiscard]] const Columns& step(int heading, const Cell& by) const {
    return steps_.at({heading, by});
  }

 private:
  static constexpr double kTurn = 2.0 * M_PI / kHeadings;

  [[nodiscard]] double reach() const { return shape_.offset.norm() + shape_.half.norm(); }

  void addColumns(const Eigen::Vector3d& pose, Columns& columns) const {
    const double around = reach() + margin_ + 1.0;
    for (auto x = static_cast<std::int32_t>(pose.x() - around) - 1; x < pose.x() + around; ++x) {
      for (auto y = static_cast<std::int32_t>(pose.y() - around) - 1; y < pose.y() + around; ++y) {
        if (columns.count({x, y}) == 0 && covers(pose, x, y)) columns.insert({x, y});
      }
    }
  }
  /// Cuts the square by the sides of the rectangle, in its frame; whether something is left.
  [[nodiscard]] bool covers(const Eigen::Vector3d& pose, std::int32_t x, std::int32_t y) const {
    const Eigen::Rotation2Dd turn(-pose.z());
    const Eigen::Vector2d middle =
        turn * (Eigen::Vector2d(x + 0.5, y + 0.5) - pose.head<2>()) - shape_.offset;
    if (((middle.cwiseAbs() - shape_.half).array() > margin_ + 0.75).any()) return false;
    std::vector<Eigen::Vector2d> left;
    for (const auto& corner : {Eigen::Vector2d(x, y), Eigen::Vector2d(x + 1, y),
                               Eigen::Vector2d(x + 1, y + 1), Eigen::Vector2d(x, y + 1)}) {
      left.push_back(turn * (corner - pose.head<2>()) - shape_.offset);
    }
    for (int axis = 0; axis < 2; ++axis) {
      for (const double sign : {1.0, -1.0}) {
        left = cut(left, axis, sign, shape_.half[axis] + margin_ - 1e-6);
      }
    }
    double area = 0.0;
    for (std::size_t i = 0; i < left.size(); ++i) {
      const Eigen::Vector2d& a = left[i];
      const Eigen::Vector2d& b = left[(i + 1) % left.size()];
      area += 0.5 * (a.x() * b.y() - a.y() * b.x());
    }
    return area > 1e-9;
  }
  /// The part of a polygon with sign * coordinate < end.
  static std::vector<Eigen::Vector2d> cut(const std::vector<Eigen::Vector2d>& polygon, int axis,
                                          double sign, double end) {
    std::vector<Eigen::Vector2d> left;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Eigen::Vector2d& a = polygon[i];
      const Eigen::Vector2d& b = polygon[(i + 1) % polygon.size()];
      const double inside_a = end - sign * a[axis];
      const double inside_b = end - sign * b[axis];
      if (inside_a >= 0.0) left.push_back(a);
      if ((inside_a >= 0.0) != (inside_b >= 0.0)) {
        left.push_back(a + (b - a) * (inside_a / (inside_a - inside_b)));
      }
    }
    return left;
  }

  Shape shape_;
  double margin_;
  std::map<std::pair<int, Cell>, Columns> steps_;
};

}  // namespace cuboid_mapping::test
