// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/closed_path.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace cuboid_mapping {
namespace {

double computeHeading(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  return std::atan2(to.y() - from.y(), to.x() - from.x());
}

/// The difference of two headings, from -pi to pi.
double computeTurn(double from_rad, double to_rad) {
  return std::remainder(to_rad - from_rad, 2 * M_PI);
}

}  // namespace

ClosedPath::ClosedPath(const std::vector<Eigen::Vector2d>& corners_m, double corner_radius_m) {
  const std::size_t count = corners_m.size();
  assert(count >= 3 && corner_radius_m > 0.0);
  const auto corner = [&](std::size_t index) { return corners_m[index % count]; };
  const auto turn_at = [&](std::size_t index) {
    return computeTurn(computeHeading(corner(index + count - 1), corner(index)),
                       computeHeading(corner(index), corner(index + 1)));
  };
  // Distance from a corner at which its arc begins and ends.
  const auto cut_at = [&](std::size_t index) {
    return corner_radius_m * std::tan(std::abs(turn_at(index)) / 2);
  };
  for (std::size_t i = 0; i < count; ++i) {
    const double heading = computeHeading(corner(i), corner(i + 1));
    const Eigen::Vector2d direction(std::cos(heading), std::sin(heading));
    const Eigen::Vector2d leg_end = corner(i + 1) - direction * cut_at(i + 1);
    const Eigen::Vector2d leg_start = corner(i) + direction * cut_at(i);
    assert((leg_end - leg_start).dot(direction) >= 0.0);
    add({leg_start, heading}, (leg_end - leg_start).norm(), 0.0);
    const double turn = turn_at(i + 1);
    add({leg_end, heading}, corner_radius_m * std::abs(turn),
        std::copysign(1.0 / corner_radius_m, turn));
  }
}

void ClosedPath::add(const Place& start, double length_m, double curvature_per_m) {
  pieces_.push_back({start, length_m_, curvature_per_m});
  length_m_ += length_m;
}

ClosedPath::Place ClosedPath::computePlace(double distance_m) const {
  double along = std::fmod(distance_m, length_m_);
  if (along < 0.0) along += length_m_;
  const auto next = std::upper_bound(
      pieces_.begin() + 1, pieces_.end(), along,
      [](double distance, const Piece& piece) { return distance < piece.start_distance_m; });
  const Piece& piece = *(next - 1);
  const double rest = along - piece.start_distance_m;
  const double from = piece.start.heading_rad;
  const double to = from + rest * piece.curvature_per_m;
  const Eigen::Vector2d way =
      piece.curvature_per_m == 0.0
          ? Eigen::Vector2d(rest * std::cos(from), rest * std::sin(from))
          : Eigen::Vector2d((std::sin(to) - std::sin(from)) / piece.curvature_per_m,
                            (std::cos(from) - std::cos(to)) / piece.curvature_per_m);
  return {piece.start.position_m + way, to};
}

}  // namespace cuboid_mapping
