// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/column_walk.h"

#include "cuboid_mapping/scan/scan_update.h"
#include "support/odd_clouds.h"
#include "support/same_updates.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping {
namespace {

constexpr double kUncut = std::numeric_limits<double>::infinity();

/// Random clouds of the test; the environment variable CUBOID_MAPPING_CLOUDS asks for more.
std::size_t numClouds() {
  const char* text = std::getenv("CUBOID_MAPPING_CLOUDS");
  return text != nullptr ? std::strtoull(text, nullptr, 10) : 600;
}

/// @return Slabs that were taken by columns.
std::size_t checkScans(const std::vector<Scan>& scans, double resolution_m,
                       const BeamRanges& ranges, int threads) {
  const Grid grid(resolution_m);
  ScanUpdater columns(grid, ranges, threads);
  columns.setColumnUse(ColumnUse::kAlways);
  ScanUpdater walk(grid, ranges);
  walk.setColumnUse(ColumnUse::kNever);
  EXPECT_EQ(test::findDifference(columns.compute(scans.data(), scans.size()),
                                 walk.compute(scans.data(), scans.size())),
            "");
  return columns.numColumnSlabs();
}

/// An image of a floor and a wall, with a box that throws a shadow.
Scan roomCloud(const Eigen::Vector3f& origin, float yaw, int columns, int rows) {
  Scan scan;
  scan.origin = origin;
  const Eigen::AngleAxisf turn(yaw, Eigen::Vector3f::UnitZ());
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const float right = 1.1F * (static_cast<float>(column) / static_cast<float>(columns) - 0.5F);
      const float up = 0.8F * (static_cast<float>(row) / static_cast<float>(rows) - 0.5F);
      float range = 3.7F;
      if (up < 0.0F) range = std::min(range, -1.0F / up);
      if (std::abs(right - 0.1F) < 0.15F && up < 0.1F) range = std::min(range, 1.3F);
      scan.points.push_back(origin + turn * Eigen::Vector3f(1.0F, right, up) * range);
    }
  }
  return scan;
}

TEST(ColumnWalk, givesTheUpdateOfTheWalkForOddClouds) {
  test::Random random(66);
  std::size_t num_slabs = 0;
  std::size_t num_cases = 0;
  for (; num_cases < numClouds(); ++num_cases) {
    SCOPED_TRACE(test::seedNote(num_cases));
    constexpr double kResolutions[] = {0.02, 0.05, 0.1, 0.3, 1.0};
    const double resolution_m = kResolutions[random.index(5)];
    const double max_range_m = random.chance(0.3) ? random.real(0.05, 6.0) : kUncut;
    std::vector<Scan> scans{test::oddCloud(random, resolution_m)};
    if (random.chance(0.1)) {
      scans.push_back(test::oddCloud(random, resolution_m));
      scans.back().anchor_map = scans.front().anchor_map;
    }
    const BeamRanges ranges{max_range_m, 0.0, random.chance(0.5)};
    num_slabs += checkScans(scans, resolution_m, ranges, random.integer(1, 8));
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(num_slabs, num_cases);
}

TEST(ColumnWalk, givesTheUpdateOfTheWalkForImagesOfARoom) {
  std::size_t num_slabs = 0;
  for (const double resolution_m : {0.02, 0.05, 0.1}) {
    for (const float yaw : {0.0F, 0.3F, 0.785398F, 2.0F}) {
      // On voxel borders, a little off them, and anywhere.
      for (const Eigen::Vector3f& origin :
           {Eigen::Vector3f(0.0F, 0.0F, 1.0F), Eigen::Vector3f(0.1F, 1e-7F, 1.000001F),
            Eigen::Vector3f(0.123F, -0.456F, 0.3F), Eigen::Vector3f(0.3F, -0.456F, 1.0789F),
            Eigen::Vector3f(0.3F, -0.6F, 1.2F), Eigen::Vector3f(0.123F, -0.456F, 1.0789F)}) {
        for (const bool keep_surfaces : {false, true}) {
          num_slabs += checkScans({roomCloud(origin, yaw, 240, 180)}, resolution_m,
                                  {yaw > 0.5F ? 2.5 : kUncut, 0.0, keep_surfaces}, 2);
        }
        if (testing::Test::HasFailure()) return;
      }
    }
  }
  EXPECT_GT(num_slabs, 1000U);
}

TEST(ColumnWalk, takesNoCloudOfFewBeamsOrWithAnEndMarginAndEveryDenseImage) {
  const Grid grid(0.05);
  const Eigen::Vector3f origin(0.123F, -0.456F, 1.0789F);
  ScanUpdater updater(grid);
  (void)updater.compute(roomCloud(origin, 0.3F, 640, 480));
  EXPECT_GT(updater.numColumnSlabs(), 0U);
  (void)updater.compute(roomCloud(origin, 0.3F, 32, 24));
  EXPECT_EQ(updater.numColumnSlabs(), 0U);
  for (const Eigen::Vector3f& on_border :
       {Eigen::Vector3f(0.123F, -0.456F, 0.3F), Eigen::Vector3f(0.3F, -0.456F, 1.0789F),
        Eigen::Vector3f(0.3F, -0.6F, 1.2F)}) {
    (void)updater.compute(roomCloud(on_border, 0.3F, 640, 480));
    EXPECT_GT(updater.numColumnSlabs(), 0U);
  }
  ScanUpdater keeping_surfaces(grid, BeamRanges{kUncut, 0.0, true});
  (void)keeping_surfaces.compute(roomCloud(origin, 0.3F, 640, 480));
  EXPECT_GT(keeping_surfaces.numColumnSlabs(), 0U);
  ScanUpdater with_margin(grid, BeamRanges{kUncut, 0.1});
  (void)with_margin.compute(roomCloud(origin, 0.3F, 640, 480));
  EXPECT_EQ(with_margin.numColumnSlabs(), 0U);
}

}  // namespace
}  // namespace cuboid_mapping
