// SPDX-License-Identifier: BSD-3-Clause
// The voxels of a brick compared with 512 optional numbers, in random streams of changes.
#include "cuboid_mapping/voxels/packed_voxels.h"

#include "support/modelled_brick.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::classOf;
using test::ModelledBrick;
using test::observe;
using test::Random;

/// Minimum size of a brick in bytes: masks that do not follow from the rest, of slices with a known
/// voxel, and each log-odds once.
std::size_t fewestBytes(const ModelledBrick& model) {
  std::set<float> values[2];
  std::array<int, kBrickEdge> num_known{};
  for (std::size_t voxel = 0; voxel < model.size(); ++voxel) {
    if (!model[voxel]) continue;
    values[*model[voxel] >= 0.0F ? 1 : 0].insert(*model[voxel]);
    ++num_known[voxel / 64];
  }
  std::size_t num_slices = 0;
  bool is_any_partly_known = false;
  for (const int count : num_known) {
    if (count > 0) ++num_slices;
    is_any_partly_known |= count > 0 && count < 64;
  }
  const std::size_t most = std::max(values[0].size(), values[1].size());
  std::size_t num_masks = is_any_partly_known ? 1 : 0;
  if (!values[0].empty() && !values[1].empty()) ++num_masks;
  for (std::size_t count = 1; count < most; count *= 2) ++num_masks;
  const std::size_t num_values = values[0].size() + values[1].size();
  return num_masks * num_slices * sizeof(std::uint64_t) + num_values * sizeof(float);
}

/// Whether each log-odds comes once, those of free voxels first, with exactly the voxels that have it.
testing::AssertionResult listsEachValueOnce(const PackedVoxels& voxels,
                                            const ModelledBrick& model) {
  std::map<float, BrickMask> expected;
  for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
    const auto& log_odds = model[static_cast<std::size_t>(voxel)];
    if (log_odds) expected[*log_odds].set(voxel);
  }
  std::map<float, BrickMask> found;
  bool is_once = true;
  bool is_in_order = true;
  bool was_occupied = false;
  voxels.forEachValue([&](float log_odds, const BrickMask& of_value) {
    is_once = found.emplace(log_odds, of_value).second && is_once;
    const bool is_occupied = classify(log_odds) == Occupancy::kOccupied;
    is_in_order = is_in_order && (is_occupied || !was_occupied);
    was_occupied = is_occupied;
  });
  if (!is_once) return testing::AssertionFailure() << "a log-odds comes twice";
  if (!is_in_order) return testing::AssertionFailure() << "a free one comes after an occupied one";
  if (found != expected)
    return testing::AssertionFailure() << "values without voxels, or wrong ones";
  return testing::AssertionSuccess();
}

/// Whether all functions of a brick agree with the model, voxel by voxel.
testing::AssertionResult agree(const PackedVoxels& voxels, const ModelledBrick& model) {
  BrickMask masks[3];
  VoxelValues values;
  values.fill(-99.0F);
  voxels.getValues(values);
  for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
    const auto& expected = model[static_cast<std::size_t>(voxel)];
    masks[static_cast<std::size_t>(classOf(expected))].set(voxel);
    if (voxels.logOddsAt(voxel) != expected) return testing::AssertionFailure() << "at " << voxel;
    if (voxels.at(voxel) != classOf(expected)) {
      return testing::AssertionFailure() << "class at " << voxel;
    }
    if (values[static_cast<std::size_t>(voxel)] != expected.value_or(-99.0F)) {
      return testing::AssertionFailure() << "values at " << voxel;
    }
  }
  const auto& [unknown, free, occupied] = masks;
  if (voxels.known() != ~unknown) return testing::AssertionFailure() << "known()";
  if (voxels.occupied() != occupied) return testing::AssertionFailure() << "occupied()";
  if (voxels.free() != free) return testing::AssertionFailure() << "free()";
  if (voxels.isEmpty() != unknown.isFull()) return testing::AssertionFailure() << "isEmpty()";
  if (voxels.isAnyOccupied() == occupied.isEmpty()) {
    return testing::AssertionFailure() << "isAnyOccupied()";
  }
  if (voxels.isAllFree() != free.isFull()) return testing::AssertionFailure() << "isAllFree()";
  if (voxels.numBytes() != fewestBytes(model)) {
    return testing::AssertionFailure()
           << voxels.numBytes() << " bytes in place of " << fewestBytes(model);
  }
  return listsEachValueOnce(voxels, model);
}

