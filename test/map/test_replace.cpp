// SPDX-License-Identifier: BSD-3-Clause
// Edits of a map that replace everything inside a box.
#include "cuboid_mapping/map/cuboid_map.h"

#include "support/following_copy.h"
#include "support/modelled_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::Random;

/// Disjoint boxes inside a box, small ones and larger ones of several bricks.
std::vector<UniformBox> randomBoxes(Random& random, const CellBox& box) {
  std::vector<UniformBox> boxes;
  const int num_tries = random.integer(0, 12);
  for (int i = 0; i < num_tries; ++i) {
    const CellBox candidate = random.chance(0.1) ? box : test::randomBoxInside(random, box);
    const bool is_taken = std::any_of(boxes.begin(), boxes.end(), [&](const UniformBox& uniform) {
      return uniform.box.intersects(candidate);
    });
    if (!is_taken) boxes.push_back({candidate, random.chance(0.5) ? 1.5F : -0.75F});
  }
  return boxes;
}

testing::AssertionResult hasRightBookkeeping(const CuboidMap& map, const test::VoxelMap& voxels,
                                             const CellBox& area) {
  testing::AssertionResult result = testing::AssertionSuccess();
  double num_free = 0.0;
  double num_occupied = 0.0;
  test::visitCells(area, [&](const Cell& cell) {
    const std::optional<float> log_odds = voxels.find(cell);
    const Occupancy occupancy = log_odds ? classify(*log_odds) : Occupancy::kUnknown;
    num_free += occupancy == Occupancy::kFree ? 1.0 : 0.0;
    num_occupied += occupancy == Occupancy::kOccupied ? 1.0 : 0.0;
    if (map.voxels().at(cell) != occupancy || map.voxels().logOddsAt(cell) != log_odds) {
      result = testing::AssertionFailure() << "value of " << cell;
    }
  });
  if (map.voxels().numFreeVoxels() != num_free ||
      map.voxels().numOccupiedVoxels() != num_occupied) {
    return testing::AssertionFailure() << "number of voxels";
  }
  return result;
}

/// Bricks of a change, each once.
std::set<Cell> bricksOf(const ChangeSet& changes) {
  std::set<Cell> bricks;
  for (const ChangedBrick& changed : changes.bricks) bricks.insert(changed.brick);
  return bricks;
}

using ReplaceParam = std::tuple<FusionKind, int>;
class Replace : public testing::TestWithParam<ReplaceParam> {};

TEST_P(Replace, isVoxelByVoxelTheReferenceAndToldByItsChangeSets) {
  MapConfig config;
  config.fusion = std::get<0>(GetParam());
  config.threads = std::get<1>(GetParam());
  config.rtree = {8, 3};
  CuboidMap map(config);
  test::VoxelMap voxels(map.sensorModel());
  test::FollowingCopy copy;
  Random random(61);
  const CellBox area{{-40, -20, -20}, {40, 20, 20}};
  constexpr std::size_t kSteps = 120;
  std::size_t num_edits = 0;
  std::size_t num_cut = 0;
  for (std::size_t i = 0; i < kSteps; ++i) {
    if (random.chance(0.5)) {
      const ScanUpdate update = test::randomUpdate(random, {{-5, -2, -2}, {5, 2, 2}}, 8);
      voxels.apply(update);
      copy.follow(map, map.apply(update));
    } else {
      const bool is_everything = random.chance(0.03);
      const CellBox box = is_everything ? kAllCells : test::randomBoxInside(random, area);
      const std::vector<UniformBox> boxes = randomBoxes(random, intersect(box, area));
      visitBox(map, box, CuboidFilter::kAll, [&](const Cuboid& old) {
        num_cut += box.contains(old.box) ? 0 : 1;
        return Visit::kContinue;
      });
      voxels.replace(box, boxes);
      const ChangeSet changes = map.replace(box, boxes);
      copy.follow(map, changes);
      ++num_edits;
      ASSERT_EQ(changes.revision, map.revision());
      ASSERT_TRUE(map.replace(box, boxes).bricks.empty()) << "twice is once";
      ASSERT_EQ(changes.revision, map.revision()) << "twice is once";
    }
    if (i % 4 != 3) continue;
    ASSERT_TRUE(hasVoxels(map, voxels)) << test::seedNote(i);
    ASSERT_TRUE(hasRightBookkeeping(map, voxels, area)) << test::seedNote(i);
    ASSERT_EQ(checkMap(map), std::vector<std::string>{}) << test::seedNote(i);
    ASSERT_EQ(copy.cuboids(), test::allCuboids(map)) << test::seedNote(i);
  }
  EXPECT_GT(num_edits, kSteps / 3);
  // Single voxels cannot be cut.
  if (config.fusion == FusionKind::kClass) {
    EXPECT_GT(num_cut, 3 * num_edits);
  }
}

