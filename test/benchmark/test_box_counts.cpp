// SPDX-License-Identifier: BSD-3-Clause
#include "ablations/box_counts.h"

#include "support/random.h"

#include "cuboid_mapping/map/cuboid_map.h"

#include <gtest/gtest.h>

namespace cuboid_mapping::bench::test {
namespace {

/// A map in which these boxes are free.
CuboidMap makeMap(const std::vector<CellBox>& boxes) {
  CuboidMap map{MapConfig()};
  for (const CellBox& box : boxes) map.replace(box, {UniformBox{box, -1.0F}});
  return map;
}

TEST(BoxCounts, OneBoxNeedsOne) {
  const CuboidMap map = makeMap({{{1, 2, 3}, {5, 6, 8}}});
  const BoxCounts counts = countBoxes(map.voxels(), 100);
  EXPECT_EQ(counts.bricks, 1U);
  EXPECT_EQ(counts.cuboids, 1U);
  EXPECT_EQ(counts.best_of_orders, 1U);
  EXPECT_EQ(counts.lower_bound, 1U);
}

TEST(BoxCounts, ACrossNeedsThree) {
  const CuboidMap map = makeMap({{{0, 3, 0}, {7, 4, 1}}, {{3, 0, 0}, {4, 7, 1}}});
  const BoxCounts counts = countBoxes(map.voxels(), 100);
  EXPECT_EQ(counts.best_of_orders, 3U);
  EXPECT_GE(counts.lower_bound, 2U);
  EXPECT_LE(counts.lower_bound, 3U);
}

TEST(BoxCounts, BoundsHoldOnRandomBricks) {
  cuboid_mapping::test::Random random;
  std::vector<CellBox> boxes;
  for (int i = 0; i < 200; ++i) {
    const Cell min{random.integer(0, 60), random.integer(0, 60), random.integer(0, 60)};
    boxes.push_back(
        {min, min + Cell{random.integer(1, 6), random.integer(1, 6), random.integer(1, 6)}});
  }
  const CuboidMap map = makeMap(boxes);
  const BoxCounts counts = countBoxes(map.voxels(), 1000000);
  EXPECT_EQ(counts.bricks, map.voxels().size());
  EXPECT_LE(counts.lower_bound, counts.best_of_orders);
  EXPECT_LT(counts.best_of_orders, counts.cuboids);
  EXPECT_LT(counts.bricks / 2, counts.lower_bound);
}

TEST(BoxCounts, JoinsWhatFormsABox) {
  const auto free = [](const Cell& min, const Cell& max) {
    return Cuboid{{min, max}, Occupancy::kFree};
  };
  const std::vector<Cuboid> quarters{free({0, 0, 0}, {8, 8, 8}), free({8, 0, 0}, {16, 8, 8}),
                                     free({0, 8, 0}, {8, 16, 8}), free({8, 8, 0}, {16, 16, 8})};
  EXPECT_EQ(countJoined(quarters), 1U);
  std::vector<Cuboid> with_gap = quarters;
  with_gap.push_back(free({17, 0, 0}, {20, 8, 8}));
  with_gap.push_back({{{16, 0, 0}, {17, 16, 8}}, Occupancy::kOccupied});
  EXPECT_EQ(countJoined(with_gap), 3U);
}

}  // namespace
}  // namespace cuboid_mapping::bench::test