/// Differences of two bricks.
VoxelChange differenceOf(const ModelledBrick& before, const ModelledBrick& after) {
  VoxelChange change;
  for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
    const auto at = static_cast<std::size_t>(voxel);
    if (before[at] != after[at]) change.changed.set(voxel);
    if (classOf(before[at]) != classOf(after[at])) change.reclassified.set(voxel);
  }
  return change;
}

/// @param is_exact  Whether `changed` has no voxel besides; else it may, unless nothing has changed.
testing::AssertionResult isOf(const VoxelChange& difference, const VoxelChange& change,
                              bool is_exact) {
  const bool is_good = is_exact ? change.changed == difference.changed
                                : change.changed.contains(difference.changed) &&
                                      change.changed.isEmpty() == difference.changed.isEmpty();
  if (!is_good) return testing::AssertionFailure() << "changed";
  if (change.reclassified != difference.reclassified) {
    return testing::AssertionFailure() << "reclassified";
  }
  return testing::AssertionSuccess();
}

std::size_t numValues(const PackedVoxels& voxels) {
  std::size_t count = 0;
  voxels.forEachValue([&count](float, const BrickMask&) { ++count; });
  return count;
}

TEST(PackedVoxels, areEmptyAtFirst) {
  EXPECT_TRUE(agree(PackedVoxels(), ModelledBrick()));
  EXPECT_TRUE(agree(PackedVoxels(BrickMask(), 1.0F), ModelledBrick()));
  EXPECT_TRUE(agree(PackedVoxels(BrickMask(), VoxelValues()), ModelledBrick()));
}

TEST(PackedVoxels, ofOneLogOddsTakeSixteenBytesAtMost) {
  for (const float log_odds : {-2.0F, 0.0F, 3.5F}) {
    const PackedVoxels voxels(BrickMask::all(), log_odds);
    ModelledBrick model;
    model.fill(log_odds);
    EXPECT_TRUE(agree(voxels, model));
    EXPECT_LE(voxels.numBytes(), 16U);
  }
}

TEST(PackedVoxels, haveNoMaskOfSlicesThatAreKnownAsAWhole) {
  ModelledBrick model;
  for (const int z : {1, 7}) {
    for (int voxel = 64 * z; voxel < 64 * (z + 1); ++voxel) {
      model[static_cast<std::size_t>(voxel)] = -0.5F;
    }
  }
  const PackedVoxels voxels = test::toPacked(model);
  EXPECT_TRUE(agree(voxels, model));
  EXPECT_EQ(voxels.numBytes(), sizeof(float));
  EXPECT_FALSE(voxels.isAllFree());
}

TEST(PackedVoxels, holdUpTo512DifferentLogOddsOfAnyClass) {
  for (const int num_free : {0, 1, 255, 256, 257, 511, 512}) {
    ModelledBrick model;
    for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
      model[static_cast<std::size_t>(voxel)] = 0.01F * static_cast<float>(voxel - num_free);
    }
    PackedVoxels voxels = test::toPacked(model);
    EXPECT_TRUE(agree(voxels, model)) << num_free;
    EXPECT_EQ(numValues(voxels), 512U);
    // All of them change at once, past each other, and no two become equal.
    const SensorModel sensor_model({0.7, 0.4, 0.0005, 0.9995});
    BrickMask hits;
    for (int voxel = 0; voxel < kBrickVoxels; voxel += 3) hits.set(voxel);
    observe(model, hits, ~hits, sensor_model);
    (void)voxels.observe(hits, ~hits, sensor_model, voxels);
    EXPECT_TRUE(agree(voxels, model)) << num_free;
    // A mask of the known voxels is added.
    for (const int voxel : {0, 100, 511}) {
      BrickMask one;
      one.set(voxel);
      test::paint(model, one, std::nullopt);
      (void)voxels.replace(one, PackedVoxels(), voxels);
      EXPECT_TRUE(agree(voxels, model)) << num_free << ' ' << voxel;
    }
  }
}

