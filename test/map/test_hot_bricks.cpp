// SPDX-License-Identifier: BSD-3-Clause
// A map with hot bricks beside one without.
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/box_query.h"

#include "support/following_copy.h"
#include "support/modelled_map.h"

#include <gtest/gtest.h>

#include <string>
#include <tuple>

namespace cuboid_mapping {
namespace {

using test::Random;

constexpr std::size_t kUnbounded = std::size_t{1} << 40;
/// Bricks of one update at most; all in different groups, each group takes some memory, too.
constexpr std::size_t kMaxBricks = 12;
constexpr std::size_t kBytesOfOneUpdate =
    kMaxBricks * (sizeof(DenseBrick) + sizeof(HotGroup) + 256);
constexpr std::size_t kTableBytes = 4096;

using HotParam = std::tuple<std::size_t, int, std::string, Environment>;

class HotBricks : public testing::TestWithParam<HotParam> {
 protected:
  HotBricks() {
    config_.resolution_m = 0.1;
    config_.fusion = std::get<2>(GetParam());
    config_.environment = std::get<3>(GetParam());
    config_.rtree = {8, 3};
    hot_config_ = config_;
    hot_config_.hot_bytes = std::get<0>(GetParam());
    hot_config_.threads = std::get<1>(GetParam());
  }

