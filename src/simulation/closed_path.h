// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <vector>

namespace cuboid_mapping {

/// A closed path in the plane: straight legs, joined by arcs that both legs touch.
///
/// Thread-safe: const.
class ClosedPath {
 public:
  /// A place on the path and the direction of travel there.
  struct Place {
    Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
    double heading_rad = 0.0;  ///< Heading, anticlockwise from +x.
  };

  /// @param corners_m  At least three, in order; the path goes back from the last to the first. It
  ///                   does not turn back on itself.
  /// @param corner_radius_m  > 0, and so small that a leg remains between the arcs of two neighbours.
  ClosedPath(const std::vector<Eigen::Vector2d>& corners_m, double corner_radius_m);

  [[nodiscard]] double length() const { return length_m_; }

  /// The place after `distance_m` of travel; 0 is the end of the arc at the first corner. Any
  /// number: the path repeats, backwards if it is negative.
  [[nodiscard]] Place computePlace(double distance_m) const;

 private:
  /// A piece of constant curvature.
  struct Piece {
    Place start;
    double start_distance_m;
    double curvature_per_m;  ///< 0 on a leg, > 0 turning left.
  };

  void add(const Place& start, double length_m, double curvature_per_m);

  std::vector<Piece> pieces_;
  double length_m_ = 0.0;
};

}  // namespace cuboid_mapping
