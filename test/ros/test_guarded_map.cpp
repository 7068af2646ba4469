// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/guarded_map.h"

#include "cuboid_mapping/query/box_query.h"
#include "support/following_copy.h"
#include "support/random_bricks.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::Cell;
using cuboid_mapping::CellBox;
using cuboid_mapping::ChangeSet;
using cuboid_mapping::Cuboid;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::ScanUpdate;
namespace test = cuboid_mapping::test;

cuboid_mapping::MapConfig makeConfig() {
  cuboid_mapping::MapConfig config;
  config.hot_bytes = 1000000;
  config.threads = 2;
  return config;
}

/// The same observations in bricks of two groups: no reader may see a map in which they differ.
constexpr std::int32_t kTwinOffset = 3 * cuboid_mapping::kGroupEdge;

ScanUpdate makeTwins(test::Random& random) {
  ScanUpdate update = test::randomUpdate(random, {{0, 0, 0}, {4, 4, 4}}, 20);
  const std::size_t count = update.bricks.size();
  for (std::size_t i = 0; i < count; ++i) {
    cuboid_mapping::BrickUpdate twin = update.bricks[i];
    twin.brick.x += kTwinOffset;
    twin.morton = test::mortonOf(twin.brick);
    update.bricks.push_back(twin);
  }
  return update;
}

/// Cuboids of the first group, and those of its twin moved there.
std::vector<Cuboid> cuboidsOfGroup(const CuboidMap& map, std::int32_t offset) {
  const CellBox group{{offset, 0, 0}, {offset + 32, 32, 32}};
  std::vector<Cuboid> cuboids =
      queryBox(map, group, cuboid_mapping::CuboidOutput::kClipped).cuboids;
  for (Cuboid& cuboid : cuboids) {
    cuboid.box.min.x -= offset;
    cuboid.box.max.x -= offset;
  }
  return test::sorted(std::move(cuboids));
}

TEST(GuardedMap, ShowsReadersOneRevisionWhileCloudsComeIn) {
  GuardedMap map(makeConfig());
  constexpr int kClouds = 300;
  std::atomic<bool> is_done{false};
  std::atomic<int> num_reads{0};
  std::atomic<int> num_torn{0};
  const CellBox both{{0, 0, 0}, {kTwinOffset + 32, 32, 32}};
  std::vector<std::thread> readers;
  for (int i = 0; i < 2; ++i) {
    readers.emplace_back([&] {
      std::uint64_t last_revision = 0;
      ros::Time last_stamp;
      while (!is_done) {
        map.readCurrent(both, [&](const CuboidMap& content, const ros::Time& stamp) {
          const bool is_torn = cuboidsOfGroup(content, 0) != cuboidsOfGroup(content, kTwinOffset) ||
                               content.revision() < last_revision || stamp < last_stamp;
          num_torn += is_torn ? 1 : 0;
          last_revision = content.revision();
          last_stamp = stamp;
        });
        ++num_reads;
      }
    });
  }
  test::FollowingCopy copy;
  test::Random random(41);
  int num_changes = 0;
  for (int cloud = 0; cloud < kClouds || num_reads < 20; ++cloud) {
    const ScanUpdate update = makeTwins(random);
    map.change(ros::Time(cloud + 1.0), [&](CuboidMap& content) { return content.apply(update); });
    ++num_changes;
  }
  is_done = true;
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(num_torn, 0);
  EXPECT_GE(num_changes, kClouds);

  map.flush();
  const ChangeSet changes = map.takeChanges();
  map.read([&](const CuboidMap& content, const ros::Time& /*stamp*/) {
    EXPECT_TRUE(content.isFlushed(cuboid_mapping::kAllCells));
    copy.follow(content, changes);
    EXPECT_EQ(copy.cuboids(), test::allCuboids(content.tree()));
  });
  EXPECT_TRUE(map.takeChanges().boxes.empty());
}

TEST(GuardedMap, TellsThatEverythingHasChangedAfterClear) {
  GuardedMap map(makeConfig());
  test::Random random(42);
  const auto apply = [&] {
    map.change(ros::Time(1.0),
               [&](CuboidMap& content) { return content.apply(makeTwins(random)); });
  };
  apply();
  map.change(ros::Time(), [](CuboidMap& content) { return content.clear(); });
  apply();
  map.flush();
  EXPECT_TRUE(map.takeChanges().is_everything);
  apply();
  map.flush();
  const ChangeSet changes = map.takeChanges();
  EXPECT_FALSE(changes.is_everything);
  EXPECT_FALSE(changes.boxes.empty());
}

}  // namespace
}  // namespace cuboid_mapping_ros
