// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"

#include <Eigen/Geometry>

#include <cmath>
#include <vector>

namespace cuboid_mapping {

/// Angle from the map's x axis to that of an upright pose [rad].
[[nodiscard]] double headingOf(const Eigen::Isometry3d& pose);

/// The angle between two headings, 0 to pi.
[[nodiscard]] inline double angleBetween(double a, double b) {
  return std::abs(std::remainder(a - b, 2.0 * M_PI));
}

/// A place and a heading of a lattice.
struct LatticePose {
  Cell place;       ///< x and y: the voxel. z: planes above the first one.
  int heading = 0;  ///< 0 to kNumHeadings - 1.
};

/// Lattice of upright poses in voxel centres, in planes one voxel apart.
class PoseLattice {
 public:
  static constexpr int kNumHeadings = 16;
  static constexpr double kTurn = 2.0 * M_PI / kNumHeadings;  ///< Angle between two headings [rad].

  /// @param height_m  Height of the first plane. @param has_planes  Whether there are other planes.
  PoseLattice(const Grid& grid, double height_m, bool has_planes)
      : edge_m_(grid.resolution()), height_m_(height_m), has_planes_(has_planes) {}

  /// Centre of a place, metres.
  [[nodiscard]] Eigen::Vector3d position(const Cell& place) const {
    return {(place.x + 0.5) * edge_m_, (place.y + 0.5) * edge_m_, place.z * edge_m_ + height_m_};
  }
  [[nodiscard]] Eigen::Isometry3d pose(const LatticePose& at) const;
  /// The poses one step away.
  void findNeighbors(const LatticePose& at, std::vector<LatticePose>& neighbors) const;
  /// The poses less than one step away on each axis and in heading; without other planes, at any height.
  [[nodiscard]] std::vector<LatticePose> findAround(const Eigen::Isometry3d& pose) const;

 private:
  double edge_m_;
  double height_m_;
  bool has_planes_;
};

}  // namespace cuboid_mapping
