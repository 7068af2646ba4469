// SPDX-License-Identifier: BSD-3-Clause
// Compares a map that divides bricks when they are read with one that divides them at every cloud.
#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/cuboid_query.h"
#include "cuboid_mapping/query/nearest_query.h"

#include "support/following_copy.h"
#include "support/modelled_map.h"
#include "support/tree_queries.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <thread>
#include <tuple>

namespace cuboid_mapping {
namespace {

using test::Random;

constexpr double kAnyDistance = std::numeric_limits<double>::infinity();

using OrderParam = std::tuple<FusionKind, Environment, int>;

class FusionOrder : public testing::TestWithParam<OrderParam> {
 protected:
  FusionOrder() {
    config_.resolution_m = 0.1;
    config_.fusion = std::get<0>(GetParam());
    config_.environment = std::get<1>(GetParam());
    config_.rtree = {8, 3};
    lazy_config_ = config_;
    lazy_config_.threads = std::get<2>(GetParam());
    lazy_config_.rtree = {32, 12};
    lazy_config_.fuse = FusionTime::kWhenRead;
  }

  MapConfig config_;
  MapConfig lazy_config_;
};

/// Compares distances, and cuboids if no other one is as far away.
void checkNearest(const CuboidMap& lazy, const CuboidMap& fused, const Eigen::Vector3d& point,
                  CuboidFilter filter, double max_distance_m) {
  const auto expected =
      findNearest(fused, point, 40, filter, Budget::unlimited(), max_distance_m).value;
  const auto nearest =
      findNearest(lazy, point, 40, filter, Budget::unlimited(), max_distance_m).value;
  ASSERT_EQ(nearest.size(), expected.size());
  const auto is_alone = [&](std::size_t i) {
    return (i == 0 || expected[i - 1].distance_m < expected[i].distance_m) &&
           i + 1 < expected.size() && expected[i].distance_m < expected[i + 1].distance_m;
  };
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    ASSERT_EQ(nearest[i].distance_m, expected[i].distance_m);
    if (is_alone(i)) {
      ASSERT_EQ(nearest[i].cuboid, expected[i].cuboid);
    }
  }
}

/// All cuboids by distance, sorted as a set.
std::vector<Cuboid> visitedNearest(const CuboidMap& map, const Eigen::Vector3d& point,
                                   double max_distance, CuboidFilter filter) {
  std::vector<Cuboid> cuboids;
  double last = 0.0;
  visitNearest(map, point, max_distance, filter, [&](const Cuboid& cuboid, double distance) {
    EXPECT_GE(distance, last);
    last = distance;
    cuboids.push_back(cuboid);
    return Visit::kContinue;
  });
  return test::sorted(std::move(cuboids));
}

/// Calls all functions that return cuboids.
void checkReaders(const CuboidMap& lazy, const CuboidMap& fused, Random& random) {
  const CellBox region = test::randomBox(random, {{-64, -64, -64}, {64, 64, 64}}, 40);
  const CuboidFilter filter = test::kFilters[random.index(3)];
  const std::vector<Cuboid> all = test::allCuboids(fused, filter);
  ASSERT_EQ(test::allCuboids(lazy, filter), all);
  ASSERT_EQ(test::cuboidsIn(lazy, region), test::cuboidsIn(fused, region));
  ASSERT_EQ(countCuboids(lazy).free, countCuboids(fused).free);
  ASSERT_EQ(countCuboids(lazy).occupied, countCuboids(fused).occupied);
  ASSERT_EQ(isAnyOccupied(lazy, region), isAnyOccupied(fused, region));
  CuboidSelection selection{filter, random.integer(1, 3), random.chance(0.5)};
  const std::vector<Cuboid> selected =
      test::sorted(selectCuboids(fused, region, selection, Budget::unlimited()).value);
  ASSERT_EQ(test::sorted(selectCuboids(lazy, region, selection, Budget::unlimited()).value),
            selected);
  selection.max_cuboids = random.index(selected.size() + 2);
  const auto some = selectCuboids(lazy, region, selection, Budget::unlimited());
  ASSERT_EQ(some.status == AnswerStatus::kBudgetSpent, selected.size() > selection.max_cuboids);
  ASSERT_EQ(some.value.size(), std::min(selected.size(), selection.max_cuboids));

  const Eigen::Vector3d point = test::randomPoint(random, 7.0);
  checkNearest(lazy, fused, point, filter, random.chance(0.5) ? kAnyDistance : 2.0);
  ASSERT_EQ(visitedNearest(lazy, 10.0 * point, kAnyDistance, filter), all);
  ASSERT_EQ(visitedNearest(lazy, 10.0 * point, 15.0, filter),
            visitedNearest(fused, 10.0 * point, 15.0, filter));
}

TEST_P(FusionOrder, makesNoDifferenceToAnyReader) {
  Random random(21);
  CuboidMap map(config_);
  CuboidMap lazy(lazy_config_);
  test::FollowingCopy copy;
  const CellBox bricks{{-8, -8, -8}, {8, 8, 8}};
  constexpr std::size_t kUpdates = 160;
  for (std::size_t i = 0; i < kUpdates; ++i) {
    // The sensor moves on.
    const auto at = static_cast<std::int32_t>(i / 20) - 4;
    const CellBox area{{2 * at, -2, -2}, {2 * at + 3, 2, 2}};
    const ScanUpdate update = test::randomUpdate(random, random.chance(0.8) ? area : bricks, 12);
    map.apply(update);
    copy.follow(lazy, lazy.apply(update));
    if (random.chance(0.1)) {
      const CellBox box = test::randomBox(random, {{-64, -64, -64}, {64, 64, 64}}, 20);
      const std::vector<UniformBox> boxes{{box, random.chance(0.5) ? 1.0F : -3.5F}};
      map.replace(box, boxes);
      copy.follow(lazy, lazy.replace(box, boxes));
    }
    ASSERT_EQ(lazy.revision(), map.revision()) << test::seedNote(i);
    if (random.chance(0.3)) {
      checkReaders(lazy, map, random);
      ASSERT_FALSE(HasFailure()) << test::seedNote(i);
    }
    if (i % 8 == 0) {
      ASSERT_EQ(copy.cuboids(), test::allCuboids(lazy)) << test::seedNote(i);
      ASSERT_EQ(checkMap(lazy), std::vector<std::string>{}) << test::seedNote(i);
    }
    if (i == 100) {
      map.clear();
      copy.follow(lazy, lazy.clear());
    }
  }
  EXPECT_EQ(test::allCuboids(lazy), test::allCuboids(map));
  EXPECT_EQ(checkMap(lazy), std::vector<std::string>{});
  EXPECT_EQ(checkMap(map), std::vector<std::string>{});
  EXPECT_GT(countCuboids(map).total(), 1000U);
}

std::string orderName(const testing::TestParamInfo<OrderParam>& info) {
  const auto& [fusion, environment, threads] = info.param;
  return toString(fusion) +
         std::string(environment == Environment::kStatic ? "Static" : "Dynamic") + "With" +
         std::to_string(threads);
}

INSTANTIATE_TEST_SUITE_P(
    AllConfigs, FusionOrder,
    testing::Combine(testing::Values(FusionKind::kClass, FusionKind::kGrowth, FusionKind::kNone),
                     testing::Values(Environment::kDynamic, Environment::kStatic),
                     testing::Values(1, 4)),
    orderName);

/// An update of one voxel in a brick.
ScanUpdate missIn(const Cell& brick) {
  ScanUpdate update;
  update.bricks.push_back({brick, {}, BrickMask::ofBox(CellBox::ofCell(brick))});
  return update;
}

TEST(StaleBricks, areInTheTreeAndAreDividedByTheirReaders) {
  MapConfig config;
  config.fuse = FusionTime::kWhenRead;
  CuboidMap map(config);
  const ChangeSet changes = map.apply(missIn({0, 0, 0}));
  ASSERT_EQ(changes.bricks.size(), 1U);
  EXPECT_TRUE(changes.bricks[0].has_new_cuboids);
  EXPECT_EQ(measureTree(map).leaf_nodes, 1U);
  EXPECT_EQ(map.bounds(), CellBox::ofCell({0, 0, 0}));
  EXPECT_EQ(test::allCuboids(map),
            (std::vector<Cuboid>{{CellBox::ofCell({0, 0, 0}), Occupancy::kFree}}));
  EXPECT_EQ(map.revision(), 1U) << "readers change nothing";
}

TEST(StaleBricks, areDividedByManyReadersAtOnce) {
  MapConfig config;
  config.fuse = FusionTime::kWhenRead;
  CuboidMap lazy(config);
  CuboidMap map;
  Random random(5);
  for (int i = 0; i < 20; ++i) {
    const ScanUpdate update = test::randomUpdate(random, {{-4, -4, -4}, {4, 4, 4}}, 60);
    lazy.apply(update);
    map.apply(update);
  }
  const std::vector<Cuboid> expected = test::allCuboids(map);
  std::vector<std::vector<Cuboid>> seen(4);
  std::vector<std::thread> readers;
  for (auto& cuboids : seen) {
    readers.emplace_back([&cuboids, &lazy] { cuboids = test::allCuboids(lazy); });
  }
  for (std::thread& reader : readers) reader.join();
  for (const auto& cuboids : seen) EXPECT_EQ(cuboids, expected);
}

TEST(StaleBricks, thatBecomeUnknownLeaveTheTree) {
  CuboidMap map;
  map.apply(missIn({0, 0, 0}));
  map.replace(kAllCells, std::vector<UniformBox>{});
  EXPECT_EQ(measureTree(map).height, 0);
  EXPECT_TRUE(test::allCuboids(map).empty());
  EXPECT_TRUE(
      findNearest(map, {0.0, 0.0, 0.0}, 1, CuboidFilter::kAll, Budget::unlimited()).isNotFound());
}

}  // namespace
}  // namespace cuboid_mapping
