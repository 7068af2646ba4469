// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/voxels/brick_cuboids.h"

#include "support/cuboid_set.h"
#include "support/modelled_brick.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace cuboid_mapping {
namespace {

/// A brick with boxes of some log-odds.
VoxelBrick brickAt(const Cell& brick, const std::vector<UniformBox>& boxes) {
  VoxelBrick voxels{brick, {}};
  for (const auto& [box, log_odds] : boxes) {
    (void)voxels.voxels.replace(BrickMask::ofBox(box), {BrickMask::all(), log_odds}, voxels.voxels);
  }
  return voxels;
}

std::vector<Cuboid> divide(const VoxelBrick& brick) {
  std::vector<Cuboid> cuboids;
  divideBrick(brick, cuboids);
  return cuboids;
}

std::vector<Cuboid> occupiedBoxes(const std::vector<CellBox>& boxes) {
  std::vector<Cuboid> cuboids;
  for (const CellBox& box : boxes) cuboids.push_back({box, Occupancy::kOccupied});
  return test::sorted(std::move(cuboids));
}

TEST(BrickDivision, makesNothingOfAnUnknownBrick) {
  EXPECT_TRUE(divide(brickAt({0, 0, 0}, {})).empty());
}

TEST(BrickDivision, makesOneCuboidOfABrickOfOneClass) {
  for (const Cell& at : {Cell{0, 0, 0}, Cell{-8, 16, -1024}}) {
    const VoxelBrick brick = brickAt(at, {{brickBox(at), -1.5F}});
    EXPECT_EQ(divide(brick), (std::vector<Cuboid>{{brickBox(at), Occupancy::kFree}}));
  }
}

TEST(BrickDivision, unitesWhateverIsOfOneClass) {
  std::vector<UniformBox> slices;
  for (int x = 0; x < kBrickEdge; ++x) {
    slices.push_back({{{x, 0, 0}, {x + 1, 8, 8}}, -0.1F * static_cast<float>(1 + x)});
  }
  EXPECT_EQ(divide(brickAt({0, 0, 0}, slices)),
            (std::vector<Cuboid>{{brickBox({0, 0, 0}), Occupancy::kFree}}));
}

TEST(BrickDivision, makesACuboidOfASingleVoxel) {
  std::vector<CellBox> corners;
  for (const Cell& cell :
       {Cell{-8, -8, -8}, Cell{-1, -1, -8}, Cell{-8, -1, -1}, Cell{-1, -1, -1}}) {
    corners.push_back(CellBox::ofCell(cell));
  }
  std::vector<UniformBox> voxels;
  for (const CellBox& box : corners) voxels.push_back({box, 0.5F});
  EXPECT_EQ(test::sorted(divide(brickAt({-8, -8, -8}, voxels))), occupiedBoxes(corners));
}

TEST(BrickDivision, dividesAnLIntoItsLongArmAndTheRest) {
  const CellBox long_arm{{0, 0, 0}, {8, 1, 1}};
  const CellBox rest{{0, 1, 0}, {1, 4, 1}};
  EXPECT_EQ(test::sorted(divide(brickAt({0, 0, 0}, {{long_arm, 0.5F}, {rest, 0.5F}}))),
            occupiedBoxes({long_arm, rest}));
}

TEST(BrickDivision, prefersTheLargestBoxWhateverItsDirection) {
  const CellBox tower{{0, 0, 0}, {2, 2, 8}};  // 32 voxels
  const CellBox rest{{2, 0, 0}, {8, 2, 1}};   // with the tower's base 16
  EXPECT_EQ(test::sorted(divide(brickAt({0, 0, 0}, {{tower, 0.5F}, {rest, 0.5F}}))),
            occupiedBoxes({tower, rest}));
}

TEST(BrickDivision, givesTheLowerOfTwoBoxesOfOneSize) {
  const CellBox lower{{0, 0, 0}, {4, 1, 1}};
  const CellBox rest{{0, 0, 1}, {1, 1, 4}};
  EXPECT_EQ(test::sorted(divide(brickAt({0, 0, 0}, {{lower, 0.5F}, {rest, 0.5F}}))),
            occupiedBoxes({lower, rest}));
}

TEST(BrickDivision, keepsTheClassesApartAndNamesOccupiedOnesFirst) {
  const Cuboid lower{{{0, 0, 0}, {8, 8, 3}}, Occupancy::kFree};
  const Cuboid upper{{{0, 0, 3}, {8, 8, 8}}, Occupancy::kOccupied};
  const VoxelBrick brick = brickAt({0, 0, 0}, {{lower.box, -1.0F}, {upper.box, 0.0F}});
  EXPECT_EQ(divide(brick), (std::vector<Cuboid>{upper, lower}));
}

TEST(BrickDivision, keepsTheVoxelsOfACheckerboard) {
  BrickMask black;
  for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
    const Cell cell = cellAt({0, 0, 0}, voxel);
    if ((cell.x + cell.y + cell.z) % 2 == 0) black.set(voxel);
  }
  VoxelBrick brick{{0, 0, 0}, {black, 1.0F}};
  EXPECT_EQ(divide(brick).size(), 256U);
  (void)brick.voxels.replace(~black, {BrickMask::all(), -1.0F}, brick.voxels);
  EXPECT_EQ(divide(brick).size(), 512U);
}

