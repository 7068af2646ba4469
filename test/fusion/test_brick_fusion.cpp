// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/fusion_strategy.h"

#include "support/cuboid_set.h"
#include "support/random_bricks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::setVoxel;

DenseBrick brickAt(const Cell& brick) {
  DenseBrick dense;
  dense.log_odds.fill(std::numeric_limits<float>::quiet_NaN());
  dense.brick = brick;
  return dense;
}

std::vector<Cuboid> partition(const std::string& name, const DenseBrick& brick) {
  std::vector<Cuboid> cuboids;
  makeFusion(name)->partition(brick, cuboids);
  return cuboids;
}

/// The cuboids of the default fusion, sorted.
std::vector<Cuboid> fuse(const DenseBrick& brick) {
  return test::sorted(partition("brick", brick));
}

TEST(FusionNames, beginWithTheDefault) {
  EXPECT_EQ(fusionNames(), (std::vector<std::string>{"brick", "class", "growth", "none"}));
  for (const std::string& name : fusionNames()) {
    EXPECT_EQ(makeFusion(name) != nullptr, name != kGrowthFusion) << name;
  }
}

TEST(FusionNames, giveNothingForOthers) {
  for (const char* name : {"", "Brick", "brick ", "growth", "nothing"}) {
    EXPECT_EQ(makeFusion(name), nullptr) << name;
  }
}

TEST(BrickFusion, makesNothingOfAnUnknownBrick) {
  EXPECT_TRUE(fuse(brickAt({0, 0, 0})).empty());
  EXPECT_TRUE(partition("none", brickAt({0, 0, 0})).empty());
}

TEST(BrickFusion, makesOneCuboidOfAUniformBrick) {
  for (const Cell& at : {Cell{0, 0, 0}, Cell{-8, 16, -1024}}) {
    DenseBrick brick = brickAt(at);
    brick.fill({brickBox(at), -1.5F});
    EXPECT_EQ(fuse(brick), (std::vector<Cuboid>{{brickBox(at), -1.5F}}));
  }
}

TEST(BrickFusion, makesACuboidOfASingleVoxel) {
  DenseBrick brick = brickAt({-8, -8, -8});
  const std::vector<Cuboid> expected{{CellBox::ofCell({-8, -8, -8}), 0.5F},
                                     {CellBox::ofCell({-1, -1, -8}), 0.5F},
                                     {CellBox::ofCell({-8, -1, -1}), 0.5F},
                                     {CellBox::ofCell({-1, -1, -1}), 0.5F}};
  for (const Cuboid& cuboid : expected) brick.fill(cuboid);
  EXPECT_EQ(fuse(brick), test::sorted(expected));
}

TEST(BrickFusion, dividesAnLIntoItsLongArmAndTheRest) {
  DenseBrick brick = brickAt({0, 0, 0});
  const Cuboid long_arm{{{0, 0, 0}, {8, 1, 1}}, 0.5F};
  const Cuboid rest{{{0, 1, 0}, {1, 4, 1}}, 0.5F};
  brick.fill(long_arm);
  brick.fill(rest);
  EXPECT_EQ(fuse(brick), test::sorted({long_arm, rest}));
}

TEST(BrickFusion, prefersTheLargestBoxWhateverItsDirection) {
  DenseBrick brick = brickAt({0, 0, 0});
  const Cuboid tower{{{0, 0, 0}, {2, 2, 8}}, 0.5F};  // 32 voxels
  const Cuboid rest{{{2, 0, 0}, {8, 2, 1}}, 0.5F};   // with the tower's base 16
  brick.fill(tower);
  brick.fill(rest);
  EXPECT_EQ(fuse(brick), test::sorted({tower, rest}));
}

TEST(BrickFusion, keepsTwoValuesApart) {
  DenseBrick brick = brickAt({0, 0, 0});
  const Cuboid lower{{{0, 0, 0}, {8, 8, 3}}, -1.0F};
  const Cuboid upper{{{0, 0, 3}, {8, 8, 8}}, 1.0F};
  brick.fill(lower);
  brick.fill(upper);
  EXPECT_EQ(fuse(brick), test::sorted({lower, upper}));
}

TEST(BrickFusion, keepsTheVoxelsOfACheckerboard) {
  DenseBrick known = brickAt({0, 0, 0});
  DenseBrick two_values = brickAt({0, 0, 0});
  test::visitCells(brickBox({0, 0, 0}), [&](const Cell& cell) {
    const bool is_black = (cell.x + cell.y + cell.z) % 2 == 0;
    if (is_black) setVoxel(known, cell, 1.0F);
    setVoxel(two_values, cell, is_black ? 1.0F : -1.0F);
  });
  EXPECT_EQ(fuse(known).size(), 256U);
  EXPECT_EQ(fuse(two_values).size(), 512U);
}

TEST(BrickFusion, appendsToWhatIsThere) {
  DenseBrick brick = brickAt({0, 0, 0});
  brick.fill({brickBox({0, 0, 0}), 0.5F});
  const Cuboid there{CellBox::ofCell({99, 99, 99}), 3.0F};
  for (const char* name : {"brick", "class", "none"}) {
    std::vector<Cuboid> cuboids{there};
    makeFusion(name)->partition(brick, cuboids);
    EXPECT_EQ(cuboids.front(), there) << name;
    EXPECT_EQ(cuboids.size(), std::string(name) == "none" ? 513U : 2U) << name;
  }
}