TEST(PackedVoxels, takeAHitForAVoxelThatIsMissedToo) {
  PackedVoxels voxels;
  const SensorModel sensor_model;
  (void)voxels.observe(BrickMask::all(), BrickMask::all(), sensor_model, voxels);
  EXPECT_EQ(voxels, PackedVoxels(BrickMask::all(), sensor_model.hit()));
}

TEST(PackedVoxels, doNotChangeWhereAllIsClamped) {
  for (const Environment environment : {Environment::kDynamic, Environment::kStatic}) {
    const SensorModel model({}, environment);
    PackedVoxels voxels(BrickMask::all(), model.min());
    EXPECT_TRUE(voxels.observe({}, BrickMask::all(), model, voxels).changed.isEmpty());
    const VoxelChange after_hits = voxels.observe(BrickMask::all(), {}, model, voxels);
    EXPECT_EQ(after_hits.changed.isFull(), environment == Environment::kDynamic);
  }
}

TEST(PackedVoxels, goBackToTheFewestBytesWhenTheirLogOddsComeTogether) {
  Random random(1);
  ModelledBrick model;
  for (auto& voxel : model) voxel = static_cast<float>(random.real(-3.0, 3.0));
  PackedVoxels voxels = test::toPacked(model);
  ASSERT_GT(numValues(voxels), 500U);
  const SensorModel sensor_model;
  for (int i = 0; i < 30; ++i) {
    observe(model, {}, BrickMask::all(), sensor_model);
    (void)voxels.observe({}, BrickMask::all(), sensor_model, voxels);
    ASSERT_TRUE(agree(voxels, model)) << test::seedNote(static_cast<std::size_t>(i));
  }
  EXPECT_EQ(voxels, PackedVoxels(BrickMask::all(), sensor_model.min()));
  EXPECT_LE(voxels.numBytes(), 16U);
}

TEST(PackedVoxels, areMadeOfAnyVoxelsAndOfThoseOnly) {
  Random random(2);
  constexpr std::size_t kCases = 3000;
  std::size_t most_values = 0;
  for (std::size_t i = 0; i < kCases; ++i) {
    const ModelledBrick model = test::randomModelledBrick(random);
    const PackedVoxels voxels = test::toPacked(model);
    ASSERT_TRUE(agree(voxels, model)) << test::seedNote(i);
    ASSERT_EQ(voxels, test::toPacked(model, -7.0F)) << test::seedNote(i);
    most_values = std::max(most_values, numValues(voxels));
  }
  EXPECT_EQ(most_values, 512U);
}

TEST(PackedVoxels, areEqualWhenAllVoxelsAre) {
  Random random(3);
  constexpr std::size_t kCases = 1000;
  for (std::size_t i = 0; i < kCases; ++i) {
    ModelledBrick model = test::randomModelledBrick(random);
    const PackedVoxels voxels = test::toPacked(model);
    PackedVoxels other;  // The same content in another way: numbers have another order.
    for (int z = 7; z >= 0; --z) {
      (void)other.replace(BrickMask::ofBox({{0, 0, z}, {8, 8, z + 1}}), voxels, other);
    }
    ASSERT_EQ(voxels, other) << test::seedNote(i);
    const std::size_t voxel = random.index(model.size());
    model[voxel] = model[voxel] && random.chance(0.5) ? std::nullopt
                                                      : std::optional<float>(random.real(4.0, 5.0));
    ASSERT_NE(voxels, test::toPacked(model)) << test::seedNote(i);
    ASSERT_NE(test::toPacked(model), voxels) << test::seedNote(i);
  }
}

