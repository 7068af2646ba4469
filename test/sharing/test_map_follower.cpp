// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/sharing/map_follower.h"

#include "cuboid_mapping/query/sphere_query.h"
#include "support/modelled_map.h"

#include <gtest/gtest.h>

#include <deque>
#include <limits>
#include <tuple>

namespace cuboid_mapping {
namespace {

using test::ModelledMap;
using test::Random;

constexpr std::uint64_t kInstance = 77;

/// A server: a map, its reference, and its changes.
class Server {
 public:
  Server(Random& random, MapDetail detail, FusionKind fusion)
      : random_(random), detail_(detail), model_(makeConfig(fusion)) {}

  /// Changes the map by a cloud, an edit or a reset. @return The delta.
  MapDelta step() {
    if (random_.chance(0.03)) {
      note(model_.map.clear());
      model_.voxels.clear();
    }
    const int num_changes = random_.integer(0, 3);
    for (int i = 0; i < num_changes; ++i) {
      random_.chance(0.7) ? applyCloud() : edit();
    }
    const MapDelta delta = makeDelta(model_.map, changes_, kInstance, told_, detail_);
    changes_ = {};
    told_ = model_.map.revision();
    return delta;
  }

  [[nodiscard]] MapImage image() const { return makeImage(model_.map, kInstance, detail_); }
  [[nodiscard]] const ModelledMap& model() const { return model_; }

 private:
  static MapConfig makeConfig(FusionKind fusion) {
    MapConfig config;
    config.fusion = fusion;
    return config;
  }

  void note(const ChangeSet& changes) {
    changes_.is_everything = changes_.is_everything || changes.is_everything;
    changes_.bricks.insert(changes_.bricks.end(), changes.bricks.begin(), changes.bricks.end());
  }
  void applyCloud() {
    const ScanUpdate update = test::randomUpdate(random_, {{-4, -2, -2}, {4, 2, 2}}, 6);
    model_.voxels.apply(update);
    note(model_.map.apply(update));
  }
  void edit() {
    const CellBox box = test::randomBoxInside(random_, {{-150, -20, -20}, {150, 20, 20}});
    std::vector<UniformBox> boxes;
    if (random_.chance(0.5)) boxes.push_back({test::randomBoxInside(random_, box), -1.0F});
    model_.voxels.replace(box, boxes);
    note(model_.map.replace(box, boxes));
  }

