// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/occupancy/sensor_model.h"

#include "cuboid_mapping/occupancy/cuboid.h"
#include "support/random.h"

#include <gtest/gtest.h>
#include <octomap/OcTree.h>
#include <octomap/octomap_utils.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A model with thresholds beyond the sums of a test.
SensorModelConfig wideConfig() {
  SensorModelConfig config;
  config.alpha_min = 0.0006;
  config.alpha_max = 0.9994;
  return config;
}

TEST(LogOdds, areThoseOfOctomap) {
  for (int i = 1; i < 1000; ++i) {
    const double probability = i / 1000.0;
    EXPECT_FLOAT_EQ(toLogOdds(probability), octomap::logodds(probability));
    const float log_odds = toLogOdds(probability);
    EXPECT_NEAR(toProbability(log_odds), octomap::probability(log_odds), 1e-6);
    EXPECT_NEAR(toProbability(log_odds), probability, 1e-6);
  }
}

TEST(LogOdds, areZeroAtOneHalfAndInfiniteAtTheEnds) {
  EXPECT_EQ(toLogOdds(0.5), 0.0F);
  EXPECT_EQ(toLogOdds(0.0), -kInfinity);
  EXPECT_EQ(toLogOdds(1.0), kInfinity);
  EXPECT_EQ(toProbability(0.0F), 0.5);
  EXPECT_EQ(toProbability(-kInfinity), 0.0);
  EXPECT_EQ(toProbability(kInfinity), 1.0);
}

TEST(Occupancy, isOccupiedFromZeroUp) {
  EXPECT_EQ(classify(0.0F), Occupancy::kOccupied);
  EXPECT_EQ(classify(-0.0F), Occupancy::kOccupied);
  EXPECT_EQ(classify(std::numeric_limits<float>::denorm_min()), Occupancy::kOccupied);
  EXPECT_EQ(classify(-std::numeric_limits<float>::denorm_min()), Occupancy::kFree);
  EXPECT_EQ(classify(3.0F), Occupancy::kOccupied);
  EXPECT_EQ(classify(-3.0F), Occupancy::kFree);
}

TEST(Occupancy, isOneForACuboid) {
  const Cuboid cuboid{CellBox::ofCell({1, 2, 3}), Occupancy::kOccupied};
  EXPECT_TRUE(cuboid.isOccupied());
  EXPECT_FALSE((Cuboid{cuboid.box, Occupancy::kFree}).isOccupied());
  EXPECT_EQ(cuboid, (Cuboid{cuboid.box, Occupancy::kOccupied}));
  EXPECT_NE(cuboid, (Cuboid{cuboid.box, Occupancy::kFree}));
  EXPECT_NE(cuboid, (Cuboid{CellBox::ofCell({0, 2, 3}), Occupancy::kOccupied}));
}

TEST(Occupancy, hasNames) {
  EXPECT_EQ(std::string(toString(Occupancy::kUnknown)), "unknown");
  EXPECT_EQ(std::string(toString(Occupancy::kFree)), "free");
  EXPECT_EQ(std::string(toString(Occupancy::kOccupied)), "occupied");
}

TEST(SensorModel, hasTheNumbersOfOctomapByDefault) {
  const SensorModel model;
  const octomap::OcTree tree(0.1);
  EXPECT_NEAR(model.hit(), octomap::logodds(0.7), 1e-6);
  EXPECT_NEAR(model.miss(), octomap::logodds(0.4), 1e-6);
  EXPECT_NEAR(model.hit(), tree.getProbHitLog(), 1e-6);
  EXPECT_NEAR(model.miss(), tree.getProbMissLog(), 1e-6);
  EXPECT_NEAR(model.min(), octomap::logodds(0.12), 1e-6);
  EXPECT_NEAR(model.max(), octomap::logodds(0.97), 1e-6);
  EXPECT_EQ(model.environment(), Environment::kDynamic);
}

TEST(SensorModel, takesEachProbabilityOfItsConfig) {
  test::Random random(1);
  for (int i = 0; i < 1000; ++i) {
    SensorModelConfig config;
    config.hit = random.real(0.51, 0.999);
    config.miss = random.real(0.001, 0.49);
    config.alpha_min = random.real(0.001, 0.49);
    config.alpha_max = random.real(0.51, 0.999);
    const SensorModel model(config);
    ASSERT_NEAR(model.hit(), octomap::logodds(config.hit), 1e-6) << test::seedNote(i);
    ASSERT_NEAR(model.miss(), octomap::logodds(config.miss), 1e-6) << test::seedNote(i);
    ASSERT_NEAR(model.min(), octomap::logodds(config.alpha_min), 1e-6) << test::seedNote(i);
    ASSERT_NEAR(model.max(), octomap::logodds(config.alpha_max), 1e-6) << test::seedNote(i);
    for (const float value : {model.hit(), model.miss(), model.min(), model.max()}) {
      const float steps = std::ldexp(value, 20);
      ASSERT_EQ(steps, std::round(steps)) << "not a multiple of 2^-20";
    }
  }
}