TEST(BrickDivision, appendsToWhatIsThere) {
  const Cuboid there{CellBox::ofCell({99, 99, 99}), Occupancy::kOccupied};
  std::vector<Cuboid> cuboids{there};
  divideBrick(brickAt({0, 0, 0}, {{brickBox({0, 0, 0}), -0.5F}}), cuboids);
  ASSERT_EQ(cuboids.size(), 2U);
  EXPECT_EQ(cuboids.front(), there);
  divideVoxels({8, 0, 0}, BrickMask::all(), Occupancy::kFree, cuboids);
  ASSERT_EQ(cuboids.size(), 3U);
  EXPECT_EQ(cuboids.back(), (Cuboid{brickBox({8, 0, 0}), Occupancy::kFree}));
}

/// Whether cuboids are disjoint and cover exactly the known voxels of a brick, with their classes.
testing::AssertionResult isPartition(const VoxelBrick& brick, const std::vector<Cuboid>& cuboids) {
  BrickMask covered;
  for (const Cuboid& cuboid : cuboids) {
    if (cuboid.box.isEmpty() || !brickBox(brick.brick).contains(cuboid.box)) {
      return testing::AssertionFailure() << cuboid << " is not in the brick";
    }
    const BrickMask mask = BrickMask::ofBox(cuboid.box);
    const BrickMask of_class = cuboid.isOccupied() ? brick.voxels.occupied() : brick.voxels.free();
    if (covered.intersects(mask) || !of_class.contains(mask)) {
      return testing::AssertionFailure() << cuboid << " covers a wrong voxel";
    }
    covered |= mask;
  }
  if (covered != brick.voxels.known()) return testing::AssertionFailure() << "a voxel is lost";
  return testing::AssertionSuccess();
}

/// Volume of the largest box of remaining voxels from its least corner.
int largestVolumeAt(const BrickMask& left, const Cell& corner) {
  int largest = 0;
  for (int z = corner.z; z < kBrickEdge; ++z) {
    int width = kBrickEdge - corner.x;
    for (int y = corner.y; y < kBrickEdge; ++y) {
      for (int slice = corner.z; slice <= z; ++slice) {
        int reach = 0;
        while (reach < width && left.test(voxelIndex({corner.x + reach, y, slice}))) ++reach;
        width = reach;
      }
      largest = std::max(largest, width * (y - corner.y + 1) * (z - corner.z + 1));
    }
  }
  return largest;
}