TEST(PackedVoxels, areCopiedAndMovedWhole) {
  Random random(4);
  constexpr std::size_t kCases = 1000;
  PackedVoxels assigned;
  for (std::size_t i = 0; i < kCases; ++i) {
    const ModelledBrick model = i % 10 == 0 ? ModelledBrick() : test::randomModelledBrick(random);
    PackedVoxels original = test::toPacked(model);
    PackedVoxels copy(original);
    assigned = original;
    const PackedVoxels& itself = assigned;
    assigned = itself;
    (void)original.replace(BrickMask::all(), PackedVoxels(BrickMask::all(), 5.0F), original);
    ASSERT_TRUE(agree(copy, model)) << "a copy follows the original; " << test::seedNote(i);
    ASSERT_TRUE(agree(assigned, model)) << test::seedNote(i);
    const PackedVoxels moved(std::move(copy));
    ASSERT_TRUE(agree(moved, model)) << test::seedNote(i);
  }
}

/// Models with few and with very many log-odds, with thresholds near and far.
constexpr SensorModelConfig kSensorModels[] = {
    {}, {0.9, 0.1, 0.3, 0.6}, {0.51, 0.495, 0.001, 0.999}, {0.5001, 0.4, 0.12, 0.97}};

/// A random observation or replacement, also applied to the oracle.
VoxelChange changeBoth(Random& random, const SensorModel& sensor_model, PackedVoxels& voxels,
                       ModelledBrick& model, bool& is_observation) {
  is_observation = random.chance(0.9);
  if (is_observation) {
    const BrickMask hits = random.chance(0.3) ? BrickMask() : test::randomMask(random);
    const BrickMask misses = test::randomMask(random);
    observe(model, hits, misses, sensor_model);
    return voxels.observe(hits, misses, sensor_model, voxels);
  }
  const BrickMask part = random.chance(0.3) ? BrickMask::all() : test::randomMask(random);
  ModelledBrick other = random.chance(0.2) ? ModelledBrick() : test::randomModelledBrick(random);
  if (random.chance(0.3)) {  // The same voxels, perhaps with two values exchanged.
    other = model;
    if (random.chance(0.5))
      std::swap(other[0], other[static_cast<std::size_t>(random.integer(1, 511))]);
  }
  part.forEach([&](int voxel) {
    const auto at = static_cast<std::size_t>(voxel);
    model[at] = other[at];
  });
  return voxels.replace(part, test::toPacked(other), voxels);
}

TEST(PackedVoxels, agreeWithSingleVoxelsThroughRandomChanges) {
  constexpr std::size_t kSteps = 2500;
  std::size_t num_cases = 0;
  std::size_t num_unchanged = 0;
  std::size_t most_values = 0;
  for (const SensorModelConfig& config : kSensorModels) {
    for (const Environment environment : {Environment::kDynamic, Environment::kStatic}) {
      Random random(100 + num_cases);
      SensorModel sensor_model(config, environment);
      PackedVoxels voxels;
      ModelledBrick model;
      for (std::size_t step = 0; step < kSteps; ++step, ++num_cases) {
        // Another sensor model at run time: log-odds lie beyond its thresholds.
        if (step == kSteps / 2) sensor_model = SensorModel({0.6, 0.45, 0.4, 0.6}, environment);
        const ModelledBrick before = model;
        bool is_observation = false;
        const VoxelChange change = changeBoth(random, sensor_model, voxels, model, is_observation);
        ASSERT_TRUE(agree(voxels, model)) << test::seedNote(num_cases);
        ASSERT_TRUE(isOf(differenceOf(before, model), change, is_observation))
            << test::seedNote(num_cases);
        num_unchanged += change.changed.isEmpty() ? 1 : 0;
        most_values = std::max(most_values, numValues(voxels));
      }
    }
  }
  EXPECT_EQ(num_cases, 8 * kSteps);
  EXPECT_GT(num_unchanged, kSteps / 20);
  EXPECT_EQ(most_values, 512U);
}

}  // namespace
}  // namespace cuboid_mapping
