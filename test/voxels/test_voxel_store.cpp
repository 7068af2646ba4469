// SPDX-License-Identifier: BSD-3-Clause
// The voxels of a map compared with plain bricks, in random clouds and edits.
#include "cuboid_mapping/voxels/voxel_store.h"

#include "cuboid_mapping/voxels/brick_store.h"

#include "support/modelled_brick.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <utility>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::ModelledBrick;
using test::Random;

/// Bricks with a known voxel.
using Bricks = std::map<Cell, ModelledBrick>;

void dropUnknown(Bricks& bricks) {
  for (auto brick = bricks.begin(); brick != bricks.end();) {
    brick = test::knownOf(brick->second).isEmpty() ? bricks.erase(brick) : std::next(brick);
  }
}

void applyTo(Bricks& bricks, const std::vector<BrickUpdate>& updates, const SensorModel& model) {
  for (const BrickUpdate& update : updates) {
    test::observe(bricks[update.brick], update.hits, update.misses, model);
  }
  dropUnknown(bricks);
}

/// Replaces everything inside a box by voxels, brick by brick.
void replaceIn(Bricks& bricks, const CellBox& box, const Bricks& others) {
  Bricks all = others;
  all.insert(bricks.begin(), bricks.end());
  for (const auto& entry : all) {
    const CellBox part = intersect(box, brickBox(entry.first));
    if (part.isEmpty()) continue;
    const auto other = others.find(entry.first);
    BrickMask::ofBox(part).forEach([&](int voxel) {
      const auto at = static_cast<std::size_t>(voxel);
      bricks[entry.first][at] = other == others.end() ? std::nullopt : other->second[at];
    });
  }
  dropUnknown(bricks);
}

std::vector<VoxelBrick> toVoxelBricks(const Bricks& bricks) {
  std::vector<VoxelBrick> packed;
  for (const auto& [brick, voxels] : bricks) packed.push_back({brick, test::toPacked(voxels)});
  return packed;
}

/// Expects equal counts, bounds, bricks and single voxels.
void expectContent(const VoxelStore& store, const Bricks& bricks) {
  int num_free = 0;
  int num_occupied = 0;
  for (const auto& [brick, voxels] : bricks) {
    for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
      const auto& log_odds = voxels[static_cast<std::size_t>(voxel)];
      num_free += test::classOf(log_odds) == Occupancy::kFree ? 1 : 0;
      num_occupied += test::classOf(log_odds) == Occupancy::kOccupied ? 1 : 0;
      ASSERT_EQ(store.logOddsAt(cellAt(brick, voxel)), log_odds);
      ASSERT_EQ(store.at(cellAt(brick, voxel)), test::classOf(log_odds));
    }
    const VoxelBrick* found = store.findBrick(brick);
    ASSERT_NE(found, nullptr);
    ASSERT_EQ(found->brick, brick);
    ASSERT_EQ(store.find(brick), &found->voxels);
  }
  EXPECT_EQ(store.numFreeVoxels(), num_free);
  EXPECT_EQ(store.numOccupiedVoxels(), num_occupied);
  EXPECT_EQ(store.size(), bricks.size());
  std::set<Cell> visited;
  store.forEach([&](const VoxelBrick& brick) {
    EXPECT_FALSE(brick.voxels.isEmpty()) << "a trace of an unknown brick";
    EXPECT_TRUE(visited.insert(brick.brick).second);
  });
  EXPECT_EQ(visited.size(), bricks.size());
}

/// Changes in one brick.
struct ChangedVoxels {
  Cell brick;
  BrickMask changed;
  bool is_reclassified;
};

/// Expects that the reported changes are the differences. A replaced brick may report more voxels.
void expectChanges(const std::vector<ChangedVoxels>& changes, const Bricks& before,
                   const Bricks& after) {
  const auto at = [](const Bricks& bricks, const Cell& brick) {
    const auto found = bricks.find(brick);
    return found == bricks.end() ? ModelledBrick() : found->second;
  };
  Bricks all = before;
  all.insert(after.begin(), after.end());
  std::map<Cell, ChangedVoxels> expected;
  for (const auto& entry : all) {
    const ModelledBrick old = at(before, entry.first);
    const ModelledBrick now = at(after, entry.first);
    ChangedVoxels change{entry.first, {}, false};
    for (std::size_t voxel = 0; voxel < now.size(); ++voxel) {
      if (old[voxel] != now[voxel]) change.changed.set(static_cast<int>(voxel));
      change.is_reclassified |= test::classOf(old[voxel]) != test::classOf(now[voxel]);
    }
    if (!change.changed.isEmpty()) expected[entry.first] = change;
  }
  ASSERT_EQ(changes.size(), expected.size());
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const ChangedVoxels& change = changes[i];
    EXPECT_TRUE(i == 0 || isBeforeOnMortonCurve(changes[i - 1].brick, change.brick));
    ASSERT_EQ(expected.count(change.brick), 1U);
    EXPECT_TRUE(change.changed.contains(expected[change.brick].changed));
    EXPECT_EQ(change.is_reclassified, expected[change.brick].is_reclassified);
  }
}

