// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/voxels/uniform_boxes.h"

#include "support/modelled_brick.h"

#include <gtest/gtest.h>

#include <map>
#include <vector>

namespace cuboid_mapping {
namespace {

using Bricks = std::map<Cell, test::ModelledBrick>;

/// Paints boxes voxel by voxel. @return Whether no two boxes share a cell.
bool paintAll(const std::vector<UniformBox>& boxes, Bricks& bricks) {
  bool is_disjoint = true;
  for (const auto& [box, log_odds] : boxes) {
    for (Cell cell = box.min; cell.z < box.max.z; ++cell.z) {
      for (cell.y = box.min.y; cell.y < box.max.y; ++cell.y) {
        for (cell.x = box.min.x; cell.x < box.max.x; ++cell.x) {
          auto& voxel = bricks[brickOf(cell)][static_cast<std::size_t>(voxelIndex(cell))];
          is_disjoint = is_disjoint && !voxel;
          voxel = log_odds;
        }
      }
    }
  }
  return is_disjoint;
}

/// Expects each brick once, along the Morton curve, with these voxels.
void expectBricks(const std::vector<VoxelBrick>& found, const Bricks& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (i > 0) {
      EXPECT_TRUE(isBeforeOnMortonCurve(found[i - 1].brick, found[i].brick));
    }
    const auto brick = expected.find(found[i].brick);
    ASSERT_NE(brick, expected.end()) << found[i].brick;
    EXPECT_EQ(found[i].voxels, test::toPacked(brick->second)) << found[i].brick;
  }
}

TEST(ToBricks, givesNothingForNoBoxes) {
  EXPECT_TRUE(toBricks({}).bricks.empty());
  EXPECT_FALSE(toBricks({}).overlapping);
}

TEST(ToBricks, leavesOutEmptyBoxes) {
  const BricksOfBoxes result =
      toBricks({{{{3, 3, 3}, {3, 3, 3}}, 1.0F}, {{{3, 3, 3}, {9, 3, 9}}, 1.0F}, {{}, 1.0F}});
  EXPECT_TRUE(result.bricks.empty());
  EXPECT_FALSE(result.overlapping);
}

TEST(ToBricks, dividesALargeBoxIntoUniformBricks) {
  const BricksOfBoxes result = toBricks({{{{-16, -16, -16}, {16, 16, 16}}, -1.5F}});
  ASSERT_EQ(result.bricks.size(), 64U);
  for (const VoxelBrick& brick : result.bricks) {
    EXPECT_EQ(brick.voxels, PackedVoxels(BrickMask::all(), -1.5F));
  }
}

TEST(ToBricks, tellsABoxThatSharesACellWithOneBeforeIt) {
  const UniformBox first{{{0, 0, 0}, {8, 8, 8}}, 1.0F};
  for (const CellBox& box : {CellBox{{7, 7, 7}, {9, 9, 9}}, first.box,
                             CellBox{{-3, -3, -3}, {9, 9, 9}}, CellBox{{2, 2, 2}, {3, 3, 3}}}) {
    const BricksOfBoxes result = toBricks({first, {box, -1.0F}});
    ASSERT_TRUE(result.overlapping.has_value()) << box;
    EXPECT_EQ(*result.overlapping, box);
    Bricks expected;
    EXPECT_FALSE(paintAll({first, {box, -1.0F}}, expected));
    expectBricks(result.bricks, expected);
  }
  EXPECT_FALSE(toBricks({first, {{{8, 0, 0}, {9, 8, 8}}, 1.0F}}).overlapping) << "a common face";
}

TEST(ToBricks, takesThePartsOfRandomBoxesThatAreInEachBrick) {
  test::Random random(1);
  constexpr std::size_t kCases = 2000;
  std::size_t num_disjoint = 0;
  for (std::size_t i = 0; i < kCases; ++i) {
    std::vector<UniformBox> boxes;
    const int count = random.integer(1, 8);
    for (int b = 0; b < count; ++b) {
      const CellBox area{{-20, -12, 4}, {12, 20, 36}};
      boxes.push_back({test::randomBox(random, area, random.chance(0.2) ? 30 : 9),
                       0.5F * static_cast<float>(random.integer(-4, 4))});
    }
    Bricks expected;
    const bool is_disjoint = paintAll(boxes, expected);
    const BricksOfBoxes result = toBricks(boxes);
    expectBricks(result.bricks, expected);
    EXPECT_EQ(result.overlapping.has_value(), !is_disjoint);
    ASSERT_FALSE(HasFailure()) << test::seedNote(i);
    num_disjoint += is_disjoint ? 1 : 0;
  }
  EXPECT_GT(num_disjoint, kCases / 20);
  EXPECT_LT(num_disjoint, kCases - kCases / 20);
}

TEST(SortBricks, givesEqualMapsEqualOrders) {
  test::Random random(2);
  std::vector<VoxelBrick> bricks;
  for (int i = 0; i < 200; ++i) {
    bricks.push_back({test::randomBrick(random, 1 << 20), {BrickMask::all(), 1.0F}});
  }
  sortBricks(bricks);
  std::vector<VoxelBrick> shuffled = bricks;
  random.shuffle(shuffled);
  sortBricks(shuffled);
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    ASSERT_EQ(bricks[i].brick, shuffled[i].brick);
    ASSERT_FALSE(i > 0 && isBeforeOnMortonCurve(bricks[i].brick, bricks[i - 1].brick));
  }
}

}  // namespace
}  // namespace cuboid_mapping