  MapConfig config_;
  MapConfig hot_config_;
};

/// The cuboids of a region, clipped to it.
std::vector<Cuboid> cuboidsIn(const CuboidMap& map, const CellBox& region) {
  return test::sorted(queryBox(map, region, CuboidOutput::kClipped).cuboids);
}

TEST_P(HotBricks, leaveTheMapAsItIsWithoutThem) {
  Random random(21);
  CuboidMap map(config_);
  CuboidMap hot(hot_config_);
  test::FollowingCopy copy;
  const CellBox bricks{{-8, -8, -8}, {8, 8, 8}};
  constexpr std::size_t kUpdates = 160;
  std::size_t num_flushes = 0;
  std::size_t num_looks = 0;
  for (std::size_t i = 0; i < kUpdates; ++i) {
    // A sensor that moves on: bricks grow cold behind it.
    const auto at = static_cast<std::int32_t>(i / 20) - 4;
    const CellBox area{{2 * at, -2, -2}, {2 * at + 3, 2, 2}};
    const ScanUpdate update =
        test::randomUpdate(random, random.chance(0.8) ? area : bricks, kMaxBricks);
    map.apply(update);
    copy.follow(hot, hot.apply(update));
    ASSERT_EQ(hot.revision(), map.revision()) << test::seedNote(i);
    ASSERT_LE(hot.numHotBytes(),
              std::max(hot_config_.hot_bytes, kBytesOfOneUpdate) + kBytesOfOneUpdate + kTableBytes);
    if (random.chance(0.1)) {
      copy.follow(hot, hot.flush());
      ++num_flushes;
      ASSERT_EQ(test::allCuboids(hot.tree()), test::allCuboids(map.tree())) << test::seedNote(i);
      ASSERT_EQ(hot.content().free_cuboids, map.content().free_cuboids);
      ASSERT_EQ(hot.content().occupied_voxels, map.content().occupied_voxels);
    } else if (random.chance(0.1)) {
      const CellBox region = test::randomBox(random, {{-64, -64, -64}, {64, 64, 64}}, 40);
      copy.follow(hot, hot.flush(region));
      ++num_looks;
      ASSERT_EQ(cuboidsIn(hot, region), cuboidsIn(map, region)) << test::seedNote(i);
    }
    if (i % 8 == 0) {
      ASSERT_EQ(copy.cuboids(), test::allCuboids(hot.tree())) << test::seedNote(i);
    }
    if (i == 100) {
      map.clear();
      copy.follow(hot, hot.clear());
    }
  }
  hot.flush();
  EXPECT_EQ(test::allCuboids(hot.tree()), test::allCuboids(map.tree()));
  EXPECT_EQ(checkTree(hot.tree()), std::vector<std::string>{});
  EXPECT_EQ(checkDisjoint(hot.tree()), std::vector<std::string>{});
  EXPECT_TRUE(hot.flush().boxes.empty()) << "nothing is left to be written back";
  EXPECT_GT(map.tree().size(), 1000U);
  EXPECT_GT(num_flushes, 5U);
  EXPECT_GT(num_looks, 5U);
}

INSTANTIATE_TEST_SUITE_P(AllConfigs, HotBricks,
                         testing::Combine(testing::Values(0, 1, std::size_t{1} << 16, kUnbounded),
                                          testing::Values(1, 4), testing::Values("brick", "none"),
                                          testing::Values(Environment::kDynamic,
                                                          Environment::kStatic)));

TEST(HotBricksOfCuboidMap, areNotInTheTreeUntilTheyAreFlushed) {
  MapConfig config;
  config.hot_bytes = kUnbounded;
  CuboidMap map(config);
  Random random(22);
  const ScanUpdate update = test::randomUpdate(random, {{0, 0, 0}, {1, 1, 1}}, 1);
  EXPECT_TRUE(map.apply(update).boxes.empty());
  EXPECT_EQ(map.revision(), 1U);
  EXPECT_TRUE(map.tree().isEmpty());
  EXPECT_GT(map.numHotBytes(), sizeof(DenseBrick));
  const CellBox neighbour{{8, 0, 0}, {16, 8, 8}};
  EXPECT_TRUE(map.isFlushed(neighbour));
  EXPECT_FALSE(map.isFlushed(kAllCells));
  EXPECT_TRUE(map.flush(neighbour).boxes.empty()) << "another brick of the group";
  EXPECT_EQ(map.flush({{7, 7, 7}, {9, 9, 9}}).boxes.size(), 1U);
  EXPECT_TRUE(map.isFlushed(kAllCells));
  EXPECT_FALSE(map.tree().isEmpty());
  EXPECT_EQ(map.revision(), 1U) << "no voxel has changed";
}

TEST(HotBricksOfCuboidMap, areWrittenBackAFewGroupsAtATime) {
  MapConfig config;
  config.hot_bytes = kUnbounded;
  CuboidMap map(config);
  Random random(24);
  for (std::int32_t group = 0; group < 7; ++group) {
    map.apply(test::randomUpdate(random, {{4 * group, 0, 0}, {4 * group + 1, 1, 1}}, 1));
  }
  std::size_t num_boxes = 0;
  for (const std::size_t expected : {3U, 3U, 1U, 0U}) {
    EXPECT_EQ(map.isFlushed(kAllCells), expected == 0U);
    const ChangeSet changes = map.flush(kAllCells, 3);
    EXPECT_EQ(changes.boxes.size(), expected);
    num_boxes += changes.boxes.size();
  }
  EXPECT_EQ(num_boxes, 7U);
}

TEST(HotBricksOfCuboidMap, giveTheirMemoryBackWhenTheyCool) {
  MapConfig config;
  config.hot_bytes = kUnbounded;
  CuboidMap map(config);
  const std::size_t bytes_at_first = map.numHotBytes();
  Random random(25);
  const ScanUpdate update = test::randomUpdate(random, {{0, 0, 0}, {9, 9, 9}}, 50);
  map.apply(update);
  EXPECT_GT(map.numHotBytes(), bytes_at_first);
  EXPECT_EQ(map.cool().boxes.size(), update.bricks.size());
  EXPECT_EQ(map.numHotBytes(), bytes_at_first);
  CuboidMap expected;
  expected.apply(update);
  EXPECT_EQ(test::allCuboids(map.tree()), test::allCuboids(expected.tree()));
}

TEST(HotBricksOfCuboidMap, areWrittenBackAndDroppedWhenTheyAreCold) {
  MapConfig config;
  config.hot_bytes = kUnbounded;
  CuboidMap map(config);
  Random random(23);
  map.apply(test::randomUpdate(random, {{0, 0, 0}, {1, 1, 1}}, 1));
  const std::size_t bytes = map.numHotBytes();
  std::size_t num_clouds = 0;
  while (map.tree().isEmpty() && num_clouds < 1000) {
    map.apply(test::randomUpdate(random, {{100, 0, 0}, {101, 1, 1}}, 1));
    ++num_clouds;
  }
  EXPECT_EQ(num_clouds, 21U);
  EXPECT_EQ(map.numHotBytes(), bytes) << "that of the other brick";
}

}  // namespace
}  // namespace cuboid_mapping
