// SPDX-License-Identifier: BSD-3-Clause
// The fusion of the paper on hand-made scenes, and its properties on random grids.
#include "cuboid_mapping/fusion/growth_fusion.h"

#include "support/random_growth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::boxAt;
using test::boxesOf;
using test::cellsIn;
using test::GrowthScene;
using test::Random;
using testing::Contains;
using testing::Not;

// Figure 4(b), left: a cube expands along x first, then along y.
TEST(GrowthFusionScene, aCubeExpandsAlongXFirst) {
  GrowthScene scene;
  scene.set(boxAt({0, 0, 0}, {1, 2, 1}), scene.stableFree());  // The cell and its neighbour in y.
  scene.set(boxAt({1, 0, 0}, {1, 1, 1}), scene.stableFree());  // Its neighbour in x.
  const auto boxes = boxesOf(scene.fuse({{0, 0, 0}}));
  EXPECT_THAT(boxes,
              testing::ElementsAre(boxAt({0, 0, 0}, {2, 1, 1}), boxAt({0, 1, 0}, {1, 1, 1})));
}

// Figure 4(b), right: a cuboid expands along its larger side first.
TEST(GrowthFusionScene, aCuboidExpandsAlongItsLargerSideFirst) {
  GrowthScene scene;
  scene.set(boxAt({0, 0, 0}, {1, 2, 1}), scene.stableFree());
  EXPECT_EQ(boxesOf(scene.fuse({{0, 0, 0}})).size(), 1U);
  scene.set(boxAt({0, 2, 0}, {1, 1, 1}), scene.stableFree());
  scene.set(boxAt({1, 0, 0}, {1, 2, 1}), scene.stableFree());
  // Along x first it would become 2 x 2; along y it becomes 1 x 3, which finds no third in x.
  EXPECT_THAT(boxesOf(scene.fuse({{0, 0, 0}})), Contains(boxAt({0, 0, 0}, {1, 3, 1})));
}

// Figure 6: of four cells only g_2 and g_3 are above alpha_max.
TEST(GrowthFusionScene, theCellsOfFigureSixFuse) {
  GrowthScene scene;
  scene.set(boxAt({0, 0, 0}, {1, 1, 1}), scene.unstable());
  scene.set(boxAt({1, 0, 0}, {2, 1, 1}), scene.stableOccupied());
  scene.set(boxAt({3, 0, 0}, {1, 1, 1}), scene.unstable());
  const auto cuboids = scene.fuse({{1, 0, 0}});
  ASSERT_EQ(cuboids.size(), 3U);
  EXPECT_EQ(cuboids[1], (Cuboid{boxAt({1, 0, 0}, {2, 1, 1}), Occupancy::kOccupied}));
}

TEST(GrowthFusionScene, anLShapedWallBecomesTwoCuboids) {
  GrowthScene scene;
  scene.set(boxAt({0, 0, 0}, {10, 1, 4}), scene.stableOccupied());
  scene.set(boxAt({0, 1, 0}, {1, 9, 4}), scene.stableOccupied());
  auto starters = cellsIn(boxAt({0, 0, 0}, {10, 1, 4}));
  const auto more = cellsIn(boxAt({0, 1, 0}, {1, 9, 4}));
  starters.insert(starters.end(), more.begin(), more.end());
  const auto cuboids = scene.fuse(starters);
  EXPECT_THAT(boxesOf(cuboids), testing::UnorderedElementsAre(boxAt({0, 0, 0}, {10, 1, 4}),
                                                              boxAt({0, 1, 0}, {1, 9, 4})));
}

TEST(GrowthFusionScene, aRoomBecomesItsInsideAndItsWalls) {
  GrowthScene scene;
  const CellBox room = boxAt({0, 0, 0}, {12, 10, 6});
  scene.set(room, scene.stableOccupied());
  scene.set(boxAt({1, 1, 1}, {10, 8, 4}), scene.stableFree());
  const auto cuboids = scene.fuse(cellsIn(room));
  EXPECT_THAT(boxesOf(cuboids), Contains(boxAt({1, 1, 1}, {10, 8, 4})));
  EXPECT_EQ(cuboids.size(), 7U);  // The six walls are added.
}

TEST(GrowthFusionScene, aSlabWithOneMissingCellForbidsTheExpansion) {
  for (const bool is_unknown : {true, false}) {
    GrowthScene scene;
    scene.set(boxAt({0, 0, 0}, {1, 3, 3}), scene.stableFree());
    scene.set(boxAt({1, 0, 0}, {1, 3, 1}), scene.stableFree());
    scene.set(boxAt({1, 0, 1}, {1, 2, 2}), scene.stableFree());
    scene.set(boxAt({1, 2, 1}, {1, 1, 1}), scene.stableFree());
    if (!is_unknown) scene.set(boxAt({1, 2, 2}, {1, 1, 1}), scene.unstable());
    const auto boxes = boxesOf(scene.fuse({{0, 0, 0}}));
    // x first: a row of two, then along y and z while there are pairs.
    for (const CellBox& box : boxes)
      EXPECT_FALSE(box.contains(Cell{1, 2, 2}) && box.numVoxels() > 1);
  }
}

