// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/map_follower.h"

#include "support/modelled_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <limits>

namespace cuboid_mapping {
namespace {

using test::ModelledMap;
using test::Random;

constexpr std::uint64_t kInstance = 77;

/// A server: a map, its reference, and what it has told.
class Server {
 public:
  explicit Server(Random& random) : random_(random), model_(makeConfig()) {}

  /// Changes the map now and then by a cloud, an edit or a reset. @return What it tells.
  MapDelta step() {
    if (random_.chance(0.03)) {
      note(model_.map.clear());
      model_.voxels.clear();
    }
    const int num_changes = random_.integer(0, 3);
    for (int i = 0; i < num_changes; ++i) {
      random_.chance(0.7) ? applyCloud() : edit();
    }
    note(model_.map.flush());
    const MapDelta delta = makeDelta(model_.map, changes_, kInstance, told_);
    changes_ = {};
    told_ = model_.map.revision();
    return delta;
  }

  [[nodiscard]] MapImage image() const { return makeImage(model_.map, kInstance); }
  [[nodiscard]] const ModelledMap& model() const { return model_; }

 private:
  static MapConfig makeConfig() {
    MapConfig config;
    config.hot_bytes = 1000000;
    return config;
  }

  void note(const ChangeSet& changes) {
    changes_.is_everything = changes_.is_everything || changes.is_everything;
    changes_.boxes.insert(changes_.boxes.end(), changes.boxes.begin(), changes.boxes.end());
  }
  void applyCloud() {
    const ScanUpdate update = test::randomUpdate(random_, {{-4, -2, -2}, {4, 2, 2}}, 6);
    model_.voxels.apply(update);
    note(model_.map.apply(update));
  }
  void edit() {
    const CellBox box = test::randomBoxInside(random_, {{-150, -20, -20}, {150, 20, 20}});
    std::vector<Cuboid> cuboids;
    if (random_.chance(0.5)) cuboids.push_back({test::randomBoxInside(random_, box), -1.0F});
    model_.voxels.replace(box, cuboids);
    note(model_.map.replace(box, cuboids));
  }