/// Makes a change. @return The changes, brick by brick.
std::vector<ChangedVoxels> commit(VoxelStore& store, VoxelStore::PendingChange change) {
  std::vector<ChangedVoxels> changes;
  store.reserve(change);
  store.commit(change, [&changes](const auto& brick) {
    changes.push_back({brick.brick, brick.changed, brick.is_reclassified});
  });
  return changes;
}

std::vector<ChangedVoxels> apply(VoxelStore& store, const std::vector<BrickUpdate>& update,
                                 const SensorModel& model, int threads) {
  return commit(store, store.prepare(update, model, {threads, threads % 2 == 0}));
}

std::vector<ChangedVoxels> replace(VoxelStore& store, const CellBox& box,
                                   const std::vector<VoxelBrick>& bricks) {
  return commit(store, store.prepareReplace(box, bricks, {}));
}

TEST(VoxelStore, knowsNothingAtFirst) {
  VoxelStore store;
  expectContent(store, {});
  EXPECT_EQ(store.at({1, 2, 3}), Occupancy::kUnknown);
  EXPECT_FALSE(store.logOddsAt({1, 2, 3}));
}

TEST(VoxelStore, keepsNoTraceOfBricksWithoutAnObservation) {
  VoxelStore store;
  EXPECT_TRUE(
      apply(store, {{{0, 0, 0}, {}, {}, {}}, {{8, 0, 0}, {}, {}, {}}}, SensorModel(), 1).empty());
  expectContent(store, {});
  EXPECT_TRUE(replace(store, brickBox({0, 0, 0}), {{{0, 0, 0}, {}}}).empty());
  EXPECT_TRUE(replace(store, {{-99, -99, -99}, {99, 99, 99}}, {}).empty());
  expectContent(store, {});
}

TEST(VoxelStore, replacesNothingOutsideTheBox) {
  VoxelStore store;
  (void)replace(store, {{0, 0, 0}, {16, 8, 8}},
                {{{0, 0, 0}, {BrickMask::all(), -1.0F}},
                 {{8, 0, 0}, {BrickMask::all(), -1.0F}},
                 {{16, 0, 0}, {BrickMask::all(), -1.0F}}});
  EXPECT_EQ(store.size(), 2U) << "a brick outside the box came in";
  const CellBox box{{6, 0, 0}, {10, 8, 8}};
  (void)replace(store, box, {{{0, 0, 0}, {BrickMask::all(), 1.0F}}});
  for (int x = 0; x < 16; ++x) {
    const Occupancy expected = x < 6 || x >= 10 ? Occupancy::kFree
                               : x < 8          ? Occupancy::kOccupied
                                                : Occupancy::kUnknown;
    EXPECT_EQ(store.at({x, 3, 3}), expected) << x;
  }
}

TEST(VoxelStore, hasNothingInAnEmptyBox) {
  VoxelStore store;
  (void)replace(store, brickBox({0, 0, 0}), {{{0, 0, 0}, {BrickMask::all(), 1.0F}}});
  for (const CellBox& box : {CellBox{{3, 3, 3}, {3, 3, 3}}, CellBox{{5, 3, 3}, {3, 5, 5}},
                             CellBox{{3, 3, 5}, {5, 5, 3}}}) {
    EXPECT_TRUE(replace(store, box, {}).empty()) << box;
    EXPECT_EQ(store.numOccupiedVoxels(), 512.0) << box;
  }
}

/// A random box of some bricks, or of a few voxels, or everything.
CellBox randomEditBox(Random& random) {
  constexpr std::int32_t kEnd = 1 << 30;
  if (random.chance(0.02)) return {{-kEnd, -kEnd, -kEnd}, {kEnd, kEnd, kEnd}};
  return test::randomBox(random, {{-40, -40, -40}, {40, 40, 40}}, random.chance(0.5) ? 10 : 40);
}

