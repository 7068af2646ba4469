// SPDX-License-Identifier: BSD-3-Clause
// Fusion by class: what waits, when it is written, and that the tree comes to the same in any case.
#include "cuboid_mapping/fusion/class_fusion.h"

#include "cuboid_mapping/fusion/brick_division.h"
#include "support/cuboid_set.h"
#include "support/modelled_brick.h"
#include "support/tree_invariants.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <string>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::Random;

constexpr std::size_t kAllBricks = std::numeric_limits<std::size_t>::max();
constexpr int kColdClouds = static_cast<int>(ClassFusion::kColdClouds);
constexpr CellBox kEverything{{-4096, -4096, -4096}, {4096, 4096, 4096}};

/// Voxels, and the fusion that follows them.
class Scene {
 public:
  explicit Scene(BrickDivision division = BrickDivision::kBoxes, const RTreeConfig& rtree = {8, 3},
                 int threads = 1)
      : fusion_(division, rtree, threads), division_(division), threads_(threads) {}

  [[nodiscard]] const ClassFusion& fusion() const { return fusion_; }
  [[nodiscard]] const VoxelStore& voxels() const { return voxels_; }
  [[nodiscard]] std::vector<Cuboid> cuboids() const { return test::allCuboids(fusion_.tree()); }
  [[nodiscard]] bool isWaiting(const Cell& brick) const { return fusion_.isWaiting(brick); }

  ChangeSet apply(const std::vector<BrickUpdate>& updates) {
    ChangeSet changes;
    const auto announce = [&](const auto& changed) { fusion_.announce(changed, changes); };
    const auto changed = voxels_.apply(updates, model_, threads_, announce);
    fusion_.noteCloud(voxels_, {updates, {}, 0, 0}, changed, changes);
    return changes;
  }
  /// A cloud that has a hit in one voxel of each of these bricks, or a miss.
  ChangeSet observe(const std::vector<Cell>& bricks, bool is_hit = true) {
    BrickMask one;
    one.set(0);
    std::vector<BrickUpdate> updates;
    for (const Cell& brick : bricks) {
      updates.push_back({brick, is_hit ? one : BrickMask(), is_hit ? BrickMask() : one, 0});
    }
    sortBricks(updates);
    return apply(updates);
  }
  void applyNothing(int num_clouds) {
    for (int i = 0; i < num_clouds; ++i) (void)apply({});
  }
  ChangeSet replace(const CellBox& box, const std::vector<VoxelBrick>& bricks) {
    ChangeSet changes;
    const auto announce = [&](const auto& changed) { fusion_.announce(changed, changes); };
    fusion_.noteEdit(voxels_, voxels_.replace(box, bricks, announce), changes);
    return changes;
  }
  void fuse(std::size_t max_bricks = kAllBricks) { fusion_.fuse(voxels_, max_bricks); }
  void clear() {
    voxels_.clear();
    fusion_.clear();
  }

  /// What ought to be in the tree when nothing waits.
  [[nodiscard]] std::vector<Cuboid> divideAll() const {
    std::vector<Cuboid> cuboids;
    voxels_.forEach([&](const VoxelBrick& brick) {
      if (division_ == BrickDivision::kBoxes) return divideBrick(brick, cuboids);
      forEachCell(brick.brick, brick.voxels.known(), [&](const Cell& cell) {
        cuboids.push_back({CellBox::ofCell(cell), voxels_.at(cell)});
      });
    });
    return test::sorted(std::move(cuboids));
  }

 private:
  ClassFusion fusion_;
  VoxelStore voxels_;
  SensorModel model_;
  BrickDivision division_;
  int threads_;
};

TEST(ClassFusion, putsNothingIntoTheTreeBeforeFuse) {
  Scene scene;
  (void)scene.observe({{0, 0, 0}, {8, 0, 0}});
  EXPECT_TRUE(scene.isWaiting({0, 0, 0}) && scene.isWaiting({8, 0, 0}));
  EXPECT_TRUE(scene.fusion().tree().isEmpty());
  scene.fuse();
  EXPECT_FALSE(scene.fusion().isAnyWaiting());
  EXPECT_EQ(scene.cuboids(), scene.divideAll());
  EXPECT_EQ(scene.cuboids().size(), 2U);
}