TEST(SensorModel, isStableAtAndBeyondAThreshold) {
  const SensorModel model;
  EXPECT_TRUE(model.isStable(model.min()));
  EXPECT_TRUE(model.isStable(model.max()));
  EXPECT_TRUE(model.isStable(model.min() - 1.0F));
  EXPECT_TRUE(model.isStable(model.max() + 1.0F));
  EXPECT_FALSE(model.isStable(std::nextafter(model.min(), 0.0F)));
  EXPECT_FALSE(model.isStable(std::nextafter(model.max(), 0.0F)));
  EXPECT_FALSE(model.isStable(0.0F));
}

TEST(SensorModel, addsAnObservation) {
  const SensorModel model;
  EXPECT_EQ(model.update(0.0F, model.hit()), model.hit());
  EXPECT_EQ(model.update(0.0F, model.miss()), model.miss());
  EXPECT_EQ(model.update(model.hit(), model.miss()), model.hit() + model.miss());
}

TEST(SensorModel, clampsAtBothThresholds) {
  const SensorModel model;
  EXPECT_EQ(model.update(model.max() - 0.01F, model.hit()), model.max());
  EXPECT_EQ(model.update(model.max(), model.hit()), model.max());
  EXPECT_EQ(model.update(model.min() + 0.01F, model.miss()), model.min());
  EXPECT_EQ(model.update(model.min(), model.miss()), model.min());
}

TEST(SensorModel, movesStableCellsInADynamicEnvironment) {
  const SensorModel model({}, Environment::kDynamic);
  EXPECT_EQ(model.update(model.max(), model.miss()), model.max() + model.miss());
  EXPECT_EQ(model.update(model.min(), model.hit()), model.min() + model.hit());
}

TEST(SensorModel, neverMovesStableCellsInAStaticEnvironment) {
  const SensorModel model({}, Environment::kStatic);
  EXPECT_EQ(model.environment(), Environment::kStatic);
  for (const float stable : {model.min(), model.max(), model.min() - 1.0F, model.max() + 1.0F}) {
    EXPECT_EQ(model.update(stable, model.hit()), stable);
    EXPECT_EQ(model.update(stable, model.miss()), stable);
  }
}

TEST(SensorModel, movesOtherCellsInAStaticEnvironmentUntilTheyAreStable) {
  const SensorModel model({}, Environment::kStatic);
  EXPECT_EQ(model.update(0.0F, model.hit()), model.hit());
  float log_odds = 0.0F;
  int num_misses = 0;
  while (!model.isStable(log_odds)) {
    log_odds = model.update(log_odds, model.miss());
    ++num_misses;
  }
  EXPECT_EQ(num_misses, 5);  // -2.03 is below log(0.12 / 0.88) = -1.99.
  EXPECT_EQ(log_odds, model.min());
  EXPECT_EQ(model.update(log_odds, model.hit()), model.min());
}

TEST(SensorModel, givesTheSameSumWhateverTheOrder) {
  test::Random random(2);
  constexpr std::size_t kCases = 10000;
  for (std::size_t i = 0; i < kCases; ++i) {
    SensorModelConfig config = wideConfig();
    config.hit = random.real(0.55, 0.7);
    config.miss = random.real(0.4, 0.45);
    const SensorModel model(config);
    std::vector<float> observations(static_cast<std::size_t>(random.integer(0, 8)), model.hit());
    observations.resize(observations.size() + static_cast<std::size_t>(random.integer(1, 16)),
                        model.miss());
    const auto sum_up = [&] {
      float log_odds = 0.0F;
      for (const float observation : observations) {
        log_odds = model.update(log_odds, observation);
        EXPECT_FALSE(model.isStable(log_odds));
      }
      return log_odds;
    };
    const float expected = sum_up();
    random.shuffle(observations);
    ASSERT_EQ(sum_up(), expected) << test::seedNote(i);  // To the last bit.
  }
}

TEST(SensorModel, followsOctomapOverLongSequences) {
  test::Random random(3);
  const SensorModel model;
  octomap::OcTree tree(0.1);
  tree.setClampingThresMin(SensorModelConfig{}.alpha_min);
  tree.setClampingThresMax(SensorModelConfig{}.alpha_max);
  octomap::OcTreeNode node;
  float log_odds = 0.0F;
  constexpr std::size_t kCases = 20000;
  std::size_t num_stable = 0;
  for (std::size_t i = 0; i < kCases; ++i) {
    const bool is_hit = random.chance(i / 100 % 2 == 0 ? 0.7 : 0.05);
    tree.updateNodeLogOdds(&node, is_hit ? tree.getProbHitLog() : tree.getProbMissLog());
    log_odds = model.update(log_odds, is_hit ? model.hit() : model.miss());
    ASSERT_NEAR(log_odds, node.getLogOdds(), 1e-4) << test::seedNote(i);
    num_stable += model.isStable(log_odds) ? 1 : 0;
  }
  EXPECT_GT(num_stable, kCases / 10);
  EXPECT_LT(num_stable, kCases * 9 / 10);
}

}  // namespace
}  // namespace cuboid_mapping
