// SPDX-License-Identifier: BSD-3-Clause
// Clouds of single beams and of images, by columns of voxels: they observe what the walk of each beam observes.
#include "cuboid_mapping/scan/scan_update.h"

#include "../test/support/same_updates.h"
#include "fuzz_input.h"
#include "fuzz_target.h"

#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <limits>

namespace {

using namespace cuboid_mapping;

/// Steps of 2 mm, so that many ways lie along faces, edges and diagonals of voxels; sometimes an extreme number.
float takeLength(FuzzInput& input) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr std::array<float, 10> kOdd{
      0.0F, -0.0F, 1e-7F, -1e-7F,    1e-20F,
      1e6F, 1e19F, 1e30F, kInfinity, std::numeric_limits<float>::quiet_NaN()};
  if (input.upTo(31) == 0) return kOdd.at(input.upTo(kOdd.size() - 1));
  return 0.002F * static_cast<float>(input.take<std::int16_t>() % 1024);
}

Eigen::Vector3f takeVector(FuzzInput& input) {
  Eigen::Vector3f vector;
  for (int axis = 0; axis < 3; ++axis) vector[axis] = takeLength(input);
  return vector;
}

void addBeam(FuzzInput& input, Scan& scan) {
  const Eigen::Vector3f way = takeVector(input);
  (input.upTo(3) == 0 ? scan.no_returns : scan.points).emplace_back(scan.origin + way);
}

/// Adds the pixels of an image between two slopes on each axis across, at one distance or two, or along a wall.
void addImage(FuzzInput& input, Scan& scan) {
  constexpr float kSlopeStep = 1.0F / 64;
  const int axis = static_cast<int>(input.upTo(2));
  const float along = input.chance() ? 1.0F : -1.0F;
  const Eigen::AngleAxisf turn(0.01F * static_cast<float>(input.upTo(255)),
                               Eigen::Vector3f(1.0F, 2.0F, 3.0F).normalized());
  const bool is_turned = input.chance();
  const std::size_t columns = 1 + input.upTo(23);
  const std::size_t rows = 1 + input.upTo(23);
  float first[2];
  float step[2];
  for (float& slope : first) slope = kSlopeStep * static_cast<float>(input.take<std::int8_t>());
  for (float& slope : step) slope = 0.1F * kSlopeStep * static_cast<float>(input.upTo(20));
  const float near = takeLength(input);
  const float far = takeLength(input);
  const std::size_t pattern = 1 + input.upTo(6);
  const bool is_return = input.upTo(3) != 0;
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      Eigen::Vector3f way;
      way[axis] = along;
      way[(axis + 1) % 3] = first[0] + static_cast<float>(column) * step[0];
      way[(axis + 2) % 3] = first[1] + static_cast<float>(row) * step[1];
      way *= (column / pattern + row / pattern) % 2 == 0 ? near : far;
      if (is_turned) way = turn * way;
      (is_return ? scan.points : scan.no_returns).emplace_back(scan.origin + way);
    }
  }
}

Scan takeScan(FuzzInput& input, double resolution_m) {
  Scan scan;
  if (input.upTo(7) == 0) scan.anchor_map.setConstant(input.chance() ? 1e6 : -1024.0);
  scan.origin = takeVector(input);
  for (int axis = 0; axis < 3; ++axis) {
    if (input.upTo(7) == 0) {
      const double voxels = std::round(static_cast<double>(scan.origin[axis]) / resolution_m);
      scan.origin[axis] = static_cast<float>(voxels * resolution_m);
    }
  }
  for (int i = 0; i < 4 && !input.isEmpty(); ++i) {
    if (input.chance()) {
      addImage(input, scan);
    } else {
      addBeam(input, scan);
    }
  }
  return scan;
}

}  // namespace

FUZZ_TARGET(fuzz_columns) {
  FuzzInput input(data, size);
  constexpr std::array<double, 4> kResolutions_m{0.02, 0.05, 0.1, 0.5};
  const double resolution_m = kResolutions_m.at(input.upTo(kResolutions_m.size() - 1));
  const double max_range_m = input.upTo(2) == 0
                                 ? 0.02 * (1.0 + static_cast<double>(input.upTo(255)))
                                 : std::numeric_limits<double>::infinity();
  const int threads = input.upTo(7) == 0 ? 3 : 1;
  const bool keep_surfaces = input.chance();
  const Scan scan = takeScan(input, resolution_m);
  // Millions of voxels take long, and tell no more.
  for (const auto* ends : {&scan.points, &scan.no_returns}) {
    for (const Eigen::Vector3f& end : *ends) {
      const float length_m = (end - scan.origin).norm();
      if (length_m > 100.0F && ends->size() > 10) return 0;
    }
  }
  const Grid grid(resolution_m);
  const BeamRanges ranges{max_range_m, 0.0, keep_surfaces};
  ScanUpdater columns(grid, ranges, threads);
  columns.setColumnUse(ColumnUse::kAlways);
  ScanUpdater walk(grid, ranges);
  walk.setColumnUse(ColumnUse::kNever);
  require(test::findDifference(columns.compute(scan), walk.compute(scan)).empty());
  return 0;
}
