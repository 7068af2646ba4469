// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/fusion_strategy.h"

#include "support/random.h"
#include "support/random_bricks.h"
#include "support/voxel_map.h"

#include <gtest/gtest.h>

#include <cmath>

namespace cuboid_mapping {
namespace {

std::vector<Cuboid> divide(const std::string& fusion, const DenseBrick& brick) {
  std::vector<Cuboid> cuboids;
  makeFusion(fusion)->partition(brick, cuboids);
  return cuboids;
}

TEST(ClassFusion, unitesWhateverIsOfOneClass) {
  DenseBrick brick;
  test::visitCells(brickBox({0, 0, 0}), [&](const Cell& cell) {
    test::setVoxel(brick, cell, -0.1F * static_cast<float>(1 + cell.x));
  });
  const auto cuboids = divide("class", brick);
  ASSERT_EQ(cuboids.size(), 1U);
  EXPECT_EQ(cuboids[0].box, brickBox({0, 0, 0}));
  double mean = 0.0;
  for (int x = 0; x < 8; ++x) mean += toProbability(-0.1F * static_cast<float>(1 + x)) / 8.0;
  EXPECT_NEAR(toProbability(cuboids[0].log_odds), mean, 1e-6);
}

TEST(ClassFusion, keepsTheClassOfEveryVoxelOfRandomBricks) {
  test::Random random(31);
  std::size_t num_cuboids = 0;
  std::size_t num_of_brick_fusion = 0;
  for (std::size_t i = 0; i < 2000; ++i) {
    const DenseBrick brick = test::randomDenseBrick(random);
    const auto cuboids = divide("class", brick);
    std::size_t num_voxels = 0;
    BrickMask covered{};
    for (const Cuboid& cuboid : cuboids) {
      test::visitCells(cuboid.box, [&](const Cell& cell) {
        ASSERT_TRUE(test::isInMask(brick.known, cell)) << test::seedNote(i);
        ASSERT_FALSE(test::isInMask(covered, cell)) << test::seedNote(i);
        const float log_odds = brick.log_odds[static_cast<std::size_t>(voxelIndex(cell))];
        ASSERT_EQ(cuboid.occupancy(), classify(log_odds)) << test::seedNote(i);
        test::markBox(covered, CellBox::ofCell(cell));
        ++num_voxels;
      });
    }
    ASSERT_EQ(covered, brick.known) << test::seedNote(i);
    num_cuboids += cuboids.size();
    num_of_brick_fusion += divide("brick", brick).size();
  }
  EXPECT_LT(num_cuboids, num_of_brick_fusion);
}

}  // namespace
}  // namespace cuboid_mapping