/// Whether each cuboid is the largest box at its least corner when it is taken.
testing::AssertionResult isGreedy(const VoxelBrick& brick, const std::vector<Cuboid>& cuboids) {
  BrickMask left[2] = {brick.voxels.free(), brick.voxels.occupied()};
  for (const Cuboid& cuboid : cuboids) {
    BrickMask& of_class = left[cuboid.isOccupied() ? 1 : 0];
    const Cell corner = cuboid.box.min - brick.brick;
    int first = kBrickVoxels;
    of_class.forEach([&first](int voxel) { first = std::min(first, voxel); });
    if (voxelIndex(corner) != first) {
      return testing::AssertionFailure() << cuboid << " does not begin at the least voxel";
    }
    const int largest = largestVolumeAt(of_class, corner);
    if (cuboid.box.numVoxels() != largest) {
      return testing::AssertionFailure() << cuboid << " could have " << largest << " voxels";
    }
    of_class &= ~BrickMask::ofBox(cuboid.box);
  }
  return testing::AssertionSuccess();
}

/// Whether no two cuboids of one class form a box: the first of them would have been that box.
testing::AssertionResult hasNoPairToMerge(const std::vector<Cuboid>& cuboids) {
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const CellBox both = unite(cuboids[i].box, cuboids[j].box);
      if (cuboids[i].occupancy == cuboids[j].occupancy &&
          both.numVoxels() == cuboids[i].box.numVoxels() + cuboids[j].box.numVoxels()) {
        return testing::AssertionFailure() << cuboids[i] << " and " << cuboids[j];
      }
    }
  }
  return testing::AssertionSuccess();
}

TEST(BrickDivision, coversExactlyTheKnownVoxelsWithLargestBoxes) {
  test::Random random(1);
  constexpr std::size_t kCases = 12000;
  double num_voxels = 0.0;
  double num_cuboids = 0.0;
  for (std::size_t i = 0; i < kCases; ++i) {
    const VoxelBrick brick{test::randomBrick(random),
                           test::toPacked(test::randomModelledBrick(random))};
    const std::vector<Cuboid> cuboids = divide(brick);
    ASSERT_TRUE(isPartition(brick, cuboids)) << test::seedNote(i);
    ASSERT_TRUE(isGreedy(brick, cuboids)) << test::seedNote(i);
    ASSERT_TRUE(hasNoPairToMerge(cuboids)) << test::seedNote(i);
    for (const Cuboid& cuboid : cuboids) num_voxels += cuboid.box.numVoxels();
    num_cuboids += static_cast<double>(cuboids.size());
  }
  EXPECT_LT(num_cuboids, 0.5 * num_voxels) << "the random bricks have nothing to fuse";
}

TEST(BrickDivision, dependsOnTheClassesOnly) {
  test::Random random(2);
  constexpr std::size_t kCases = 3000;
  for (std::size_t i = 0; i < kCases; ++i) {
    const test::ModelledBrick model = test::randomModelledBrick(random);
    test::ModelledBrick other = model;
    for (auto& voxel : other) {
      if (!voxel) continue;
      const double size = random.real(0.01, 3.0);
      voxel = static_cast<float>(test::classOf(voxel) == Occupancy::kOccupied ? size : -size);
    }
    const Cell brick = test::randomBrick(random);
    ASSERT_EQ(divide({brick, test::toPacked(model)}), divide({brick, test::toPacked(other, -3.0F)}))
        << test::seedNote(i);
  }
}

TEST(BrickDivision, movesWithTheBrick) {
  test::Random random(3);
  constexpr std::size_t kCases = 500;
  for (std::size_t i = 0; i < kCases; ++i) {
    const PackedVoxels voxels = test::toPacked(test::randomModelledBrick(random));
    const Cell brick = test::randomBrick(random, 1 << 26);
    std::vector<Cuboid> expected = divide({{0, 0, 0}, voxels});
    for (Cuboid& cuboid : expected) cuboid.box = {cuboid.box.min + brick, cuboid.box.max + brick};
    ASSERT_EQ(divide({brick, voxels}), expected) << test::seedNote(i);
  }
}

}  // namespace
}  // namespace cuboid_mapping
