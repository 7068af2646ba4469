// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/growth_variant.h"

#include "support/random_growth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cuboid_mapping::bench {
namespace {

using cuboid_mapping::test::boxAt;
using cuboid_mapping::test::boxesOf;
using cuboid_mapping::test::GrowthScene;
using cuboid_mapping::test::Random;
using testing::Contains;

GrowthConfig configOf(const GrowthVariant& variant, int seed = 1) {
  GrowthConfig config;
  config.rules = makeRules(variant, seed);
  return config;
}

TEST(GrowthVariant, theStepOfItsOwnWidthDoublesACell) {
  GrowthScene scene(configOf({GrowthStep::kOwnWidth, {}}));
  scene.set(boxAt({9, 0, 0}, {7, 1, 1}), scene.stableFree());
  // Steps of 1, 2, 4; then 8 is too long, in both directions.
  EXPECT_THAT(boxesOf(scene.fuse({{9, 0, 0}})), Contains(boxAt({9, 0, 0}, {4, 1, 1})));
}

TEST(GrowthVariant, theStepOfANeighbourAbsorbsAFusedCuboid) {
  for (const GrowthStep step : {GrowthStep::kCell, GrowthStep::kNeighbour}) {
    GrowthScene scene(configOf({step, {}}));
    scene.set(boxAt({0, 0, 0}, {3, 2, 1}), scene.stableFree());
    ASSERT_EQ(scene.fuse({{0, 0, 0}}).size(), 1U);
    scene.set(boxAt({5, 0, 0}, {4, 2, 1}), scene.stableFree());
    ASSERT_EQ(scene.fuse({{5, 0, 0}}).size(), 2U);
    scene.set(boxAt({3, 0, 0}, {2, 2, 1}), scene.stableFree());
    EXPECT_EQ(scene.fuse({{0, 0, 0}}).size(), step == GrowthStep::kCell ? 2U : 1U);
  }
}

TEST(GrowthVariant, theLargestGainWins) {
  GrowthScene scene(configOf({GrowthStep::kCell, *parseSearchStrategy("largest_gain")}));
  scene.set(boxAt({0, 0, 0}, {3, 2, 1}), scene.stableFree());
  EXPECT_EQ(boxesOf(scene.fuse({{0, 0, 0}})).size(), 1U);
  scene.set(boxAt({3, 0, 0}, {1, 2, 1}), scene.stableFree());  // Two cells along x,
  scene.set(boxAt({0, 2, 0}, {3, 1, 1}), scene.stableFree());  // three along y.
  EXPECT_THAT(boxesOf(scene.fuse({{0, 0, 0}})), Contains(boxAt({0, 0, 0}, {3, 3, 1})));
}

TEST(GrowthVariant, theUsersDirectionsWin) {
  GrowthScene scene(configOf({GrowthStep::kCell, *parseSearchStrategy("-z +z +y -y +x -x")}));
  scene.set(boxAt({0, 0, 0}, {2, 1, 1}), scene.stableFree());
  scene.set(boxAt({0, 0, -1}, {1, 1, 1}), scene.stableFree());
  EXPECT_THAT(boxesOf(scene.fuse({{0, 0, 0}})), Contains(boxAt({0, 0, -1}, {1, 1, 2})));
}

TEST(GrowthVariant, ofAnySearchGrowsCellsUntilNoneCanExpand) {
  cuboid_mapping::test::checkRandomGrowth(3000, [](Random& random) {
    const char* searches[] = {"paper", "largest_gain", "random", "-z +y +x -x -y +z"};
    const int seed = random.integer(0, 1000);
    return configOf({GrowthStep::kCell, *parseSearchStrategy(searches[random.index(4)])}, seed);
  });
}

TEST(GrowthVariant, startsWithAllChangedCells) {
  for (const GrowthStarters starters : {GrowthStarters::kSampled, GrowthStarters::kChanged}) {
    GrowthScene scene(configOf({GrowthStep::kCell, {}, starters}));
    scene.set(boxAt({0, 0, 0}, {4, 1, 1}), scene.stableFree());
    EXPECT_EQ(scene.fuse({}).size(), starters == GrowthStarters::kChanged ? 1U : 4U);
  }
}

TEST(ParseSearchStrategy, knowsNamesAndPermutations) {
  using Order = SearchStrategy::Order;
  EXPECT_EQ(parseSearchStrategy("paper")->order, Order::kPaper);
  EXPECT_EQ(parseSearchStrategy("largest_gain")->order, Order::kLargestGain);
  EXPECT_EQ(parseSearchStrategy("random")->order, Order::kRandom);
  const auto fixed = parseSearchStrategy("-z +z  +y -y +x -x");
  ASSERT_TRUE(fixed);
  EXPECT_EQ(fixed->order, Order::kFixed);
  EXPECT_EQ(toText(*fixed), "-z +z +y -y +x -x");
}

TEST(ParseSearchStrategy, refusesEverythingElse) {
  for (const char* text : {"paper", "largest_gain", "random", "+z -z +x -x +y -y"}) {
    EXPECT_EQ(toText(*parseSearchStrategy(text)), text);
  }
  for (const char* text :
       {"", "Paper", "+x", "+x +y +z -x -y", "+x +y +z -x -y -y", "+x +y +z -x -y -z +x",
        "+x +y +z -x -y -w", "x y z -x -y -z", "+x+y+z-x-y-z"}) {
    EXPECT_FALSE(parseSearchStrategy(text)) << text;
  }
}

}  // namespace
}  // namespace cuboid_mapping::bench