TEST(ClassFusion, givesForAWaitingBrickWhatFuseWouldPutIntoTheTree) {
  Random random(1);
  std::size_t num_cuboids = 0;
  for (std::size_t i = 0; i < 40; ++i) {
    Scene scene(i % 2 == 0 ? BrickDivision::kBoxes : BrickDivision::kVoxels);
    (void)scene.apply(test::randomBrickUpdates(random, 2, 20));
    std::vector<Cuboid> divided;
    scene.fusion().forEachWaiting(scene.voxels(), kEverything, [&](const VoxelBrick& brick) {
      scene.fusion().divide(brick, divided);
    });
    scene.fuse();
    ASSERT_EQ(scene.cuboids(), test::sorted(divided)) << test::seedNote(i);
    num_cuboids += divided.size();
  }
  EXPECT_GT(num_cuboids, 1000U);
}

TEST(ClassFusion, doesNotLookAtLogOddsThatStayInTheirClass) {
  Scene scene;
  (void)scene.observe({{0, 0, 0}});
  scene.fuse();
  const ChangeSet changes = scene.observe({{0, 0, 0}});
  ASSERT_EQ(changes.bricks.size(), 1U);
  EXPECT_EQ(changes.bricks[0].brick, (Cell{0, 0, 0}));
  EXPECT_FALSE(changes.bricks[0].has_new_cuboids);
  EXPECT_FALSE(scene.fusion().isAnyWaiting());
}

TEST(ClassFusion, tellsWhichBricksHaveNewCuboids) {
  Scene scene;
  (void)scene.observe({{0, 0, 0}, {8, 0, 0}});
  const VoxelBrick other{{0, 0, 0}, {BrickMask::all(), -1.0F}};
  const ChangeSet changes = scene.replace(brickBox({0, 0, 0}), {other});
  ASSERT_EQ(changes.bricks.size(), 1U);
  EXPECT_EQ(changes.bricks[0].brick, (Cell{0, 0, 0}));
  EXPECT_TRUE(changes.bricks[0].has_new_cuboids);
}

TEST(ClassFusion, takesABrickOutOfTheTreeThatIsNotKnownAnyMore) {
  Scene scene;
  (void)scene.observe({{0, 0, 0}, {8, 0, 0}});
  scene.fuse();
  const ChangeSet changes = scene.replace(brickBox({0, 0, 0}), {});
  ASSERT_EQ(changes.bricks.size(), 1U);
  EXPECT_TRUE(changes.bricks[0].has_new_cuboids);
  EXPECT_TRUE(scene.isWaiting({0, 0, 0}));
  scene.fuse();
  EXPECT_EQ(scene.cuboids(),
            (std::vector<Cuboid>{{CellBox::ofCell({8, 0, 0}), Occupancy::kOccupied}}));
}

TEST(ClassFusion, writesABrickThatHasGoneCold) {
  Scene scene;
  (void)scene.observe({{0, 0, 0}});
  scene.applyNothing(kColdClouds - 1);
  EXPECT_TRUE(scene.isWaiting({0, 0, 0}));
  scene.applyNothing(1);
  EXPECT_FALSE(scene.isWaiting({0, 0, 0}));
  EXPECT_EQ(scene.cuboids(), scene.divideAll());
}

TEST(ClassFusion, writesNoBrickWhoseClassesChange) {
  Scene scene;
  for (int cloud = 0; cloud < 4 * kColdClouds; ++cloud) {
    // Occupied and free in turn: hits until it is occupied, then misses until it is free.
    (void)scene.observe({{0, 0, 0}}, cloud % 16 < 4);
    ASSERT_TRUE(scene.isWaiting({0, 0, 0})) << cloud;
  }
  EXPECT_TRUE(scene.fusion().tree().isEmpty());
}