INSTANTIATE_TEST_SUITE_P(AllConfigs, Replace,
                         testing::Combine(testing::Values(FusionKind::kClass, FusionKind::kGrowth,
                                                          FusionKind::kNone),
                                          testing::Values(1, 4)));

TEST(ReplaceInCuboidMap, takesTheGivenVoxelsAsTheyAre) {
  CuboidMap map;
  const CellBox box{{-1000, 0, 0}, {1000, 30, 3}};
  const std::vector<UniformBox> boxes{{{{-1000, 0, 0}, {5, 30, 3}}, -1.0F},
                                      {{{6, 0, 0}, {1000, 1, 3}}, 100.0F}};
  map.replace(box, boxes);
  EXPECT_EQ(map.revision(), 1U);
  EXPECT_EQ(map.voxels().numFreeVoxels(), boxes[0].box.numVoxels());
  EXPECT_EQ(map.voxels().numOccupiedVoxels(), boxes[1].box.numVoxels());
  EXPECT_EQ(map.voxels().at({5, 0, 0}), Occupancy::kUnknown);
  EXPECT_EQ(map.voxels().logOddsAt({4, 29, 2}), -1.0F);
  EXPECT_EQ(map.voxels().logOddsAt({999, 0, 2}), 100.0F) << "beyond the clamping threshold";
  EXPECT_EQ(checkMap(map), std::vector<std::string>{});
}

TEST(ReplaceInCuboidMap, cutsACuboidAtTheFacesOfTheBox) {
  CuboidMap map;
  map.replace(kAllCells, {UniformBox{{{0, 0, 0}, {8, 1, 1}}, -1.0F}});
  const ChangeSet changes = map.replace({{4, -5, -5}, {6, 5, 5}}, std::vector<UniformBox>{});
  EXPECT_EQ(test::allCuboids(map),
            (std::vector<Cuboid>{{{{0, 0, 0}, {4, 1, 1}}, Occupancy::kFree},
                                 {{{6, 0, 0}, {8, 1, 1}}, Occupancy::kFree}}));
  EXPECT_EQ(bricksOf(changes), (std::set<Cell>{{0, 0, 0}}));
  EXPECT_EQ(map.voxels().numFreeVoxels(), 6.0);
}

TEST(ReplaceInCuboidMap, doesNothingForAnEmptyBox) {
  CuboidMap map;
  map.replace(kAllCells, {UniformBox{{{0, 0, 0}, {8, 1, 1}}, -1.0F}});
  EXPECT_TRUE(map.replace({{4, 0, 0}, {4, 1, 1}}, std::vector<UniformBox>{}).bricks.empty());
  EXPECT_EQ(map.revision(), 1U);
  EXPECT_EQ(countCuboids(map).total(), 1U);
}

TEST(ReplaceInCuboidMap, doesNotLookAtVoxelsOutsideTheBox) {
  CuboidMap map;
  const VoxelBrick brick{{8, 0, 0}, PackedVoxels(BrickMask::all(), 1.0F)};
  map.replace({{0, 0, 0}, {10, 2, 2}}, {brick, {{16, 0, 0}, brick.voxels}});
  EXPECT_EQ(test::allCuboids(map),
            (std::vector<Cuboid>{{{{8, 0, 0}, {10, 2, 2}}, Occupancy::kOccupied}}));
}