Bricks randomBricks(Random& random) {
  Bricks bricks;
  const int count = random.integer(0, 6);
  for (int i = 0; i < count; ++i) {
    bricks[test::randomBrick(random, 4)] = test::randomModelledBrick(random);
  }
  return bricks;
}

/// Checks the bricks of a box.
void expectBox(const VoxelStore& store, const Bricks& bricks, const CellBox& box) {
  std::set<Cell> expected;
  for (const auto& entry : bricks) {
    if (!intersect(box, brickBox(entry.first)).isEmpty()) expected.insert(entry.first);
  }
  std::set<Cell> visited;
  store.forEachIn(box, [&](const VoxelBrick& brick) { visited.insert(brick.brick); });
  EXPECT_EQ(visited, expected) << box;
  std::size_t num_visited = 0;
  const std::size_t last = (expected.size() + 1) / 2;
  const Visit end = store.visitIn(box, [&](const VoxelBrick& /*brick*/) {
    return ++num_visited == last ? Visit::kStop : Visit::kContinue;
  });
  EXPECT_EQ(end, expected.empty() ? Visit::kContinue : Visit::kStop);
  EXPECT_EQ(num_visited, last);
}

TEST(VoxelStore, agreesWithPlainBricksThroughRandomChanges) {
  constexpr std::size_t kSteps = 800;
  Random random(1);
  VoxelStore store;
  Bricks bricks;
  std::size_t num_shrunk = 0;
  for (std::size_t step = 0; step < kSteps; ++step) {
    const SensorModel model({}, step < kSteps / 2 ? Environment::kDynamic : Environment::kStatic);
    const Bricks before = bricks;
    std::vector<ChangedVoxels> changes;
    if (random.chance(0.5)) {
      const auto updates = test::randomBrickUpdates(random, 4, 8);
      applyTo(bricks, updates, model);
      changes = apply(store, updates, model, 1);
    } else {
      const CellBox box = randomEditBox(random);
      const Bricks others = random.chance(0.4) ? Bricks() : randomBricks(random);
      replaceIn(bricks, box, others);
      changes = replace(store, box, toVoxelBricks(others));
    }
    expectContent(store, bricks);
    expectChanges(changes, before, bricks);
    expectBox(store, bricks, randomEditBox(random));
    ASSERT_FALSE(HasFailure()) << test::seedNote(step);
    num_shrunk += bricks.size() < before.size() ? 1 : 0;
  }
  EXPECT_GT(num_shrunk, kSteps / 20);
}

TEST(VoxelStore, comesToTheSameWithAnyNumberOfThreads) {
  constexpr std::size_t kClouds = 12;
  const SensorModel model;
  VoxelStore stores[3];
  const int threads[] = {1, 2, 7};
  Random random(2);
  for (std::size_t cloud = 0; cloud < kClouds; ++cloud) {
    const auto updates = test::randomBrickUpdates(random, 6, 1500);
    const std::vector<ChangedVoxels> expected = apply(stores[0], updates, model, threads[0]);
    for (std::size_t i = 1; i < 3; ++i) {
      const std::vector<ChangedVoxels> changes = apply(stores[i], updates, model, threads[i]);
      ASSERT_EQ(changes.size(), expected.size());
      for (std::size_t c = 0; c < changes.size(); ++c) {
        ASSERT_EQ(changes[c].brick, expected[c].brick);
        ASSERT_EQ(changes[c].changed, expected[c].changed);
        ASSERT_EQ(changes[c].is_reclassified, expected[c].is_reclassified);
      }
      ASSERT_EQ(stores[i].size(), stores[0].size());
      ASSERT_EQ(stores[i].numFreeVoxels(), stores[0].numFreeVoxels());
      ASSERT_EQ(stores[i].numOccupiedVoxels(), stores[0].numOccupiedVoxels());
      stores[0].forEach([&](const VoxelBrick& brick) {
        const PackedVoxels* voxels = stores[i].find(brick.brick);
        ASSERT_NE(voxels, nullptr);
        ASSERT_EQ(*voxels, brick.voxels) << test::seedNote(cloud);
      });
    }
  }
  EXPECT_GT(stores[0].size(), 500U);
}

}  // namespace
}  // namespace cuboid_mapping