  Random& random_;
  MapDetail detail_;
  ModelledMap model_;
  ChangeSet changes_;
  std::uint64_t told_ = 0;
};

/// Expected content of a copy without log-odds.
test::VoxelMap classesOf(const test::VoxelMap& voxels) {
  const SensorModel model;
  test::VoxelMap classes(model);
  for (const auto& [cell, log_odds] : voxels.voxels()) {
    classes.set(cell, log_odds >= 0.0F ? model.max() : model.min());
  }
  return classes;
}

using StreamParam = std::tuple<MapDetail, FusionKind>;
class MapFollowerStream : public testing::TestWithParam<StreamParam> {};

TEST_P(MapFollowerStream, equalsTheMapAfterAnyDeltas) {
  Random random(121);
  const auto& [detail, fusion] = GetParam();
  Server server(random, detail, fusion);
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
    if (!random.chance(0.1)) under_way.push_back(delta);  // Otherwise it is lost.
    if (random.chance(0.1)) under_way.push_back(delta);   // It comes twice.
    if (under_way.size() > 1 && random.chance(0.2)) std::swap(under_way.front(), under_way.back());
    if (random.chance(0.02)) follower = MapFollower();  // It starts again.
    if (random.chance(0.02)) {
      ASSERT_TRUE(follower.take(server.image()));
    }
    while (!under_way.empty() && random.chance(0.7)) {
      deliver(under_way.front());
      under_way.pop_front();
    }
    if (follower.map() == nullptr || follower.revision() != server.model().map.revision()) continue;
    const test::VoxelMap& voxels = server.model().voxels;
    ASSERT_TRUE(
        hasVoxels(*follower.map(), detail == MapDetail::kValues ? voxels : classesOf(voxels)))
        << test::seedNote(i);
    ASSERT_EQ(checkMap(*follower.map()), std::vector<std::string>{}) << test::seedNote(i);
    ++num_compared;
  }
  EXPECT_GT(num_compared, kSteps / 10);
  EXPECT_GT(num_by_result[static_cast<std::size_t>(FollowResult::kApplied)], kSteps / 10);
  EXPECT_GT(num_by_result[static_cast<std::size_t>(FollowResult::kOld)], 20U);
  EXPECT_GT(num_by_result[static_cast<std::size_t>(FollowResult::kGap)], 20U);
  EXPECT_EQ(num_by_result[static_cast<std::size_t>(FollowResult::kDamaged)], 0U);
}

INSTANTIATE_TEST_SUITE_P(AllDetails, MapFollowerStream,
                         testing::Combine(testing::Values(MapDetail::kClasses, MapDetail::kValues),
                                          testing::Values(FusionKind::kClass, FusionKind::kGrowth,
                                                          FusionKind::kNone)));

TEST(MapFollower, hasTheCuboidsOfAMapThatIsFusedByClass) {
  Random random(122);
  const ModelledMap model = test::randomMap(random, MapConfig{});
  for (const MapDetail detail : {MapDetail::kClasses, MapDetail::kValues}) {
    MapFollower follower;
    ASSERT_TRUE(follower.take(makeImage(model.map, kInstance, detail)));
    EXPECT_EQ(test::allCuboids(*follower.map()), test::allCuboids(model.map));
  }
}

TEST(MapFollower, isToldOfChangedClassesOnlyWhenNoValuesTravel) {
  CuboidMap map;
  const CellBox box{{0, 0, 0}, {8, 8, 8}};
  map.replace(box, {UniformBox{box, -1.0F}});
  const ChangeSet changes = map.replace(box, {UniformBox{box, -2.0F}});
  EXPECT_TRUE(makeDelta(map, changes, kInstance, 1, MapDetail::kClasses).bricks.empty());
  const MapDelta delta = makeDelta(map, changes, kInstance, 1, MapDetail::kValues);
  ASSERT_EQ(delta.bricks.size(), 1U);
  EXPECT_EQ(delta.bricks[0].voxels, PackedVoxels(BrickMask::all(), -2.0F));
}

TEST(MapFollower, knowsNothingBeforeTheFirstImage) {
  MapFollower follower;
  EXPECT_EQ(follower.map(), nullptr);
  MapDelta delta;
  delta.revision = 1;
  EXPECT_EQ(follower.take(delta), FollowResult::kGap);
}

/// A follower at revision 1 of a map of one box, and a delta from there.
struct Fixture {
  explicit Fixture(MapDetail detail = MapDetail::kValues) {
    CuboidMap map;
    map.replace(kAllCells, {UniformBox{{{0, 0, 0}, {300, 8, 8}}, -1.0F}});
    EXPECT_TRUE(follower.take(makeImage(map, kInstance, detail)));
    const ChangeSet changes = map.replace(
        {{8, 0, 0}, {16, 8, 8}},
        {UniformBox{{{8, 0, 0}, {9, 1, 1}}, 1.0F}, UniformBox{{{9, 0, 0}, {10, 1, 1}}, -1.0F}});
    delta = makeDelta(map, changes, kInstance, 1, detail);
  }
  MapFollower follower;
  MapDelta delta;
};

TEST(MapFollower, takesADeltaOnce) {
  Fixture it;
  EXPECT_EQ(it.delta.revision, 2U);
  EXPECT_EQ(it.delta.bricks.size(), 1U);
  EXPECT_EQ(it.follower.take(it.delta), FollowResult::kApplied);
  EXPECT_EQ(it.follower.revision(), 2U);
  EXPECT_EQ(it.follower.map()->voxels().numFreeVoxels(), 292 * 64.0 + 1.0);
  EXPECT_EQ(it.follower.map()->voxels().numOccupiedVoxels(), 1.0);
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

TEST(MapFollower, takesNoOlderImageExceptOfAnotherInstance) {
  Fixture it;
  ASSERT_EQ(it.follower.take(it.delta), FollowResult::kApplied);
  CuboidMap other;
  other.replace(kAllCells, {UniformBox{{{0, 0, 0}, {1, 1, 1}}, 1.0F}});
  MapImage image = makeImage(other, kInstance, MapDetail::kValues);
  ASSERT_LT(image.revision, it.follower.revision());
  EXPECT_TRUE(it.follower.take(image));
  EXPECT_EQ(it.follower.revision(), 2U) << "the copy is newer";
  EXPECT_GT(it.follower.map()->voxels().numFreeVoxels(), 0.0);
  image.instance = 5;
  EXPECT_TRUE(it.follower.take(image));
  EXPECT_EQ(it.follower.instance(), 5U) << "the server was started anew";
  EXPECT_EQ(it.follower.revision(), 1U);
  EXPECT_EQ(it.follower.map()->voxels().numFreeVoxels(), 0.0);
}

/// Whether a damaged delta is refused, and the copy is unchanged.
template <typename DamageT>
bool isRefused(MapDetail detail, DamageT damage) {
  Fixture it(detail);
  damage(it.delta);
  const bool is_refused = it.follower.take(it.delta) == FollowResult::kDamaged;
  return is_refused && it.follower.map()->voxels().numFreeVoxels() == 300 * 64.0;
}

TEST(MapFollower, hasAnotherRevisionOfItsCopyAfterEachImage) {
  const Sphere ball{{0.1, 0.1, 0.1}, 0.05};
  CuboidMap map;
  MapFollower follower;
  ASSERT_TRUE(follower.take(makeImage(map, 1, MapDetail::kValues)));
  SphereChecker checker(*follower.map(), UnknownPolicy::kFree, Budget::unlimited());
  EXPECT_EQ(checker.check({ball}).front(), AnswerStatus::kNotFound);
  const CellBox box{{0, 0, 0}, {4, 4, 4}};
  for (const float log_odds : {1.0F, -1.0F, 1.0F}) {
    map.clear();
    map.replace(box, {{box, log_odds}});
    const std::uint64_t before = follower.map()->revision();
    ASSERT_TRUE(follower.take(makeImage(map, 1, MapDetail::kValues)));
    EXPECT_NE(follower.map()->revision(), before);
    EXPECT_EQ(checker.check({ball}).front(),
              log_odds > 0.0F ? AnswerStatus::kFound : AnswerStatus::kNotFound);
  }
}

TEST(MapFollower, refusesBricksThatCannotBe) {
  for (const MapDetail detail : {MapDetail::kClasses, MapDetail::kValues}) {
    const auto damaged = [detail](auto damage) { return isRefused(detail, damage); };
    EXPECT_TRUE(damaged([](MapDelta& d) { ++d.bricks[0].brick.x; })) << "no brick";
    for (const int x : {std::numeric_limits<int>::max(), std::numeric_limits<int>::min(),
                        std::numeric_limits<int>::max() - 7}) {
      EXPECT_TRUE(damaged([x](MapDelta& d) { d.bricks[0].brick.x = x; })) << x;
    }
    EXPECT_TRUE(damaged([](MapDelta& d) {
      d.bricks[0].voxels = PackedVoxels(BrickMask::all(), std::numeric_limits<float>::infinity());
    }));
    EXPECT_TRUE(damaged([](MapDelta& d) { d.resolution_m = 0.2; }));
  }
}

TEST(MapFollower, refusesImagesThatCannotBe) {
  MapFollower follower;
  MapImage image;
  EXPECT_FALSE(follower.take(image)) << "no resolution";
  image.resolution_m = 0.1;
  image.bricks = {{{0, 4, 0}, PackedVoxels(BrickMask::all(), 1.0F)}};
  EXPECT_FALSE(follower.take(image)) << "no brick";
  EXPECT_EQ(follower.map(), nullptr);
  image.bricks[0].brick.y = 8;
  EXPECT_TRUE(follower.take(image));
}

}  // namespace
}  // namespace cuboid_mapping
