// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/geometry/brick.h"

#include "support/random_shapes.h"

#include <gtest/gtest.h>

namespace cuboid_mapping {
namespace {

TEST(Brick, isNamedByItsLeastCell) {
  EXPECT_EQ(brickOf({0, 7, 8}), (Cell{0, 0, 8}));
  EXPECT_EQ(brickOf({-1, -8, -9}), (Cell{-8, -8, -16}));
  EXPECT_EQ(brickOf({(1 << 30) - 1, -(1 << 30), 0}), (Cell{(1 << 30) - 8, -(1 << 30), 0}));
}

TEST(Brick, holdsExactlyTheCellsThatAreOfIt) {
  test::Random random(1);
  const CellBox area{{-40, -40, -40}, {40, 40, 40}};
  for (int i = 0; i < 10000; ++i) {
    const Cell cell = test::randomCell(random, area);
    const CellBox box = brickBox(brickOf(cell));
    ASSERT_TRUE(box.contains(cell)) << cell;
    ASSERT_EQ(box.numVoxels(), kBrickVoxels);
    ASSERT_EQ(brickOf(box.min), box.min);
    ASSERT_EQ(brickOf(box.max - Cell{1, 1, 1}), box.min);
    ASSERT_EQ(brickOf(box.max), box.max);
  }
}

TEST(Brick, numbersItsVoxelsByXThenYThenZ) {
  for (const Cell brick : {Cell{0, 0, 0}, Cell{-8, -16, 800}}) {
    int expected = 0;
    for (int z = 0; z < kBrickEdge; ++z) {
      for (int y = 0; y < kBrickEdge; ++y) {
        for (int x = 0; x < kBrickEdge; ++x) {
          ASSERT_EQ(voxelIndex(brick + Cell{x, y, z}), expected++);
        }
      }
    }
    EXPECT_EQ(expected, kBrickVoxels);
  }
}

TEST(SliceMask, hasTheBitsOfTheBoxInEachSlice) {
  int num_cases = 0;
  for (const Cell brick : {Cell{0, 0, 0}, Cell{8, 8, 8}, Cell{-8, -16, -24}}) {
    for (int x = 0; x < 8 * 8; ++x) {
      for (int y = 0; y < 8 * 8; ++y) {
        const Cell min{x / 8, y / 8, 0};
        const Cell max{x % 8 + 1, y % 8 + 1, 1};
        if (min.x >= max.x || min.y >= max.y) continue;
        std::uint64_t expected = 0;
        for (int row = min.y; row < max.y; ++row) {
          for (int column = min.x; column < max.x; ++column) {
            expected |= 1ULL << (8 * row + column);
          }
        }
        ASSERT_EQ(sliceMask({brick + min, brick + max}), expected) << min << max;
        ++num_cases;
      }
    }
  }
  EXPECT_EQ(num_cases, 3 * 36 * 36);
}

}  // namespace
}  // namespace cuboid_mapping
