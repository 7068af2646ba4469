// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/sharing/shared_map_follower.h"

#include "cuboid_mapping/map/cuboid_search.h"
#include "support/snapshots.h"

#include <gtest/gtest.h>

#include <atomic>
#include <deque>
#include <future>
#include <set>
#include <utility>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::Random;
using Version = SharedMapFollower::Version;

constexpr std::uint64_t kSharedInstance = 78;

/// A server whose map always has this many occupied voxels in all, so that a torn version shows.
class SlidingServer {
 public:
  SlidingServer() { map_.replace({{0, 0, 0}, {40, 9, 9}}, {{{{0, 0, 0}, {5, 9, 9}}, 1.0F}}); }

  [[nodiscard]] MapImage image() const {
    return makeImage(map_, kSharedInstance, MapDetail::kValues);
  }
  MapDelta step() {
    const std::uint64_t base = map_.revision();
    offset_ = (offset_ + 1) % 36;
    const ChangeSet changes =
        map_.replace({{0, 0, 0}, {40, 9, 9}}, {{{{offset_, 0, 0}, {offset_ + 5, 9, 9}}, 1.0F}});
    MapDelta delta = makeDelta(map_, changes, kSharedInstance, base, MapDetail::kValues);
    delta.label.stamp_ns = static_cast<std::int64_t>(map_.revision());
    return delta;
  }
  [[nodiscard]] const CuboidMap& map() const { return map_; }

 private:
  CuboidMap map_;
  int offset_ = 0;
};

auto allVoxels(const CuboidMap& map) { return test::voxelsOf(map.voxels().copyIn(kAllCells)); }
using Voxels = decltype(allVoxels(std::declval<const CuboidMap&>()));

TEST(SharedMapFollower, HeldVersionsStayWhileItFollows) {
  Random random(151);
  for (int run = 0; run < 20; ++run) {
    CuboidMap map;
    map.apply(test::randomUpdate(random, {{-4, -2, -2}, {4, 2, 2}}, 6));
    SharedMapFollower follower;
    ASSERT_TRUE(follower.take(makeImage(map, kSharedInstance, MapDetail::kValues)));
    std::deque<std::pair<Version, Voxels>> held;
    for (int i = 0; i < 60; ++i) {
      const std::uint64_t base = map.revision();
      const ChangeSet changes = map.apply(test::randomUpdate(random, {{-4, -2, -2}, {4, 2, 2}}, 6));
      const auto result =
          follower.take(makeDelta(map, changes, kSharedInstance, base, MapDetail::kValues));
      ASSERT_EQ(result, FollowResult::kApplied);
      const Version now = follower.read();
      ASSERT_EQ(now->revision(), map.revision()) << test::seedNote(i);
      const auto voxels = allVoxels(map);
      ASSERT_EQ(allVoxels(*now->map()), voxels) << test::seedNote(i);
      if (random.chance(0.5)) held.emplace_back(now, voxels);
      while (held.size() > 3 || (!held.empty() && random.chance(0.3))) held.pop_front();
      for (const auto& [version, known] : held) {
        ASSERT_EQ(allVoxels(*version->map()), known) << test::seedNote(i);
      }
    }
  }
}

TEST(SharedMapFollower, NeedsTwoMapsForAReaderThatAlwaysReadsTheNewest) {
  SlidingServer server;
  SharedMapFollower follower;
  ASSERT_TRUE(follower.take(server.image()));
  std::set<const MapFollower*> maps;
  Version reading = follower.read();
  for (int i = 0; i < 50; ++i) {
    ASSERT_EQ(follower.take(server.step()), FollowResult::kApplied);
    reading = follower.read();
    maps.insert(reading.get());
    ASSERT_EQ(reading->label().stamp_ns, static_cast<std::int64_t>(server.map().revision()));
  }
  EXPECT_EQ(maps.size(), 2U);
}

TEST(SharedMapFollower, AnswersAsAFollowerDoes) {
  SlidingServer server;
  SharedMapFollower follower;
  EXPECT_EQ(follower.read()->map(), nullptr);
  EXPECT_EQ(follower.take(server.step()), FollowResult::kGap);
  EXPECT_FALSE(follower.take(MapImage{}));
  const MapImage first = server.image();
  const MapDelta second = server.step();
  const MapDelta third = server.step();
  ASSERT_TRUE(follower.take(first));
  const Version held = follower.read();
  EXPECT_EQ(follower.take(third), FollowResult::kGap);
  EXPECT_EQ(follower.take(second), FollowResult::kApplied);
  EXPECT_EQ(follower.take(second), FollowResult::kOld);
  EXPECT_EQ(follower.take(third), FollowResult::kApplied);
  EXPECT_TRUE(follower.take(first)) << "it is older, and ignored";
  EXPECT_EQ(follower.read()->revision(), third.revision);
  EXPECT_EQ(held->revision(), first.revision);
}

TEST(SharedMapFollower, ThreadsReadWholeRevisionsInOrder) {
  SlidingServer server;
  SharedMapFollower follower;
  ASSERT_TRUE(follower.take(server.image()));
  std::atomic<bool> is_over{false};
  std::vector<std::future<void>> readers;
  for (int i = 0; i < 3; ++i) {
    readers.push_back(std::async(std::launch::async, [&] {
      std::uint64_t last = 0;
      std::deque<Version> held;
      do {  // A reader may get its first turn when all is over.
        held.push_back(follower.read());
        const std::uint64_t revision = held.back()->revision();
        EXPECT_GE(revision, last);
        last = revision;
        if (held.size() > 3) held.pop_front();
        for (const Version& version : held) {
          EXPECT_EQ(version->map()->voxels().numOccupiedVoxels(), 5 * 81.0);
          EXPECT_GT(countCuboids(*version->map()).total(), 0U);  // Divides stale bricks.
        }
      } while (!is_over);
    }));
  }
  for (int i = 0; i < 300; ++i) ASSERT_EQ(follower.take(server.step()), FollowResult::kApplied);
  is_over = true;
  for (auto& reader : readers) reader.get();
  EXPECT_EQ(follower.read()->revision(), server.map().revision());
}

}  // namespace
}  // namespace cuboid_mapping