TEST(GrowthFusionScene, aNeighbourThatReachesBeyondTheSlabForbidsTheExpansion) {
  GrowthScene scene;
  scene.set(boxAt({1, 0, 0}, {2, 1, 1}), scene.stableFree());
  EXPECT_EQ(scene.fuse({{1, 0, 0}}).size(), 1U);  // A neighbour of two voxels along x.
  scene.set(boxAt({0, 0, 0}, {1, 1, 1}), scene.stableFree());
  EXPECT_EQ(scene.fuse({{0, 0, 0}}).size(), 2U);
  // In the other order the neighbour absorbs the cell.
  EXPECT_THAT(boxesOf(scene.fuse({{1, 0, 0}})), testing::ElementsAre(boxAt({0, 0, 0}, {3, 1, 1})));
}

TEST(GrowthFusionScene, cellsOfTheOtherClassOrNotStableDoNotFuse) {
  for (const bool is_other_class : {true, false}) {
    GrowthScene scene;
    scene.set(boxAt({0, 0, 0}, {1, 1, 1}), scene.stableFree());
    scene.set(boxAt({1, 0, 0}, {1, 1, 1}),
              is_other_class ? scene.stableOccupied() : scene.unstable());
    EXPECT_EQ(scene.fuse({{0, 0, 0}, {1, 0, 0}}).size(), 2U);
  }
}

TEST(GrowthFusionScene, cellsBeyondTheThresholdsFuse) {
  GrowthConfig config;
  for (const double alpha_min : {0.12, 0.2, 0.5}) {  // `unstable()` has a probability of 0.18.
    config.alpha_min = alpha_min;
    GrowthScene scene(config);
    scene.set(boxAt({0, 0, 0}, {1, 1, 1}), scene.stableFree());
    scene.set(boxAt({1, 0, 0}, {1, 1, 1}), scene.unstable());
    scene.set(boxAt({2, 0, 0}, {2, 1, 1}), 0.0F);  // Occupied, far below alpha_max.
    EXPECT_EQ(scene.fuse({{0, 0, 0}, {2, 0, 0}}).size(), alpha_min < 0.15 ? 4U : 3U);
  }
  config.alpha_max = 0.5;
  GrowthScene scene(config);
  scene.set(boxAt({0, 0, 0}, {2, 1, 1}), -1e-6F);
  scene.set(boxAt({2, 0, 0}, {2, 1, 1}), 0.0F);
  EXPECT_THAT(boxesOf(scene.fuse({{0, 0, 0}, {2, 0, 0}})),
              testing::ElementsAre(boxAt({0, 0, 0}, {2, 1, 1}), boxAt({2, 0, 0}, {2, 1, 1})));
}

TEST(GrowthFusionScene, onlyCellsOfTheSetTStart) {
  GrowthScene scene;
  scene.set(boxAt({0, 0, 0}, {4, 1, 1}), scene.stableFree());
  EXPECT_EQ(scene.fuse({}).size(), 4U);
  EXPECT_EQ(scene.fuse({{9, 9, 9}}).size(), 4U);  // Unknown.
  EXPECT_EQ(scene.fuse({{2, 0, 0}}).size(), 1U);
}

TEST(GrowthFusionScene, aContradictedVoxelIsSplitOutAndTheRestStays) {
  GrowthScene scene;
  const CellBox block = boxAt({0, 0, 0}, {9, 9, 9});  // More than one brick.
  scene.set(block, scene.stableFree());
  ASSERT_EQ(scene.fuse({{4, 4, 4}}).size(), 1U);
  scene.set(CellBox::ofCell({4, 4, 4}), scene.unstable());
  const auto cuboids = scene.fuse(cellsIn(block));
  EXPECT_EQ(cuboids.size(), 7U);  // Six pieces around it.
  EXPECT_THAT(cuboids, Contains(Cuboid{CellBox::ofCell({4, 4, 4}), Occupancy::kFree}));
}

TEST(GrowthFusionScene, aFlickeringVoxelWaitsUntilItHasSettled) {
  GrowthConfig config;
  config.settle_clouds = 5;
  GrowthScene scene(config);
  const CellBox row = boxAt({0, 0, 0}, {5, 1, 1});
  scene.set(row, scene.stableFree());
  ASSERT_EQ(scene.fuse(cellsIn(row)).size(), 1U);
  for (int i = 0; i < 6; ++i) {  // It flickers faster than it settles: never part of a cuboid.
    scene.set(CellBox::ofCell({2, 0, 0}), i % 2 == 0 ? scene.unstable() : scene.stableFree());
    EXPECT_EQ(scene.fuse(cellsIn(row)).size(), 3U) << i;
  }
  // It settles: one of the cuboids around it absorbs it without any starter.
  for (int i = 0; i < 4; ++i) EXPECT_EQ(scene.fuse({}).size(), 3U) << i;
  EXPECT_THAT(boxesOf(scene.fuse({})),
              testing::ElementsAre(boxAt({0, 0, 0}, {3, 1, 1}), boxAt({3, 0, 0}, {2, 1, 1})));
}

