// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/class_boxes.h"

#include "support/modelled_map.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <set>

namespace cuboid_mapping {
namespace {

TEST(ClassBoxes, coverExactlyTheVoxelsOfTheClass) {
  test::Random random(51);
  std::size_t num_boxes = 0;
  for (std::size_t i = 0; i < 60; ++i) {
    MapConfig config;
    config.resolution_m = 0.1;
    const test::ModelledMap model =
        test::randomMap(random, config, {8 * random.integer(-9, 9), 0, 0});
    const CellBox region =
        i % 3 == 0 ? kAllCells : test::randomBoxInside(random, *model.map.tree().bounds());
    for (const Occupancy occupancy : {Occupancy::kFree, Occupancy::kOccupied}) {
      std::set<Cell> covered;
      for (const CellBox& box : findClassBoxes(model.map, region, occupancy)) {
        test::visitCells(box, [&](const Cell& cell) {
          ASSERT_TRUE(region.contains(cell)) << test::seedNote(i);
          ASSERT_TRUE(covered.insert(cell).second) << test::seedNote(i);
          const auto log_odds = model.voxels.find(cell);
          ASSERT_TRUE(log_odds && classify(*log_odds) == occupancy) << test::seedNote(i);
        });
        ++num_boxes;
      }
      std::size_t expected = 0;
      for (const auto& [cell, log_odds] : model.voxels.voxels()) {
        expected += region.contains(cell) && classify(log_odds) == occupancy ? 1 : 0;
      }
      ASSERT_EQ(covered.size(), expected) << test::seedNote(i);
    }
  }
  EXPECT_GT(num_boxes, 1000U);
}

TEST(ClassBoxes, uniteUniformBricks) {
  CuboidMap map;
  const CellBox box{{-64, 0, 0}, {-24, 32, 16}};
  map.replace(box, {{box, map.sensorModel().min()}});
  EXPECT_EQ(findClassBoxes(map, kAllCells, Occupancy::kFree), (std::vector<CellBox>{box}));
  EXPECT_TRUE(findClassBoxes(map, kAllCells, Occupancy::kOccupied).empty());
  EXPECT_TRUE(findClassBoxes(CuboidMap(), kAllCells, Occupancy::kFree).empty());
}

}  // namespace
}  // namespace cuboid_mapping
