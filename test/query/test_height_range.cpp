// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/height_range.h"

#include <gtest/gtest.h>

#include <vector>

namespace cuboid_mapping {
namespace {

/// A map with voxels of 1 m.
CuboidMap makeHeightMap(const std::vector<UniformBox>& boxes) {
  MapConfig config;
  config.resolution_m = 1.0;
  CuboidMap map(config);
  map.replace(kAllCells, boxes);
  return map;
}

TEST(HeightRange, OfAMapWithoutOccupiedVoxelsIsOneMetre) {
  const HeightRange of_nothing = findHeightRange(makeHeightMap({}));
  EXPECT_DOUBLE_EQ(0.0, of_nothing.min_m);
  EXPECT_DOUBLE_EQ(1.0, of_nothing.max_m);
  const HeightRange of_free = findHeightRange(makeHeightMap({{{{0, 0, 5}, {8, 8, 9}}, -1.0F}}));
  EXPECT_DOUBLE_EQ(1.0, of_free.max_m);
}

TEST(HeightRange, LeavesOutTheLowestAndTheHighestVoxels) {
  // A wall 100 voxels high, with a point far below and one far above.
  const HeightRange range = findHeightRange(makeHeightMap({{{{0, 0, 0}, {1, 10, 100}}, 1.0F},
                                                           {{{0, 0, -500}, {1, 1, -499}}, 1.0F},
                                                           {{{0, 0, 700}, {1, 1, 701}}, 1.0F}}));
  EXPECT_NEAR(2.0, range.min_m, 0.2);
  EXPECT_NEAR(98.0, range.max_m, 0.2);
}

TEST(HeightRange, OfALargeMapIsThatOfAPartOfItsBricks) {
  // A slope: 320 x 320 bricks with one voxel each, from 0 to 319 m.
  std::vector<UniformBox> voxels;
  for (std::int32_t y = 0; y < 320; ++y) {
    for (std::int32_t x = 0; x < 320; ++x) {
      const Cell cell{8 * x, 8 * y, x};
      voxels.push_back({{cell, cell + Cell{1, 1, 1}}, 1.0F});
    }
  }
  const HeightRange range = findHeightRange(makeHeightMap(voxels));
  EXPECT_NEAR(0.02 * 320.0, range.min_m, 1.0);
  EXPECT_NEAR(0.98 * 320.0, range.max_m, 1.0);
}

TEST(HeightRange, FindsTheOnlyOccupiedVoxelOfALargeMap) {
  const HeightRange range = findHeightRange(makeHeightMap(
      {{{{0, 0, 0}, {8 * 400, 8 * 400, 1}}, -1.0F}, {{{5, 5, 40}, {6, 6, 41}}, 1.0F}}));
  EXPECT_NEAR(40.0, range.min_m, 0.1);
  EXPECT_NEAR(41.0, range.max_m, 0.5);
}

}  // namespace
}  // namespace cuboid_mapping
