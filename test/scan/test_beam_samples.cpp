// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/beam_samples.h"

#include "cuboid_mapping/scan/scan_update.h"
#include "support/random.h"
#include "support/random_shapes.h"
#include "support/voxel_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace cuboid_mapping {
namespace {

constexpr double kAnyLength = std::numeric_limits<double>::infinity();

Scan scanOf(const std::vector<Eigen::Vector3f>& points) {
  Scan scan;
  scan.origin = {0.05F, 0.05F, 0.05F};
  scan.points = points;
  return scan;
}

TEST(SampleBeams, drawsNoneUnlessAsked) {
  const Scan scan = scanOf({{10.0F, 0.0F, 0.0F}});
  EXPECT_TRUE(sampleBeams(Grid(0.1), scan, kAnyLength, {0.0, 1}, 0).empty());
}

TEST(SampleBeams, drawsTheSameForTheSameSeedAndScan) {
  const Scan scan = scanOf({{10.0F, 3.0F, 0.0F}, {-5.0F, 3.0F, 1.0F}});
  const auto cells = sampleBeams(Grid(0.1), scan, kAnyLength, {2.0, 7}, 3);
  EXPECT_EQ(sampleBeams(Grid(0.1), scan, kAnyLength, {2.0, 7}, 3), cells);
  EXPECT_NE(sampleBeams(Grid(0.1), scan, kAnyLength, {2.0, 8}, 3), cells);
  EXPECT_NE(sampleBeams(Grid(0.1), scan, kAnyLength, {2.0, 7}, 4), cells);
  EXPECT_TRUE(std::is_sorted(cells.begin(), cells.end()));
}

TEST(SampleBeams, drawsInProportionToTheLength) {
  std::size_t num_short = 0;
  std::size_t num_long = 0;
  const Grid grid(0.01);  // Fine: cells are seldom drawn twice.
  for (std::uint64_t i = 0; i < 2000; ++i) {
    num_short += sampleBeams(grid, scanOf({{2.05F, 0.05F, 0.05F}}), kAnyLength, {0.5, 1}, i).size();
    num_long += sampleBeams(grid, scanOf({{0.05F, 8.05F, 0.05F}}), kAnyLength, {0.5, 1}, i).size();
  }
  EXPECT_NEAR(static_cast<double>(num_short), 2000.0, 150.0);
  EXPECT_NEAR(static_cast<double>(num_long), 8000.0, 300.0);
}

TEST(SampleBeams, staysWithinTheMaxRange) {
  const auto cells = sampleBeams(Grid(0.1), scanOf({{50.0F, 0.05F, 0.05F}}), 10.0, {20.0, 1}, 0);
  ASSERT_GT(cells.size(), 50U);
  for (const Cell& cell : cells) EXPECT_LE(cell.x, 101);
}

TEST(SampleBeams, leavesOutBeamsThatAreNotObserved) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Scan scan = scanOf({{nan, 0.0F, 0.0F}, {0.0F, 3e38F, 0.0F}, {0.05F, 0.05F, 0.05F}});
  EXPECT_TRUE(sampleBeams(Grid(0.1), scan, kAnyLength, {5.0, 1}, 0).empty());
}

TEST(SampleBeams, findsCellsThatTheScanObserves) {
  test::Random random(21);
  const Grid grid(0.1);
  ScanUpdater updater(grid, kAnyLength, 1, {3.0, 5});
  test::ScanShape shape;
  std::size_t num_samples = 0;
  std::size_t num_observed = 0;
  for (int i = 0; i < 50; ++i) {
    const ScanUpdate& update = updater.compute(test::randomScan(random, shape));
    const test::ObservedCells observed = test::toObservedCells(update);
    for (const Cell& cell : update.samples) num_observed += observed.count(cell);
    num_samples += update.samples.size();
  }
  ASSERT_GT(num_samples, 1000U);
  // At the borders of voxels the walk may round differently.
  EXPECT_GT(static_cast<double>(num_observed), 0.99 * static_cast<double>(num_samples));
}

}  // namespace
}  // namespace cuboid_mapping
