// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/map/guarded_map.h"

#include "cuboid_mapping/query/cuboid_query.h"
#include "support/following_copy.h"
#include "support/random_bricks.h"
#include "support/snapshots.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <new>
#include <optional>
#include <stdexcept>
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
using cuboid_mapping::test::allCuboids;
using cuboid_mapping::test::FollowingCopy;
using cuboid_mapping::test::Random;
using cuboid_mapping::test::randomUpdate;
using cuboid_mapping::test::voxelsOf;

cuboid_mapping::MapConfig makeConfig() {
  cuboid_mapping::MapConfig config;
  config.threads = 2;
  return config;
}

/// Offset of equal observations in bricks of two groups: no reader may see a map in which they differ.
constexpr std::int32_t kTwinOffset = 3 * cuboid_mapping::kGroupEdge;

ScanUpdate makeTwins(Random& random) {
  ScanUpdate update = randomUpdate(random, {{0, 0, 0}, {4, 4, 4}}, 20);
  const std::size_t count = update.bricks.size();
  for (std::size_t i = 0; i < count; ++i) {
    cuboid_mapping::BrickUpdate twin = update.bricks[i];
    twin.brick.x += kTwinOffset;
    update.bricks.push_back(twin);
  }
  return update;
}

/// Cuboids of the first group, and those of its twin moved to its place.
std::vector<Cuboid> cuboidsOfGroup(const CuboidMap& map, std::int32_t offset) {
  const CellBox group{{offset, 0, 0}, {offset + 32, 32, 32}};
  cuboid_mapping::CuboidSelection clipped;
  clipped.is_clipped = true;
  std::vector<Cuboid> cuboids =
      selectCuboids(map, group, clipped, cuboid_mapping::Budget::unlimited()).value;
  for (Cuboid& cuboid : cuboids) {
    cuboid.box.min.x -= offset;
    cuboid.box.max.x -= offset;
  }
  return cuboid_mapping::test::sorted(std::move(cuboids));
}

