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
  locked.remove(kAllCells);
  EXPECT_TRUE(locked.isEmpty());
  EXPECT_TRUE(locked.boxes().empty());
}

TEST(LockedBoxes, areLeftOutOfUpdates) {
  Random random(52);
  LockedBoxes locked;
  const CellBox box{{-5, 3, 2}, {4, 11, 9}};
  locked.add(box);
  std::size_t num_locked = 0;
  std::size_t num_far = 0;
  for (std::size_t i = 0; i < 100; ++i) {
    const std::int32_t x = i % 2 == 0 ? 0 : 3;
    std::vector<BrickUpdate> updates =
        test::randomUpdate(random, {{x - 1, -1, -1}, {x + 2, 2, 2}}, 4).bricks;
    for (BrickUpdate& update : updates) update.grazes = ~(update.hits | update.misses);
    const std::vector<BrickUpdate> rests = locked.without(updates);
    ASSERT_EQ(rests.size(), updates.size());
    const bool is_near = locked.mayMeet(updates);
    num_far += is_near ? 0 : 1;
    for (std::size_t b = 0; b < updates.size(); ++b) {
      const BrickUpdate& update = updates[b];
      const BrickUpdate& rest = rests[b];
      EXPECT_EQ(rest.brick, update.brick);
      test::visitCells(brickBox(update.brick), [&](const Cell& cell) {
        const bool is_free = !box.contains(cell);
        ASSERT_TRUE(is_free || is_near);
        ASSERT_EQ(test::isInMask(rest.hits, cell), is_free && test::isInMask(update.hits, cell));
        ASSERT_EQ(test::isInMask(rest.misses, cell),
                  is_free && test::isInMask(update.misses, cell));
        ASSERT_EQ(test::isInMask(rest.grazes, cell),
                  is_free && test::isInMask(update.grazes, cell));
        num_locked += is_free ? 0 : 1;
      });
    }
  }
  EXPECT_GT(num_locked, 1000U);
  EXPECT_GT(num_far, 0U);
  EXPECT_FALSE(locked.mayMeet({}));
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

TEST(LockedBoxes, stayWhatTheyAreWhenABoxIsLockedTwice) {
  LockedBoxes locked;
  const CellBox box{{0, 0, 0}, {5, 5, 5}};
  locked.add(box);
  locked.add(box);
  EXPECT_EQ(locked.boxes(), std::vector<CellBox>{box});
  locked.add({});
  locked.remove({});
  EXPECT_EQ(locked.boxes(), std::vector<CellBox>{box});
  locked.remove(box);
  EXPECT_TRUE(locked.isEmpty());
}

/// As many locks as a planner could set in a day: a brick of a cloud meets few of them.
TEST(LockedBoxes, mayBeMany) {
  LockedBoxes locked;
  constexpr std::int32_t kCount = 40;
  const auto at = [](std::int32_t x, std::int32_t y, std::int32_t z) {
    return Cell{20 * x, 20 * y, 20 * z};
  };
  for (std::int32_t x = 0; x < kCount; ++x) {
    for (std::int32_t y = 0; y < kCount; ++y) {
      for (std::int32_t z = 0; z < kCount; ++z) {
        locked.add({at(x, y, z), at(x, y, z) + Cell{12, 3, 5}});
      }
    }
  }
  EXPECT_EQ(locked.boxes().size(), 64000U);
  std::vector<BrickUpdate> updates;
  double num_voxels = 0.0;
  double num_kept = 0.0;
  forEachBrick({{0, 0, 0}, {160, 160, 160}}, [&](const Cell& brick) {
    updates.emplace_back();
    updates.back().brick = brick;
    updates.back().misses = BrickMask::all();
    num_voxels += kBrickVoxels;
  });
  for (const BrickUpdate& rest : locked.without(updates)) num_kept += rest.misses.count();
  EXPECT_EQ(num_kept, num_voxels - 8 * 8 * 8 * 12 * 3 * 5);
}

TEST(LockOfCuboidMap, staysWhenAnotherMapTakesItsPlace) {
  CuboidMap map;
  CuboidMap other;
  const CellBox box{{0, 0, 0}, {4, 4, 4}};
  map.replace(kAllCells, {UniformBox{box, 1.0F}});
  other.replace(kAllCells, {UniformBox{{{9, 9, 9}, {10, 10, 10}}, -1.0F}});
  map.lock(box);
  const std::uint64_t revision = map.revision();
  const ChangeSet changes = map.exchange(other);
  EXPECT_TRUE(changes.is_everything);
  EXPECT_GT(changes.revision, revision);
  EXPECT_EQ(map.revision(), changes.revision);
  EXPECT_EQ(map.lockedBoxes(), std::vector<CellBox>{box});
  EXPECT_EQ(map.voxels().at({0, 0, 0}), Occupancy::kUnknown);
  EXPECT_EQ(map.voxels().at({9, 9, 9}), Occupancy::kFree);
  EXPECT_EQ(countCuboids(map).total(), 1U);
  EXPECT_EQ(other.voxels().at({0, 0, 0}), Occupancy::kOccupied);
  EXPECT_GT(other.revision(), revision) << "the other map has changed, too";
}

TEST(CuboidMap, isNotExchangedWithOneOfAnotherConfig) {
  CuboidMap map;
  const CellBox box{{0, 0, 0}, {4, 4, 4}};
  map.replace(kAllCells, {UniformBox{box, 1.0F}});
  const auto expect_refusal = [&](auto change) {
    MapConfig config = map.config();
    change(config);
    CuboidMap other(config);
    EXPECT_THROW(map.exchange(other), std::invalid_argument);
    EXPECT_EQ(map.voxels().numOccupiedVoxels(), 64.0);
  };
  expect_refusal([](MapConfig& config) { config.resolution_m *= 2.0; });
  expect_refusal([](MapConfig& config) { config.fusion = FusionKind::kGrowth; });
  expect_refusal([](MapConfig& config) { config.environment = Environment::kStatic; });
  expect_refusal([](MapConfig& config) { config.sensor_model.hit = 0.8; });
  expect_refusal([](MapConfig& config) { config.rtree.max_branches += 1; });
  MapConfig growth;
  growth.fusion = FusionKind::kGrowth;
  CuboidMap growing(growth);
  CuboidMap alike(growth);
  EXPECT_NO_THROW(growing.exchange(alike));
  growth.growth.settle_clouds = 3;
  CuboidMap sooner(growth);
  EXPECT_THROW(growing.exchange(sooner), std::invalid_argument);
  growth.growth.alpha_max = 0.5;
  CuboidMap larger(growth);
  EXPECT_THROW(sooner.exchange(larger), std::invalid_argument);
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
  EXPECT_TRUE(map.lockedBoxes().empty());
  for (int i = 0; i < 20; ++i) apply_both(test::randomUpdate(random, bricks, 8));
  EXPECT_TRUE(hasVoxels(map, voxels));
  const auto is_inside = [&box](const auto& voxel) { return box.contains(voxel.first); };
  EXPECT_GT(std::count_if(voxels.voxels().begin(), voxels.voxels().end(), is_inside), 200);
  map.lock(box);
  map.clear();
  EXPECT_TRUE(map.lockedBoxes().empty());
}

}  // namespace
}  // namespace cuboid_mapping