TEST(ClassFusion, writesABrickOfWhichOnlyLogOddsChange) {
  Scene scene;
  for (int cloud = 0; cloud <= kColdClouds; ++cloud) (void)scene.observe({{0, 0, 0}});
  EXPECT_FALSE(scene.isWaiting({0, 0, 0}));
}

/// Bricks in a row.
std::vector<Cell> row(int count) {
  std::vector<Cell> bricks;
  for (int i = 0; i < count; ++i) bricks.push_back({8 * (i % 64), 8 * (i / 64), 0});
  return bricks;
}

TEST(ClassFusion, spreadsBricksThatGoColdAtOnceOverClouds) {
  Scene scene;
  (void)scene.observe(row(4000));
  scene.applyNothing(kColdClouds - 1);
  int num_clouds = 0;
  while (scene.fusion().isAnyWaiting()) {
    const std::size_t before = scene.fusion().numWaiting(scene.voxels());
    scene.applyNothing(1);
    const std::size_t written = before - scene.fusion().numWaiting(scene.voxels());
    ASSERT_GT(written, 0U);
    ASSERT_LE(written, std::max<std::size_t>(64, before / 20));
    ++num_clouds;
  }
  EXPECT_GE(num_clouds, 20);
  EXPECT_EQ(scene.cuboids(), scene.divideAll());
}

TEST(ClassFusion, fusesAsManyBricksAsItIsToldThoseThatHaveWaitedLongestFirst) {
  Scene scene;
  const std::vector<Cell> old = row(30);
  (void)scene.observe(old);
  std::vector<Cell> fresh;
  for (const Cell& brick : old) fresh.push_back(brick + Cell{0, 80, 0});
  (void)scene.observe(fresh);
  for (std::size_t done = 10; done <= 60; done += 10) {
    scene.fuse(10);
    ASSERT_EQ(scene.fusion().numWaiting(scene.voxels()), 60 - done);
    const auto num_old = std::count_if(old.begin(), old.end(),
                                       [&](const Cell& brick) { return scene.isWaiting(brick); });
    ASSERT_EQ(num_old, done < 30 ? static_cast<int>(30 - done) : 0);
  }
  EXPECT_EQ(scene.cuboids(), scene.divideAll());
}

TEST(ClassFusion, leavesCuboidsInTheirPlacesThatAreStillThere) {
  Scene scene;
  const CellBox left{{0, 0, 0}, {3, 8, 8}};
  const CellBox right{{5, 0, 0}, {8, 8, 8}};
  const PackedVoxels free(BrickMask::all(), -1.0F);
  (void)scene.replace(left, {{{0, 0, 0}, free}});
  (void)scene.replace(right, {{{0, 0, 0}, free}});
  scene.fuse();
  Selection before;
  scene.fusion().tree().select(left, before);
  ASSERT_EQ(before.cuboids, (std::vector<Cuboid>{{left, Occupancy::kFree}}));
  (void)scene.replace(right, {});
  scene.fuse();
  EXPECT_EQ(scene.cuboids(), before.cuboids);
}

TEST(ClassFusion, forgetsAllWithClear) {
  Scene scene;
  (void)scene.observe(row(100));
  scene.fuse(50);
  scene.clear();
  EXPECT_TRUE(scene.fusion().tree().isEmpty());
  EXPECT_FALSE(scene.fusion().isAnyWaiting());
  scene.applyNothing(2 * kColdClouds);
  scene.fuse();
  EXPECT_TRUE(scene.fusion().tree().isEmpty());
  (void)scene.observe({{0, 0, 0}});
  scene.fuse();
  EXPECT_EQ(scene.cuboids(), scene.divideAll());
}

/// What a test does to several scenes at once.
struct Step {
  std::vector<BrickUpdate> updates;
  CellBox box;  ///< Not empty: an edit in place of a cloud.
  std::vector<VoxelBrick> bricks;
};

