// SPDX-License-Identifier: BSD-3-Clause
// Edits of a map: everything inside a box is replaced.
#include "cuboid_mapping/map/cuboid_map.h"

#include "support/following_copy.h"
#include "support/modelled_map.h"
#include "support/tree_queries.h"

#include <gtest/gtest.h>

#include <string>
#include <tuple>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::Random;

/// Disjoint cuboids inside a box, small ones and such of several bricks.
std::vector<Cuboid> randomCuboids(Random& random, const CellBox& box) {
  std::vector<Cuboid> cuboids;
  const int num_tries = random.integer(0, 12);
  for (int i = 0; i < num_tries; ++i) {
    const CellBox candidate = random.chance(0.1) ? box : test::randomBoxInside(random, box);
    const bool is_taken = std::any_of(cuboids.begin(), cuboids.end(), [&](const Cuboid& cuboid) {
      return cuboid.box.intersects(candidate);
    });
    if (!is_taken) cuboids.push_back({candidate, random.chance(0.5) ? 1.5F : -0.75F});
  }
  return cuboids;
}

testing::AssertionResult hasRightBookkeeping(const CuboidMap& map, const test::VoxelMap& voxels,
                                             const CellBox& area) {
  MapContent expected;
  for (const Cuboid& cuboid : test::allCuboids(map.tree())) expected.count(cuboid, 1);
  const MapContent& content = map.content();
  if (content.free_cuboids != expected.free_cuboids ||
      content.occupied_cuboids != expected.occupied_cuboids ||
      content.free_voxels != expected.free_voxels ||
      content.occupied_voxels != expected.occupied_voxels) {
    return testing::AssertionFailure() << "content";
  }
  testing::AssertionResult result = testing::AssertionSuccess();
  test::visitCells(area, [&](const Cell& cell) {
    const auto log_odds = voxels.find(cell);
    const Occupancy occupancy = log_odds ? classify(*log_odds) : Occupancy::kUnknown;
    if (map.classes().at(cell) != occupancy) {
      result = testing::AssertionFailure() << "class of " << cell;
    }
  });
  return result;
}

using ReplaceParam = std::tuple<std::string, std::size_t>;
class Replace : public testing::TestWithParam<ReplaceParam> {};

TEST_P(Replace, isVoxelByVoxelTheReferenceAndToldByItsChangeSets) {
  MapConfig config;
  config.fusion = std::get<0>(GetParam());
  config.hot_bytes = std::get<1>(GetParam());
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
      const std::vector<Cuboid> cuboids = randomCuboids(random, intersect(box, area));
      copy.follow(map, map.flush());
      for (const Cuboid& old :
           test::findInBox(test::allCuboids(map.tree()), box, CuboidFilter::kAll)) {
        num_cut += box.contains(old.box) ? 0 : 1;
      }
      voxels.replace(box, cuboids);
      const ChangeSet changes = map.replace(box, cuboids);
      copy.follow(map, changes);
      ++num_edits;
      ASSERT_EQ(changes.revision, map.revision());
      ASSERT_TRUE(map.replace(box, cuboids).boxes.empty()) << "twice is once";
      ASSERT_EQ(changes.revision, map.revision()) << "twice is once";
      ASSERT_TRUE(map.isFlushed(box));
    }
    if (i % 4 != 3) continue;
    copy.follow(map, map.flush());
    ASSERT_TRUE(hasVoxels(map, voxels)) << test::seedNote(i);
    ASSERT_TRUE(hasRightBookkeeping(map, voxels, area)) << test::seedNote(i);
    ASSERT_EQ(checkDisjoint(map.tree()), std::vector<std::string>{}) << test::seedNote(i);
    ASSERT_EQ(checkTree(map.tree()), std::vector<std::string>{}) << test::seedNote(i);
    ASSERT_EQ(copy.cuboids(), test::allCuboids(map.tree())) << test::seedNote(i);
  }
  EXPECT_GT(num_edits, kSteps / 3);
  EXPECT_GT(num_cut, 3 * num_edits);
}

INSTANTIATE_TEST_SUITE_P(AllConfigs, Replace,
                         testing::Combine(testing::Values("brick", "none"),
                                          testing::Values(0, std::size_t{1} << 40)));

TEST(ReplaceInCuboidMap, takesTheGivenCuboidsAsTheyAre) {
  CuboidMap map;
  const CellBox box{{-1000, 0, 0}, {1000, 30, 3}};
  const std::vector<Cuboid> cuboids{{{{-1000, 0, 0}, {5, 30, 3}}, -1.0F},
                                    {{{6, 0, 0}, {1000, 1, 3}}, 2.0F}};
  map.replace(box, cuboids);
  EXPECT_EQ(test::allCuboids(map.tree()), test::sorted(cuboids));
  EXPECT_EQ(map.revision(), 1U);
  EXPECT_EQ(map.classes().at({5, 0, 0}), Occupancy::kUnknown);
  EXPECT_EQ(map.classes().at({999, 0, 2}), Occupancy::kOccupied);
}

TEST(ReplaceInCuboidMap, cutsACuboidAtTheFacesOfTheBox) {
  CuboidMap map;
  map.replace(kAllCells, {{{{0, 0, 0}, {10, 1, 1}}, -1.0F}});
  const ChangeSet changes = map.replace({{4, -5, -5}, {6, 5, 5}}, {});
  EXPECT_EQ(test::allCuboids(map.tree()), (std::vector<Cuboid>{{{{0, 0, 0}, {4, 1, 1}}, -1.0F},
                                                               {{{6, 0, 0}, {10, 1, 1}}, -1.0F}}));
  EXPECT_EQ(changes.boxes, (std::vector<CellBox>{{{0, 0, 0}, {10, 1, 1}}}))
      << "no cuboid that changed lies across it";
  EXPECT_EQ(map.content().free_voxels, 8.0);
}

TEST(ReplaceInCuboidMap, doesNothingForAnEmptyBox) {
  CuboidMap map;
  map.replace(kAllCells, {{{{0, 0, 0}, {10, 1, 1}}, -1.0F}});
  EXPECT_TRUE(map.replace({{4, 0, 0}, {4, 1, 1}}, {}).boxes.empty());
  EXPECT_EQ(map.revision(), 1U);
  EXPECT_EQ(map.tree().size(), 1U);
}

TEST(ReplaceInCuboidMap, makesACopyOfAnotherMap) {
  Random random(62);
  MapConfig config;
  const test::ModelledMap model = test::randomMap(random, config);
  const std::vector<Cuboid> cuboids = test::allCuboids(model.map.tree());
  ASSERT_GT(cuboids.size(), 1000U);
  CuboidMap map(config);
  map.replace(kAllCells, cuboids);
  EXPECT_EQ(test::allCuboids(map.tree()), cuboids);
  EXPECT_EQ(checkTree(map.tree()), std::vector<std::string>{});
  EXPECT_TRUE(hasRightBookkeeping(map, model.voxels, {{-20, -20, -20}, {20, 20, 20}}));
}

}  // namespace
}  // namespace cuboid_mapping