/// Disjoint, in the brick, exactly its known voxels, with their values.
testing::AssertionResult isPartition(const DenseBrick& brick, const std::vector<Cuboid>& cuboids) {
  BrickMask covered{};
  for (const Cuboid& cuboid : cuboids) {
    if (cuboid.box.isEmpty() || !brickBox(brick.brick).contains(cuboid.box)) {
      return testing::AssertionFailure() << cuboid << " is not in the brick";
    }
    bool is_right = true;
    test::visitCells(cuboid.box, [&](const Cell& cell) {
      const auto voxel = static_cast<std::size_t>(voxelIndex(cell));
      is_right = is_right && !test::isInMask(covered, cell) && test::isInMask(brick.known, cell) &&
                 brick.log_odds[voxel] == cuboid.log_odds;
      covered[voxel / 64] |= 1ULL << voxel % 64;
    });
    if (!is_right) return testing::AssertionFailure() << cuboid << " covers a wrong voxel";
  }
  if (covered != brick.known) return testing::AssertionFailure() << "a voxel is lost";
  return testing::AssertionSuccess();
}

/// Volume of the largest box of voxels of one value, none of them taken, from its least corner on.
int largestVolumeAt(const DenseBrick& brick, const BrickMask& left, const Cell& corner) {
  const auto value_at = [&](const Cell& cell) {
    return brick.log_odds[static_cast<std::size_t>(voxelIndex(cell))];
  };
  const Cell end = brick.brick + Cell{kBrickEdge, kBrickEdge, kBrickEdge};
  int largest = 0;
  for (int z = corner.z; z < end.z; ++z) {
    int width = end.x - corner.x;
    for (int y = corner.y; y < end.y; ++y) {
      for (int slice = corner.z; slice <= z; ++slice) {
        int reach = 0;
        for (Cell cell{corner.x, y, slice};
             reach < width && test::isInMask(left, cell) && value_at(cell) == value_at(corner);
             ++cell.x) {
          ++reach;
        }
        width = reach;
      }
      largest = std::max(largest, width * (y - corner.y + 1) * (z - corner.z + 1));
    }
  }
  return largest;
}

/// Each cuboid is the largest box that could begin where it begins when its turn comes.
testing::AssertionResult isGreedy(const DenseBrick& brick, const std::vector<Cuboid>& cuboids) {
  BrickMask left = brick.known;
  for (const Cuboid& cuboid : test::sorted(cuboids)) {
    const int largest = largestVolumeAt(brick, left, cuboid.box.min);
    if (cuboid.box.numVoxels() != largest) {
      return testing::AssertionFailure() << cuboid << " could have " << largest << " voxels";
    }
    test::visitCells(cuboid.box, [&](const Cell& cell) {
      const auto voxel = static_cast<std::size_t>(voxelIndex(cell));
      left[voxel / 64] &= ~(1ULL << voxel % 64);
    });
  }
  return testing::AssertionSuccess();
}

/// Two cuboids of one value never make up a box: the first of them would have been that box.
testing::AssertionResult hasNoPairToMerge(const std::vector<Cuboid>& cuboids) {
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const CellBox both = unite(cuboids[i].box, cuboids[j].box);
      if (cuboids[i].log_odds == cuboids[j].log_odds &&
          both.numVoxels() == cuboids[i].box.numVoxels() + cuboids[j].box.numVoxels()) {
        return testing::AssertionFailure() << cuboids[i] << " and " << cuboids[j];
      }
    }
  }
  return testing::AssertionSuccess();
}

TEST(BrickFusion, coversExactlyTheKnownVoxelsWithLargestBoxes) {
  test::Random random(1);
  constexpr std::size_t kCases = 12000;
  double num_voxels = 0.0;
  double num_cuboids = 0.0;
  for (std::size_t i = 0; i < kCases; ++i) {
    const DenseBrick brick = test::randomDenseBrick(random);
    const std::vector<Cuboid> cuboids = partition("brick", brick);
    ASSERT_TRUE(isPartition(brick, cuboids)) << test::seedNote(i);
    ASSERT_TRUE(isGreedy(brick, cuboids)) << test::seedNote(i);
    ASSERT_TRUE(hasNoPairToMerge(cuboids)) << test::seedNote(i);
    for (const Cuboid& cuboid : cuboids) num_voxels += cuboid.box.numVoxels();
    num_cuboids += static_cast<double>(cuboids.size());
  }
  EXPECT_LT(num_cuboids, 0.5 * num_voxels) << "the random bricks have nothing to fuse";
}

TEST(BrickFusion, dependsOnTheKnownVoxelsOnly) {
  test::Random random(2);
  const auto fusion = makeFusion("brick");
  std::vector<Cuboid> first;
  std::vector<Cuboid> second;
  constexpr std::size_t kCases = 3000;
  for (std::size_t i = 0; i < kCases; ++i) {
    DenseBrick brick = test::randomDenseBrick(random);
    first.clear();
    second.clear();
    fusion->partition(brick, first);
    test::visitCells(brickBox(brick.brick), [&](const Cell& cell) {
      if (test::isInMask(brick.known, cell)) return;
      brick.log_odds[static_cast<std::size_t>(voxelIndex(cell))] =
          random.chance(0.5) ? std::numeric_limits<float>::quiet_NaN() : 0.0F;
    });
    fusion->partition(brick, second);
    ASSERT_EQ(first, second) << test::seedNote(i);
  }
}

TEST(NoFusion, makesACuboidOfEveryKnownVoxel) {
  test::Random random(3);
  constexpr std::size_t kCases = 1000;
  for (std::size_t i = 0; i < kCases; ++i) {
    const DenseBrick brick = test::randomDenseBrick(random);
    const std::vector<Cuboid> cuboids = partition("none", brick);
    ASSERT_TRUE(isPartition(brick, cuboids)) << test::seedNote(i);
    for (const Cuboid& cuboid : cuboids) ASSERT_EQ(cuboid.box.numVoxels(), 1.0);
  }
}

}  // namespace
}  // namespace cuboid_mapping
