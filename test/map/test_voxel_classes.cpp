// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/voxel_classes.h"

#include "support/modelled_map.h"
#include "support/random_shapes.h"

#include <gtest/gtest.h>

#include <map>

namespace cuboid_mapping {
namespace {

using test::Random;

TEST(VoxelClasses, areUnknownAtFirst) {
  const VoxelClasses classes;
  EXPECT_EQ(classes.at({0, 0, 0}), Occupancy::kUnknown);
  EXPECT_FALSE(classes.isAnyOccupied({{-20, -20, -20}, {20, 20, 20}}));
}

TEST(VoxelClasses, areThoseThatWereSetLast) {
  Random random(31);
  VoxelClasses classes;
  std::map<Cell, std::pair<BrickMask, BrickMask>> expected;
  const auto random_mask = [&random] {
    BrickMask mask{};
    if (random.chance(0.2)) mask.fill(~0ULL);
    if (random.chance(0.6)) test::markBox(mask, test::randomBoxInside(random, brickBox({0, 0, 0})));
    return mask;
  };
  for (int i = 0; i < 20000; ++i) {
    const Cell at = test::randomCell(random, {{-10, -10, -10}, {10, 10, 10}});
    const Cell brick{kBrickEdge * at.x, kBrickEdge * at.y, kBrickEdge * at.z};
    const BrickMask known = random_mask();
    BrickMask occupied = random_mask();
    for (std::size_t z = 0; z < kBrickEdge; ++z) occupied[z] &= known[z];
    classes.set(brick, known, occupied);
    expected[brick] = {known, occupied};
  }
  ASSERT_GT(expected.size(), 7000U);
  for (const auto& [brick, masks] : expected) {
    VoxelClasses::Masks found{};
    ASSERT_TRUE(classes.find(brick, found));
    ASSERT_EQ(*found.known, masks.first);
    ASSERT_EQ(*found.occupied, masks.second);
  }
  const std::size_t bytes = classes.numBytes();
  EXPECT_GT(bytes, expected.size() * 20);
  classes.clear();
  EXPECT_LT(classes.numBytes(), bytes / 10);
  EXPECT_EQ(classes.at(expected.begin()->first), Occupancy::kUnknown);
}

TEST(VoxelClasses, areThoseOfTheMap) {
  Random random(32);
  test::ModelledMap model(MapConfig{});
  const CellBox area{{-20, -20, -20}, {20, 20, 20}};
  std::size_t num_occupied_boxes = 0;
  for (int i = 0; i < 60; ++i) {
    const ScanUpdate update = test::randomUpdate(random, {{-2, -2, -2}, {2, 2, 2}}, 6);
    model.voxels.apply(update);
    model.map.apply(update);
    if (i % 10 != 9) continue;
    test::visitCells(area, [&](const Cell& cell) {
      const auto log_odds = model.voxels.find(cell);
      ASSERT_EQ(model.map.classes().at(cell), log_odds ? classify(*log_odds) : Occupancy::kUnknown);
    });
    for (int box = 0; box < 200; ++box) {
      const CellBox asked = test::randomBox(random, area, random.integer(1, 30));
      bool is_any_occupied = false;
      test::visitCells(asked, [&](const Cell& cell) {
        is_any_occupied = is_any_occupied || model.voxels.find(cell).value_or(-1.0F) >= 0.0F;
      });
      ASSERT_EQ(model.map.classes().isAnyOccupied(asked), is_any_occupied) << asked;
      num_occupied_boxes += is_any_occupied ? 1 : 0;
    }
  }
  EXPECT_GT(num_occupied_boxes, 100U);
  EXPECT_LT(num_occupied_boxes, 1100U);
  model.map.clear();
  EXPECT_EQ(model.map.classes().at({0, 0, 0}), Occupancy::kUnknown);
}

}  // namespace
}  // namespace cuboid_mapping
