// SPDX-License-Identifier: BSD-3-Clause
// The voxels of a map are current after every cloud, even if bricks wait for their division.
#include "cuboid_mapping/query/box_query.h"
#include "support/modelled_map.h"
#include "support/random_shapes.h"

#include <gtest/gtest.h>

namespace cuboid_mapping {
namespace {

using test::Random;

TEST(VoxelsOfCuboidMap, areUnknownAtFirst) {
  const CuboidMap map;
  EXPECT_EQ(map.voxels().at({0, 0, 0}), Occupancy::kUnknown);
  EXPECT_FALSE(isAnyOccupied(map, {{-20, -20, -20}, {20, 20, 20}}));
}

TEST(VoxelsOfCuboidMap, areThoseOfTheReference) {
  Random random(32);
  test::ModelledMap model(MapConfig{});
  const CellBox area{{-20, -20, -20}, {20, 20, 20}};
  std::size_t num_occupied_boxes = 0;
  for (int i = 0; i < 60; ++i) {
    model.apply(test::randomUpdate(random, {{-2, -2, -2}, {2, 2, 2}}, 6));
    if (i % 10 != 9) continue;
    test::visitCells(area, [&](const Cell& cell) {
      ASSERT_EQ(model.map.voxels().at(cell), model.voxels.occupancyAt(cell));
      ASSERT_EQ(model.map.voxels().logOddsAt(cell), model.voxels.find(cell));
    });
    for (int box = 0; box < 200; ++box) {
      const CellBox asked = test::randomBox(random, area, random.integer(1, 30));
      bool is_any_occupied = false;
      test::visitCells(asked, [&](const Cell& cell) {
        is_any_occupied = is_any_occupied || model.voxels.find(cell).value_or(-1.0F) >= 0.0F;
      });
      ASSERT_EQ(isAnyOccupied(model.map, asked), is_any_occupied) << asked;
      num_occupied_boxes += is_any_occupied ? 1 : 0;
    }
  }
  EXPECT_GT(num_occupied_boxes, 100U);
  EXPECT_LT(num_occupied_boxes, 1100U);
  model.map.clear();
  EXPECT_EQ(model.map.voxels().at({0, 0, 0}), Occupancy::kUnknown);
}

}  // namespace
}  // namespace cuboid_mapping