TEST(GrowthFusionScene, aVoxelThatDoesNotBecomeStableKeepsNoOtherWaiting) {
  GrowthConfig config;
  config.settle_clouds = 2;
  GrowthScene scene(config);
  for (const std::int32_t y : {-3, 0, 3}) {  // In any order.
    scene.set(boxAt({0, y, 0}, {5, 1, 1}), scene.stableFree());
  }
  ASSERT_EQ(scene.fuse({{0, -3, 0}, {0, 0, 0}, {0, 3, 0}}).size(), 3U);
  for (const std::int32_t y : {-3, 0, 3}) {
    scene.set(CellBox::ofCell({2, y, 0}), scene.unstable());
  }
  ASSERT_EQ(scene.fuse({}).size(), 9U);
  // All change at once, so that all are due at once; the last of them becomes stable.
  for (const std::int32_t y : {-3, 0}) {
    scene.set(CellBox::ofCell({2, y, 0}), scene.unstable() + 0.1F);
  }
  scene.set(CellBox::ofCell({2, 3, 0}), scene.stableFree());
  for (int i = 0; i < 4; ++i) scene.write();
  EXPECT_THAT(boxesOf(scene.fuse({})), Contains(boxAt({0, 3, 0}, {3, 1, 1})));
  EXPECT_EQ(scene.fuse({}).size(), 8U);
}

TEST(GrowthFusionScene, aStableVoxelThatChangesStaysInItsCuboid) {
  GrowthScene scene;
  scene.set(boxAt({0, 0, 0}, {4, 4, 1}), scene.stableFree());
  ASSERT_EQ(scene.fuse({{0, 0, 0}}).size(), 1U);
  scene.set(CellBox::ofCell({1, 1, 0}), scene.stableFree() - 1.0F);
  EXPECT_EQ(scene.fuse({}).size(), 1U);
}

TEST(GrowthFusionScene, stableVoxelsOfAnEditAreLargeBoxesAtOnce) {
  GrowthScene scene;
  scene.set(boxAt({0, 0, 0}, {8, 8, 4}), scene.stableFree());
  scene.set(boxAt({0, 0, 4}, {8, 8, 1}), scene.unstable());
  const auto cuboids = scene.edit();
  EXPECT_EQ(cuboids.size(), 1U + 64U);
  EXPECT_THAT(boxesOf(cuboids), Contains(boxAt({0, 0, 0}, {8, 8, 4})));
  scene.forget(boxAt({0, 0, 0}, {8, 8, 1}));
  EXPECT_THAT(boxesOf(scene.edit()), Contains(boxAt({0, 0, 1}, {8, 8, 3})));
  scene.forget(boxAt({0, 0, 0}, {8, 8, 8}));
  EXPECT_TRUE(scene.edit().empty());
}

TEST(GrowthFusionScene, voxelsThatAnotherModelDoesNotCallStableBecomeSingle) {
  GrowthScene scene;
  scene.set(boxAt({0, 0, 0}, {4, 4, 4}), scene.stableFree());
  scene.set(boxAt({4, 0, 0}, {4, 4, 4}), scene.stableOccupied());
  ASSERT_EQ(scene.edit().size(), 2U);
  SensorModelConfig stricter;
  stricter.alpha_min = 0.05;
  const auto cuboids = scene.setSensorModel(stricter);
  EXPECT_EQ(cuboids.size(), 64U + 1U);
  EXPECT_THAT(boxesOf(cuboids), Contains(boxAt({4, 0, 0}, {4, 4, 4})));
  EXPECT_THAT(scene.changes().bricks, testing::Not(testing::IsEmpty()));
}

TEST(GrowthFusionScene, aChangeTellsEveryBrickOfASplitCuboid) {
  GrowthScene scene;
  const CellBox block = boxAt({0, 0, 0}, {24, 8, 8});
  scene.set(block, scene.stableFree());
  ASSERT_EQ(scene.fuse({{0, 0, 0}}).size(), 1U);
  scene.set(CellBox::ofCell({1, 1, 1}), scene.unstable());
  scene.write();
  std::set<Cell> bricks;
  for (const ChangedBrick& brick : scene.changes().bricks) {
    if (brick.has_new_cuboids) bricks.insert(brick.brick);
  }
  EXPECT_EQ(bricks, (std::set<Cell>{{0, 0, 0}, {8, 0, 0}, {16, 0, 0}}));
}

TEST(GrowthFusionProperties, holdOnRandomGrids) {
  test::checkRandomGrowth(10000, [](Random& /*random*/) { return GrowthConfig(); });
}

}  // namespace
}  // namespace cuboid_mapping