TEST(ReplaceInCuboidMap, leavesNoTraceOfBricksThatBecomeUnknown) {
  CuboidMap map;
  map.replace(kAllCells, {UniformBox{{{-90, 0, 0}, {90, 30, 30}}, -1.0F}});
  map.replace(kAllCells, std::vector<UniformBox>{});
  EXPECT_EQ(map.voxels().size(), 0U);
  EXPECT_FALSE(map.bounds().has_value());
  EXPECT_TRUE(test::allCuboids(map).empty());
  EXPECT_EQ(measureTree(map).inner_nodes, 0U);
}

TEST(ReplaceInCuboidMap, makesACopyOfAnotherMap) {
  Random random(62);
  MapConfig config;
  const test::ModelledMap model = test::randomMap(random, config);
  ASSERT_GT(test::allCuboids(model.map).size(), 1000U);
  CuboidMap map(config);
  map.replace(kAllCells, model.map.voxels().copyIn(kAllCells));
  EXPECT_EQ(test::allCuboids(map), test::allCuboids(model.map));
  EXPECT_EQ(checkMap(map), std::vector<std::string>{});
  EXPECT_TRUE(hasRightBookkeeping(map, model.voxels, {{-24, -24, -24}, {24, 24, 24}}));
}

TEST(ReplaceInCuboidMap, refusesLogOddsThatAreNotFinite) {
  for (const float wrong :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    for (const std::int32_t edge : {1, 2, 8, 9}) {
      CuboidMap map;
      const CellBox box{{0, 0, 0}, {edge, edge, 1}};
      EXPECT_THROW(map.replace(box, {UniformBox{box, wrong}}), std::invalid_argument) << edge;
      EXPECT_EQ(map.revision(), 0U);
      EXPECT_EQ(map.voxels().size(), 0U);
    }
  }
}

/// Bricks of the given boxes take memory only where they are in the replaced one.
TEST(ReplaceInCuboidMap, takesBoxesOfAnySize) {
  CuboidMap map;
  constexpr CellBox kBox{{-3, -3, -3}, {20, 20, 20}};
  map.replace(kBox, {UniformBox{kAllCells, 1.0F}});
  EXPECT_EQ(map.bounds(), kBox);
  EXPECT_EQ(map.voxels().numOccupiedVoxels(), kBox.numVoxels());
}

/// No map has voxels or locks there, and no file could keep them.
TEST(ReplaceInCuboidMap, cutsBoxesAtTheLimitsOfAMap) {
  constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();
  constexpr CellBox kOutside{{kMost - 3, kMost - 3, kMost - 3}, {kMost, kMost, kMost}};
  constexpr CellBox kAcross{{Grid::kMaxCell - 1, 0, 0}, {kMost, 1, 1}};
  constexpr CellBox kLast{{Grid::kMaxCell - 1, 0, 0}, {Grid::kMaxCell, 1, 1}};
  CuboidMap map;
  const VoxelBrick brick{brickOf(kOutside.min), PackedVoxels(BrickMask::all(), 1.0F)};
  EXPECT_TRUE(map.replace(kOutside, {UniformBox{kOutside, 1.0F}}).bricks.empty());
  EXPECT_TRUE(map.replace(kOutside, {brick}).bricks.empty());
  map.replace(kAcross, {UniformBox{kAcross, 1.0F}});
  EXPECT_EQ(map.bounds(), kLast);
  map.lock(kAcross);
  map.lock(kOutside);
  EXPECT_EQ(map.lockedBoxes(), std::vector<CellBox>{kLast});
  map.setLocked({kOutside, kAcross});
  EXPECT_EQ(map.lockedBoxes(), std::vector<CellBox>{kLast});
  EXPECT_FALSE(findFault(takeSnapshot(map, "")));
}

TEST(ReplaceInCuboidMap, shrinksTheBoundsWithWhatIsErased) {
  CuboidMap map;
  const CellBox far{{80, 0, -40}, {83, 2, -39}};
  map.replace(kAllCells, {UniformBox{{{1, 2, 3}, {4, 5, 6}}, -1.0F}, UniformBox{far, 1.0F}});
  EXPECT_EQ(map.bounds(), (CellBox{{1, 0, -40}, {83, 5, 6}})) << "tight, not by bricks";
  map.replace(far, std::vector<UniformBox>{});
  EXPECT_EQ(map.bounds(), (CellBox{{1, 2, 3}, {4, 5, 6}}));
}

}  // namespace
}  // namespace cuboid_mapping