  Random& random_;
  ModelledMap model_;
  ChangeSet changes_;
  std::uint64_t told_ = 0;
};

TEST(MapFollower, equalsTheMapAfterAnyStreamOfDeltas) {
  Random random(121);
  Server server(random);
  MapFollower follower;
  std::deque<MapDelta> under_way;
  std::size_t num_by_result[4] = {};
  std::size_t num_compared = 0;
  const auto deliver = [&](const MapDelta& delta) {
    const FollowResult result = follower.take(delta);
    ++num_by_result[static_cast<std::size_t>(result)];
    if (result == FollowResult::kGap) {
      ASSERT_TRUE(follower.take(server.image()));
    }
  };
  constexpr std::size_t kSteps = 600;
  for (std::size_t i = 0; i < kSteps; ++i) {
    const MapDelta delta = server.step();
    if (!random.chance(0.1)) under_way.push_back(delta);  // Else it is lost.
    if (random.chance(0.1)) under_way.push_back(delta);   // It comes twice.
    if (under_way.size() > 1 && random.chance(0.2)) std::swap(under_way.front(), under_way.back());
    if (random.chance(0.02)) follower = MapFollower();  // Starts anew.
    if (random.chance(0.02)) {
      ASSERT_TRUE(follower.take(server.image()));
    }
    while (!under_way.empty() && random.chance(0.7)) {
      deliver(under_way.front());
      under_way.pop_front();
    }
    if (follower.map() == nullptr || follower.revision() != server.model().map.revision()) continue;
    ASSERT_TRUE(hasVoxels(*follower.map(), server.model().voxels)) << test::seedNote(i);
    ASSERT_EQ(checkDisjoint(follower.map()->tree()), std::vector<std::string>{});
    ++num_compared;
  }
  EXPECT_GT(num_compared, kSteps / 10);
  EXPECT_GT(num_by_result[static_cast<std::size_t>(FollowResult::kApplied)], kSteps / 10);
  EXPECT_GT(num_by_result[static_cast<std::size_t>(FollowResult::kOld)], 20U);
  EXPECT_GT(num_by_result[static_cast<std::size_t>(FollowResult::kGap)], 20U);
  EXPECT_EQ(num_by_result[static_cast<std::size_t>(FollowResult::kDamaged)], 0U);
}

TEST(MapFollower, knowsNothingBeforeTheFirstImage) {
  MapFollower follower;
  EXPECT_EQ(follower.map(), nullptr);
  MapDelta delta;
  delta.revision = 1;
  EXPECT_EQ(follower.take(delta), FollowResult::kGap);
}

/// A follower at revision 1 of a map of one cuboid, and a delta from there.
struct Fixture {
  Fixture() {
    CuboidMap map;
    map.replace(kAllCells, {{{{0, 0, 0}, {300, 8, 8}}, -1.0F}});
    EXPECT_TRUE(follower.take(makeImage(map, kInstance)));
    delta = makeDelta(map, map.replace({{8, 0, 0}, {16, 8, 8}}, {{{{8, 0, 0}, {9, 1, 1}}, 1.0F}}),
                      kInstance, 1);
  }
  MapFollower follower;
  MapDelta delta;
};

TEST(MapFollower, takesADeltaOnce) {
  Fixture it;
  EXPECT_EQ(it.delta.revision, 2U);
  EXPECT_GT(it.delta.counts.size(), 3U) << "the cuboid that was cut is longer than 255 voxels";
  EXPECT_EQ(it.follower.take(it.delta), FollowResult::kApplied);
  EXPECT_EQ(it.follower.revision(), 2U);
  EXPECT_EQ(it.follower.map()->content().free_voxels, 292 * 64.0);
  EXPECT_EQ(it.follower.map()->content().occupied_voxels, 1.0);
  EXPECT_EQ(it.follower.take(it.delta), FollowResult::kOld);
}

TEST(MapFollower, asksForAnImageOfAnotherInstanceOrAfterAGap) {
  Fixture it;
  it.delta.instance = 5;
  EXPECT_EQ(it.follower.take(it.delta), FollowResult::kGap);
  it.delta.instance = kInstance;
  it.delta.base = 2;
  it.delta.revision = 3;
  EXPECT_EQ(it.follower.take(it.delta), FollowResult::kGap);
  it.delta.base = 1;
  it.delta.is_everything = true;
  EXPECT_EQ(it.follower.take(it.delta), FollowResult::kGap);
}

TEST(MapFollower, refusesDamagedArrays) {
  const auto damaged = [](auto damage) {
    Fixture it;
    damage(it.delta);
    const bool is_refused = it.follower.take(it.delta) == FollowResult::kDamaged;
    return is_refused && it.follower.map()->content().free_voxels == 300 * 64.0;
  };
  EXPECT_TRUE(damaged([](MapDelta& d) { d.boxes.pop_back(); }));
  EXPECT_TRUE(damaged([](MapDelta& d) { d.offsets.pop_back(); }));
  EXPECT_TRUE(damaged([](MapDelta& d) { d.log_odds.pop_back(); }));
  EXPECT_TRUE(damaged([](MapDelta& d) { ++d.counts[0]; }));
  EXPECT_TRUE(damaged([](MapDelta& d) { d.counts[0] = 0; }));
  EXPECT_TRUE(damaged([](MapDelta& d) { d.counts[0] = 0xFFFFFFFF; }));
  EXPECT_TRUE(damaged([](MapDelta& d) { d.offsets[3] = d.offsets[0]; }));
  EXPECT_TRUE(damaged([](MapDelta& d) { d.offsets[3] = 255; }));
  EXPECT_TRUE(damaged([](MapDelta& d) { d.boxes[3] = d.boxes[0]; }));
  EXPECT_TRUE(damaged([](MapDelta& d) { d.boxes[3] = std::numeric_limits<int>::max(); }));
  EXPECT_TRUE(damaged([](MapDelta& d) { d.log_odds[0] = std::nanf(""); }));
  EXPECT_TRUE(damaged([](MapDelta& d) { d.resolution_m = 0.2; }));
  MapFollower follower;
  MapImage image;
  EXPECT_FALSE(follower.take(image)) << "no resolution";
  image.resolution_m = 0.1;
  image.bounds = {0, 0, 0, 1, 1, 0};
  image.log_odds = {1.0F};
  EXPECT_FALSE(follower.take(image)) << "an empty box";
  image.bounds = {0, 0, 0, 1, 1};
  EXPECT_FALSE(follower.take(image));
  EXPECT_EQ(follower.map(), nullptr);
}

}  // namespace
}  // namespace cuboid_mapping