Step randomStep(Random& random) {
  Step step;
  if (random.chance(0.7)) {
    step.updates = test::randomBrickUpdates(random, 2, 20);
    return step;
  }
  step.box = test::randomBox(random, {{-20, -20, -20}, {16, 16, 16}}, 20);
  std::set<Cell> bricks;
  forEachBrick(step.box, [&](const Cell& brick) {
    if (random.chance(0.5)) bricks.insert(brick);
  });
  for (const Cell& brick : bricks) {
    step.bricks.push_back({brick, test::toPacked(test::randomModelledBrick(random))});
  }
  return step;
}

void take(const Step& step, Scene& scene) {
  if (step.box.isEmpty()) {
    (void)scene.apply(step.updates);
  } else {
    (void)scene.replace(step.box, step.bricks);
  }
}

/// The tree is one, and holds of all bricks that do not wait what they are divided into.
void expectCurrent(const Scene& scene) {
  EXPECT_EQ(checkTree(scene.fusion().tree()), std::vector<std::string>{});
  EXPECT_EQ(checkDisjoint(scene.fusion().tree()), std::vector<std::string>{});
  const auto current = [&](std::vector<Cuboid> cuboids) {
    cuboids.erase(std::remove_if(cuboids.begin(), cuboids.end(),
                                 [&](const Cuboid& cuboid) {
                                   return scene.isWaiting(brickOf(cuboid.box.min));
                                 }),
                  cuboids.end());
    return cuboids;
  };
  EXPECT_EQ(current(scene.cuboids()), current(scene.divideAll()));
}

TEST(ClassFusion, comesToTheSameWhateverTheTreeTheThreadsAndTheTimesOfFusing) {
  constexpr std::size_t kRuns = 8;
  constexpr std::size_t kSteps = 60;
  for (std::size_t run = 0; run < kRuns; ++run) {
    Random random(500 + run);
    const BrickDivision division = run % 4 == 0 ? BrickDivision::kVoxels : BrickDivision::kBoxes;
    Scene at_once(division);
    Scene now_and_then(division, {32, 12}, 3);
    Scene at_the_end(division, {4, 2}, 2);
    for (std::size_t i = 0; i < kSteps; ++i) {
      const Step step = randomStep(random);
      for (Scene* scene : {&at_once, &now_and_then, &at_the_end}) take(step, *scene);
      at_once.fuse();
      if (random.chance(0.3)) now_and_then.fuse(random.index(40));
      if (i % 4 != 0) continue;
      expectCurrent(now_and_then);
      expectCurrent(at_the_end);
      ASSERT_EQ(at_once.cuboids(), at_once.divideAll()) << test::seedNote(i);
      ASSERT_FALSE(HasFailure()) << "run " << run << ", " << test::seedNote(i);
    }
    now_and_then.fuse();
    at_the_end.fuse();
    ASSERT_EQ(now_and_then.cuboids(), at_once.cuboids()) << test::seedNote(run);
    ASSERT_EQ(at_the_end.cuboids(), at_once.cuboids()) << test::seedNote(run);
    expectCurrent(at_the_end);
  }
}

TEST(ClassFusion, comesToTheSameInAnyOrderOfEdits) {
  constexpr std::size_t kCases = 30;
  for (std::size_t i = 0; i < kCases; ++i) {
    Random random(900 + i);
    std::vector<VoxelBrick> bricks;
    std::set<Cell> places;
    for (int n = 0; n < 60; ++n) places.insert(test::randomBrick(random, 4));
    for (const Cell& place : places) {
      bricks.push_back({place, test::toPacked(test::randomModelledBrick(random))});
    }
    Scene in_order;
    (void)in_order.replace(kEverything, bricks);
    in_order.fuse();
    Scene shuffled;
    random.shuffle(bricks);
    for (const VoxelBrick& brick : bricks) {
      (void)shuffled.replace(brickBox(brick.brick), {brick});
      if (random.chance(0.5)) shuffled.fuse(3);
    }
    shuffled.fuse();
    ASSERT_EQ(shuffled.cuboids(), in_order.cuboids()) << test::seedNote(i);
    expectCurrent(shuffled);
  }
}

}  // namespace
}  // namespace cuboid_mapping