TEST(GuardedMap, ShowsReadersOneRevisionWhileCloudsComeIn) {
  GuardedMap map(makeConfig());
  constexpr int kClouds = 300;
  std::atomic<bool> is_done{false};
  std::atomic<int> num_reads{0};
  std::atomic<int> num_torn{0};
  std::vector<std::thread> readers;
  for (int i = 0; i < 2; ++i) {
    readers.emplace_back([&] {
      std::uint64_t last_revision = 0;
      ros::Time last_stamp;
      while (!is_done) {
        map.read([&](const CuboidMap& content, const ros::Time& stamp) {
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
  FollowingCopy copy;
  Random random(41);
  int num_changes = 0;
  for (int cloud = 0; cloud < kClouds || num_reads < 20; ++cloud) {
    const ScanUpdate update = makeTwins(random);
    map.integrate(ros::Time(cloud + 1.0), update, cuboid_mapping::SensorModel(), {});
    ++num_changes;
  }
  is_done = true;
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(num_torn, 0);
  EXPECT_GE(num_changes, kClouds);

  const ChangeSet changes = map.takeChanges();
  map.read([&](const CuboidMap& content, const ros::Time& /*stamp*/) {
    copy.follow(content, changes);
    EXPECT_EQ(copy.cuboids(), allCuboids(content));
  });
  EXPECT_TRUE(map.takeChanges().bricks.empty());
}

TEST(GuardedMap, LosesNoEditWhileACloudIsWorkedOut) {
  constexpr std::int32_t kFar = 100000;
  constexpr std::int32_t kEdits = 300;
  GuardedMap map(makeConfig());
  CuboidMap expected(makeConfig());
  const auto edit = [](CuboidMap& content, std::int32_t i) {
    const CellBox box{{kFar, 0, 8 * i}, {kFar + 8, 8, 8 * i + 5}};
    return content.replace(box, {cuboid_mapping::UniformBox{box, 1.0F}});
  };
  std::atomic<bool> is_done{false};
  std::thread editor([&] {
    for (std::int32_t i = 0; i < kEdits; ++i) {
      map.edit([&](CuboidMap& content, const ros::Time&) { return edit(content, i); });
    }
    is_done = true;
  });
  Random random(44);
  while (!is_done) {
    const ScanUpdate update = randomUpdate(random, {{-9, -9, -9}, {9, 9, 9}}, 100);
    map.integrate(ros::Time(1.0), update, cuboid_mapping::SensorModel(), {});
    (void)expected.apply(update);
  }
  editor.join();
  for (std::int32_t i = 0; i < kEdits; ++i) (void)edit(expected, i);
  map.read([&](const CuboidMap& content, const ros::Time&) {
    EXPECT_EQ(voxelsOf(content), voxelsOf(expected));
  });
}

TEST(GuardedMap, WhoWaitsToChangeItComesBeforeWhoHasJustDone) {
  GuardedMap map(makeConfig());
  constexpr int kRounds = 20;
  int num_next = 0;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<char> order;
    std::atomic<bool> is_waiting{false};
    std::thread other;
    const auto edit = [&](char who, const std::function<void()>& work) {
      map.edit([&](const CuboidMap& content, const ros::Time&) {
        order.push_back(who);
        work();
        return cuboid_mapping::ChangeSet{content.revision(), false, {}};
      });
    };
    edit('a', [&] {
      other = std::thread([&] {
        is_waiting = true;
        edit('b', [] {});
      });
      while (!is_waiting) std::this_thread::yield();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    });
    for (int i = 0; i < 10; ++i) edit('a', [] {});
    other.join();
    num_next += order[1] == 'b' ? 1 : 0;
  }
  EXPECT_GT(num_next, kRounds / 2) << "a busy machine may start 'b' late";
}

TEST(GuardedMap, TellsEachBrickOnceAndWhetherItHasNewCuboids) {
  GuardedMap map(makeConfig());
  const CellBox brick{{0, 0, 0}, {8, 8, 8}};
  const auto fill = [&](float log_odds) {
    map.change(ros::Time(1.0), [&](CuboidMap& content) {
      return content.replace(brick, {cuboid_mapping::UniformBox{brick, log_odds}});
    });
  };
  fill(-1.0F);
  fill(-2.0F);
  ChangeSet changes = map.takeChanges();
  ASSERT_EQ(changes.bricks.size(), 1U);
  EXPECT_EQ(changes.bricks[0].brick, brick.min);
  EXPECT_TRUE(changes.bricks[0].has_new_cuboids);
  ScanUpdate miss;
  miss.bricks.emplace_back();
  miss.bricks[0].misses = cuboid_mapping::BrickMask::all();
  fill(-0.5F);
  (void)map.takeChanges();
  map.change(ros::Time(2.0), [&](CuboidMap& content) { return content.apply(miss); });
  changes = map.takeChanges();
  ASSERT_EQ(changes.bricks.size(), 1U);
  EXPECT_FALSE(changes.bricks[0].has_new_cuboids) << "log-odds alone have changed";
}

TEST(GuardedMap, TellsThatEverythingHasChangedAfterAFailure) {
  GuardedMap map(makeConfig());
  const CellBox brick{{0, 0, 0}, {8, 8, 8}};
  const auto fill = [&](CuboidMap& content) {
    return content.replace(brick, {cuboid_mapping::UniformBox{brick, 1.0F}});
  };
  const auto fail = [&](CuboidMap& content) -> ChangeSet {
    (void)fill(content);
    throw std::bad_alloc();
  };
  EXPECT_THROW(map.change(ros::Time(1.0), fail), std::bad_alloc);
  EXPECT_TRUE(map.takeChanges().is_everything);
  map.read([](const CuboidMap& /*content*/, const ros::Time& stamp) {
    EXPECT_EQ(stamp, ros::Time()) << "the cloud did not get in";
  });
  EXPECT_THROW(map.edit([&](CuboidMap& content, const ros::Time&) { return fail(content); }),
               std::bad_alloc);
  EXPECT_TRUE(map.takeChanges().is_everything);
}

TEST(GuardedMap, KeepsTheEditsThatCanBeUndoneIfItIsNotReplaced) {
  GuardedMap map(makeConfig());
  const CellBox brick{{0, 0, 0}, {8, 8, 8}};
  {
    const auto turn = map.beginEdit();
    map.editIn(brick, [&](CuboidMap& content) {
      map.keepForUndo(brick);
      return content.replace(brick, {cuboid_mapping::UniformBox{brick, 1.0F}});
    });
  }
  const auto refuse = [](CuboidMap& /*content*/) -> ChangeSet {
    throw std::runtime_error("the map was changed meanwhile");
  };
  EXPECT_THROW(map.replaceAll(refuse), std::runtime_error);
  EXPECT_EQ(map.numReplaced(), 0U);
  EXPECT_EQ(map.undoEdit(), std::optional<std::size_t>(0));
  EXPECT_EQ(map.read([](const CuboidMap& content) { return content.voxels().size(); }), 0U);
  map.replaceAll([](CuboidMap& content) { return content.clear(); });
  EXPECT_EQ(map.numReplaced(), 1U);
}

TEST(GuardedMap, KeepsChangesThatCouldNotBePassedOn) {
  GuardedMap map(makeConfig());
  const CellBox brick{{0, 0, 0}, {8, 8, 8}};
  map.change(ros::Time(1.0), [&](CuboidMap& content) {
    return content.replace(brick, {cuboid_mapping::UniformBox{brick, 1.0F}});
  });
  const auto fail = [](const CuboidMap&, const ros::Time&, const ChangeSet& changes) {
    EXPECT_EQ(changes.bricks.size(), 1U);
    throw std::bad_alloc();
  };
  EXPECT_THROW((void)map.takeChanges(fail), std::bad_alloc);
  const auto take = [](const CuboidMap&, const ros::Time&, const ChangeSet&) {};
  EXPECT_TRUE(map.takeChanges(take).is_everything);
  EXPECT_FALSE(map.takeChanges(take).is_everything);
}

TEST(GuardedMap, RemembersNoEndlessListOfBricksThatAreGone) {
  GuardedMap map(makeConfig());
  for (std::int32_t i = 0; i < 30; ++i) {  // 30 times 4096 bricks, set and forgotten.
    const CellBox box{{0, 0, 128 * i}, {128, 128, 128 * (i + 1)}};
    map.change(ros::Time(1.0), [&](CuboidMap& content) {
      return content.replace(box, {cuboid_mapping::UniformBox{box, 1.0F}});
    });
    map.change(ros::Time(1.0), [&](CuboidMap& content) {
      return content.replace(box, std::vector<cuboid_mapping::UniformBox>{});
    });
  }
  const ChangeSet changes = map.takeChanges();
  EXPECT_TRUE(changes.is_everything);
  EXPECT_TRUE(changes.bricks.empty());
}

TEST(GuardedMap, TellsThatEverythingHasChangedAfterClear) {
  GuardedMap map(makeConfig());
  Random random(42);
  const auto apply = [&] {
    map.change(ros::Time(1.0),
               [&](CuboidMap& content) { return content.apply(makeTwins(random)); });
  };
  apply();
  map.change(ros::Time(), [](CuboidMap& content) { return content.clear(); });
  apply();
  EXPECT_TRUE(map.takeChanges().is_everything);
  apply();
  const ChangeSet changes = map.takeChanges();
  EXPECT_FALSE(changes.is_everything);
  EXPECT_FALSE(changes.bricks.empty());
}

}  // namespace
}  // namespace cuboid_mapping_ros
