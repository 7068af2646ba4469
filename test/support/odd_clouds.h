// SPDX-License-Identifier: BSD-3-Clause
// Clouds that are hard for a walk that takes many beams at once.
#pragma once

#include "cuboid_mapping/scan/scan.h"
#include "support/random.h"

#include <Eigen/Geometry>

#include <cmath>
#include <limits>

namespace cuboid_mapping::test {

/// Ranges of the readings of an image.
class OddRanges {
 public:
  explicit OddRanges(Random& random)
      : random_(random),
        kind_(random.integer(0, 6)),
        near_m_(random.real(0.01, 3.0)),
        far_m_(random.real(0.1, 12.0)),
        wave_(random.real(0.02, 0.5)) {}

  [[nodiscard]] double at(int column, int row) {
    switch (kind_) {
      case 0: return far_m_;                                      // A wall.
      case 1: return (column + row) % 2 == 0 ? near_m_ : far_m_;  // A checkerboard.
      case 2: return (column / 5 + row / 3) % 2 == 0 ? near_m_ : far_m_;
      case 3: return random_.real(0.0, far_m_);  // Noise.
      case 4: return near_m_ + std::abs(std::sin(wave_ * column) * std::cos(wave_ * row)) * far_m_;
      case 5: return row % 4 == 0 ? far_m_ : near_m_;  // Rings.
      default: return column > row ? far_m_ * (1.0 + 0.001 * row) : near_m_;
    }
  }

 private:
  Random& random_;
  int kind_;
  double near_m_;
  double far_m_;
  double wave_;
};

/// A cloud of an image of random size, ranges and pose. Its origin may lie on borders of voxels or far from
/// the map's; some readings may be NaN, no-returns, or all the same.
inline Scan oddCloud(Random& random, double resolution_m) {
  constexpr int kMaxEdge = 60;
  Scan scan;
  if (random.chance(0.1)) scan.anchor_map.setConstant(random.chance(0.5) ? 1e6 : -1024.0);
  for (int axis = 0; axis < 3; ++axis) {
    const double origin_m = random.real(-3.0, 3.0);
    const bool is_on_border = random.chance(0.25);
    scan.origin[axis] = static_cast<float>(
        is_on_border ? std::round(origin_m / resolution_m) * resolution_m : origin_m);
  }
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (random.chance(0.7)) {
    turn = Eigen::AngleAxisd(random.real(-3.2, 3.2),
                             Eigen::Vector3d(random.real(-1.0, 1.0), random.real(-1.0, 1.0),
                                             random.real(0.1, 1.0))
                                 .normalized())
               .toRotationMatrix();
  }
  const int columns = random.integer(1, kMaxEdge);
  const int rows = random.integer(1, kMaxEdge);
  const double width = random.real(0.0, 2.5);
  const double height = random.real(0.0, 1.5);
  const bool is_wide = random.chance(0.2);  // All round, as of a spinning lidar.
  const double hole_share = random.chance(0.3) ? random.real(0.0, 0.6) : 0.0;
  const double no_return_share = random.chance(0.3) ? random.real(0.0, 1.0) : 0.0;
  OddRanges ranges(random);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const double right = columns > 1 ? width * (column / (columns - 1.0) - 0.5) : 0.0;
      const double up = rows > 1 ? height * (row / (rows - 1.0) - 0.5) : 0.0;
      const Eigen::Vector3d ahead = is_wide ? Eigen::Vector3d(std::cos(6.3 * column / columns),
                                                              std::sin(6.3 * column / columns), up)
                                            : Eigen::Vector3d(1.0, right, up);
      Eigen::Vector3f end = scan.origin + (turn * ahead * ranges.at(column, row)).cast<float>();
      if (random.chance(hole_share)) end.setConstant(std::numeric_limits<float>::quiet_NaN());
      (random.chance(no_return_share) ? scan.no_returns : scan.points).push_back(end);
    }
  }
  return scan;
}

}  // namespace cuboid_mapping::test
