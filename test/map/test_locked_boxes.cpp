// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/locked_boxes.h"

#include "support/modelled_map.h"
#include "support/random_shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace cuboid_mapping {
namespace {

using test::Random;

TEST(LockedBoxes, areTheVoxelsThatWereAddedAndNotRemoved) {
  Random random(51);
  const CellBox area{{0, 0, 0}, {12, 12, 12}};
  LockedBoxes locked;
  std::set<Cell> expected;
  for (int i = 0; i < 200; ++i) {
    const CellBox box = test::randomBoxInside(random, area);
    const bool is_added = random.chance(0.5);
    is_added ? locked.add(box) : locked.remove(box);
    test::visitCells(box, [&](const Cell& cell) {
      is_added ? (void)expected.insert(cell) : (void)expected.erase(cell);
    });
    std::size_t num_locked = 0;
    for (const CellBox& part : locked.boxes()) {
      test::visitCells(part, [&](const Cell& cell) {
        ++num_locked;
        ASSERT_EQ(expected.count(cell), 1U) << test::seedNote(static_cast<std::size_t>(i));
      });
    }
    ASSERT_EQ(num_locked, expected.size()) << "disjoint" << test::seedNote(i);
  }
  locked.clear();
  EXPECT_TRUE(locked.boxes().empty());
}

TEST(LockedBoxes, areLeftOutOfUpdates) {
  Random random(52);
  LockedBoxes locked;
  const CellBox box{{-5, 3, 2}, {4, 11, 9}};
  locked.add(box);
  std::size_t num_locked = 0;
  for (std::size_t i = 0; i < 50; ++i) {
    const std::vector<BrickUpdate> updates =
        test::randomUpdate(random, {{-1, -1, -1}, {2, 2, 2}}, 4).bricks;
    const std::vector<BrickUpdate> rests = locked.without(updates);
    ASSERT_EQ(rests.size(), updates.size());
    for (std::size_t b = 0; b < updates.size(); ++b) {
      const BrickUpdate& update = updates[b];
      const BrickUpdate& rest = rests[b];
      EXPECT_EQ(rest.brick, update.brick);
      EXPECT_EQ(rest.morton, update.morton);
      test::visitCells(brickBox(update.brick), [&](const Cell& cell) {
        const bool is_free = !box.contains(cell);
        ASSERT_EQ(test::isInMask(rest.hits, cell), is_free && test::isInMask(update.hits, cell));
        ASSERT_EQ(test::isInMask(rest.misses, cell),
                  is_free && test::isInMask(update.misses, cell));
        num_locked += is_free ? 0 : 1;
      });
    }
  }
  EXPECT_GT(num_locked, 1000U);
}

TEST(LockedBoxes, areAllLookedAtForEachBrick) {
  LockedBoxes locked;
  locked.add({{80, 80, 80}, {88, 88, 88}});
  locked.add({{0, 0, 0}, {3, 8, 8}});
  locked.add({{-80, 0, 0}, {-72, 8, 8}});
  locked.add({{6, 0, 0}, {8, 8, 8}});
  BrickUpdate update;
  update.misses = BrickMask::ofBox({{0, 0, 0}, {8, 8, 8}});
  const std::vector<BrickUpdate> rest = locked.without({update});
  ASSERT_EQ(rest.size(), 1U);
  EXPECT_EQ(rest[0].misses, BrickMask::ofBox({{3, 0, 0}, {6, 8, 8}}));
}

TEST(LockOfCuboidMap, keepsCloudsAndNothingElseFromChangingVoxels) {
  Random random(53);
  CuboidMap map;
  test::VoxelMap voxels(map.sensorModel());
  const CellBox box{{-9, -7, -3}, {11, 6, 12}};
  const auto apply_both = [&](const ScanUpdate& update) {
    ScanUpdate rest = update;
    rest.bricks = map.locked().without(rest.bricks);
    voxels.apply(rest);
    map.apply(update);
  };
  const CellBox bricks{{-2, -2, -2}, {2, 2, 2}};
  for (int i = 0; i < 20; ++i) apply_both(test::randomUpdate(random, bricks, 8));
  const float before = voxels.find({0, 0, 0}).value_or(0.0F);
  map.lock(box);
  for (int i = 0; i < 20; ++i) apply_both(test::randomUpdate(random, bricks, 8));
  EXPECT_TRUE(hasVoxels(map, voxels));
  EXPECT_EQ(voxels.find({0, 0, 0}).value_or(0.0F), before);

  map.replace(box, std::vector<UniformBox>{});
  voxels.replace(box, {});
  EXPECT_TRUE(hasVoxels(map, voxels)) << "an edit is no cloud";
  map.unlock(box);
  EXPECT_TRUE(map.locked().boxes().empty());
  for (int i = 0; i < 20; ++i) apply_both(test::randomUpdate(random, bricks, 8));
  EXPECT_TRUE(hasVoxels(map, voxels));
  const auto is_inside = [&box](const auto& voxel) { return box.contains(voxel.first); };
  EXPECT_GT(std::count_if(voxels.voxels().begin(), voxels.voxels().end(), is_inside), 200);
  map.lock(box);
  map.clear();
  EXPECT_TRUE(map.locked().boxes().empty());
}

}  // namespace
}  // namespace cuboid_mapping
