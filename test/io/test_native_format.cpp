// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/native_format.h"

#include "cuboid_mapping/io/text.h"
#include "support/native_files.h"
#include "support/snapshots.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping {
namespace {

using namespace test;

/// Content of test/data/version_1.cuboids, box by box.
MapSnapshot snapshotOfVersion1() {
  MapSnapshot snapshot = emptySnapshot();
  snapshot.bricks = toBricks({{{{-8, 0, 8}, {-4, 8, 16}}, -0.5F},
                              {{{0, 0, 0}, {1, 1, 1}}, 0.75F},
                              {{{1, 0, 0}, {8, 1, 1}}, -0.5F},
                              {{{1000000, -1000000, 0}, {1000001, -999000, 300}}, 2.0F}})
                        .bricks;
  return snapshot;
}

void expectHeader(const MapSnapshot& read) {
  const MapSnapshot expected = emptySnapshot();
  EXPECT_EQ(read.resolution_m, expected.resolution_m);
  EXPECT_TRUE(test::isSameModel(read.sensor_model, expected.sensor_model));
  EXPECT_EQ(read.environment, Environment::kStatic);
  EXPECT_EQ(read.frame_id, "map");
}

TEST(NativeFormat, givesBackWhatWasPutIn) {
  Random random(31);
  constexpr int kCases = 60;
  std::size_t num_bricks = 0;
  for (int i = 0; i < kCases; ++i) {
    const Cell offset{8 * random.integer(-100000, 100000), 0, 8 * random.integer(-9, 9)};
    const MapSnapshot snapshot = test::randomSnapshot(random, offset);
    const MapSnapshot read = fromNativeFormat(toNativeFormat(snapshot));
    ASSERT_TRUE(isSame(read.bricks, snapshot.bricks)) << test::seedNote(i);
    EXPECT_EQ(read.resolution_m, snapshot.resolution_m);
    EXPECT_TRUE(test::isSameModel(read.sensor_model, snapshot.sensor_model));
    EXPECT_EQ(read.environment, snapshot.environment);
    EXPECT_EQ(read.frame_id, "odom");
    num_bricks += read.bricks.size();
  }
  EXPECT_GT(num_bricks, 2000U);
}

TEST(NativeFormat, doesNotDependOnHowAMapWasMade) {
  Random random(32);
  for (int i = 0; i < 10; ++i) {
    const MapSnapshot snapshot = test::randomSnapshot(random);
    MapConfig config;
    config.resolution_m = snapshot.resolution_m;
    config.sensor_model = snapshot.sensor_model;
    config.environment = snapshot.environment;
    CuboidMap map(config);
    map.replace(kAllCells, {UniformBox{{{-50, -50, -50}, {50, 50, 50}}, 0.125F}});
    std::vector<VoxelBrick> bricks = snapshot.bricks;
    random.shuffle(bricks);
    map.replace(kAllCells, bricks);
    EXPECT_EQ(toNativeFormat(takeSnapshot(map, snapshot.frame_id)), toNativeFormat(snapshot))
        << test::seedNote(i);
  }
}

TEST(NativeFormat, holdsAnEmptyMapAndTheGreatestCells) {
  MapSnapshot snapshot;
  EXPECT_TRUE(fromNativeFormat(toNativeFormat(snapshot)).bricks.empty());
  constexpr std::int32_t kMax = Grid::kMaxCell;
  snapshot.bricks = toBricks({{CellBox::ofCell({-kMax, -kMax, -kMax}), -1.0F},
                              {CellBox::ofCell({kMax - 1, kMax - 1, kMax - 1}), 1.0F}})
                        .bricks;
  EXPECT_TRUE(isSame(fromNativeFormat(toNativeFormat(snapshot)).bricks, snapshot.bricks));
}

TEST(NativeFormat, keepsEveryFiniteLogOdds) {
  MapSnapshot snapshot;
  const std::vector<float> values{-std::numeric_limits<float>::max(),
                                  std::numeric_limits<float>::max(),
                                  std::numeric_limits<float>::min(),
                                  -std::numeric_limits<float>::denorm_min(),
                                  std::numeric_limits<float>::denorm_min(),
                                  0.0F,
                                  0.1F};
  std::vector<UniformBox> boxes;
  for (std::size_t i = 0; i < values.size(); ++i) {
    boxes.push_back({CellBox::ofCell({5 * static_cast<std::int32_t>(i), 0, 0}), values[i]});
  }
  snapshot.bricks = toBricks(boxes).bricks;
  const auto read = test::voxelsOf(fromNativeFormat(toNativeFormat(snapshot)).bricks);
  for (const UniformBox& box : boxes) EXPECT_EQ(read.at(box.box.min), box.log_odds);
}

TEST(NativeFormat, readsAFileOfVersion1) {
  const MapSnapshot read = fromNativeFormat(readGolden("version_1.cuboids"));
  EXPECT_TRUE(isSame(read.bricks, snapshotOfVersion1().bricks));
  expectHeader(read);
}

TEST(NativeFormat, readsAFileOfVersion2) {
  const std::string bytes = readGolden("version_2.cuboids");
  const MapSnapshot read = fromNativeFormat(bytes);
  const MapSnapshot expected = goldenSnapshot();
  EXPECT_TRUE(isSame(read.bricks, expected.bricks));
  expectHeader(read);
  // The compressed content may differ with the library; the bytes before it and its length may not.
  const std::string now = toNativeFormat(expected);
  EXPECT_EQ(now.substr(0, kCompressedBytesAt), bytes.substr(0, kCompressedBytesAt));
}

TEST(NativeFormat, writesOfAFileOfVersion1WhatItHolds) {
  const MapSnapshot read = fromNativeFormat(readGolden("version_1.cuboids"));
  const std::string written = toNativeFormat(read);
  EXPECT_EQ(written[kVersionAt], 2);
  EXPECT_TRUE(isSame(fromNativeFormat(written).bricks, read.bricks));
}

TEST(NativeFormat, hasVersion3WithLocksAndVersion2Without) {
  MapSnapshot snapshot = goldenSnapshot();
  EXPECT_EQ(toNativeFormat(snapshot)[kVersionAt], 2);
  snapshot.locked = {{{-3, -2, -1}, {4, 5, 6}}, {{10, 0, 0}, {11, 2000, 1}}};
  const std::string bytes = toNativeFormat(snapshot);
  EXPECT_EQ(bytes[kVersionAt], 3);
  const MapSnapshot read = fromNativeFormat(bytes);
  EXPECT_EQ(read.locked, snapshot.locked);
  EXPECT_TRUE(isSame(read.bricks, snapshot.bricks));
  for (std::size_t length = 8; length < bytes.size(); ++length) {
    ASSERT_EQ(defectOf(bytes.substr(0, length)), MapFileDefect::kTruncated) << length;
  }
  snapshot.bricks.clear();
  EXPECT_EQ(fromNativeFormat(toNativeFormat(snapshot)).locked, snapshot.locked);
  snapshot.locked.push_back({{0, 0, 0}, {1, 1, 1}});
  EXPECT_EQ(defectOf(toNativeFormat(snapshot)), MapFileDefect::kCorrupted) << "overlap";
}

TEST(NativeFormat, hasVersion4WithFusedCuboids) {
  MapSnapshot snapshot = goldenSnapshot();
  snapshot.cuboids = {{CellBox::ofCell({0, 0, 0}), Occupancy::kFree}};
  EXPECT_EQ(toNativeFormat(snapshot)[kVersionAt], 2) << "a single cell is not fused";
  snapshot.cuboids = {{{{9, 0, 0}, {20, 1, 2}}, Occupancy::kOccupied},
                      {{{-30, 0, 0}, {8, 1, 1}}, Occupancy::kFree},
                      {{{9, 1, 0}, {11, 2, 2}}, Occupancy::kFree}};
  for (const bool is_locked : {false, true}) {
    if (is_locked) snapshot.locked = {{{-3, -2, -1}, {4, 5, 6}}};
    const std::string bytes = toNativeFormat(snapshot);
    EXPECT_EQ(bytes[kVersionAt], 4);
    const MapSnapshot read = fromNativeFormat(bytes);
    EXPECT_EQ(read.cuboids, snapshot.cuboids);
    EXPECT_EQ(read.locked, snapshot.locked);
    EXPECT_TRUE(isSame(read.bricks, snapshot.bricks));
    EXPECT_EQ(toNativeFormat(read), bytes);
    for (std::size_t length = 8; length < bytes.size(); ++length) {
      ASSERT_EQ(defectOf(bytes.substr(0, length)), MapFileDefect::kTruncated) << length;
    }
  }
  snapshot.cuboids.push_back({{{19, 0, 0}, {21, 1, 1}}, Occupancy::kFree});
  EXPECT_EQ(defectOf(toNativeFormat(snapshot)), MapFileDefect::kCorrupted) << "overlap";
  snapshot.cuboids.back().box = {{Grid::kMaxCell - 1, 0, 0}, {Grid::kMaxCell + 1, 1, 1}};
  EXPECT_EQ(defectOf(toNativeFormat(snapshot)), MapFileDefect::kCorrupted) << "too far";
}

/// doc/file_format.md has these ranges.
TEST(NativeFormat, takesProbabilitiesInTheRangesOfItsDocument) {
  std::ifstream in(CUBOID_MAPPING_SOURCE_DIR "/doc/file_format.md");
  const std::string document{std::istreambuf_iterator<char>(in), {}};
  const auto inDocument = [&](const std::string& row, double low, double high) {
    return document.find(row + ", from " + toText(low) + " to " + toText(high) + " |") !=
           std::string::npos;
  };
  EXPECT_TRUE(inDocument("probability of a hit", kLeastOccupied, kMostOccupied));
  EXPECT_TRUE(inDocument("probability of a miss", 1.0 - kMostOccupied, 1.0 - kLeastOccupied));
  EXPECT_TRUE(inDocument("(alpha_min)", 1.0 - kMostOccupied, 1.0 - kLeastOccupied));
  EXPECT_TRUE(inDocument("(alpha_max)", kLeastOccupied, kMostOccupied));
  constexpr std::size_t kHitAt = 24;
  for (const std::size_t place : {0U, 1U, 2U, 3U}) {
    const bool is_occupied = place == 0 || place == 3;
    for (const double probability : {kLeastOccupied, kMostOccupied}) {
      const double step = probability == kLeastOccupied ? -1e-6 : 1e-6;
      std::string bytes = toNativeFormat(goldenSnapshot());
      const auto put = [&](double value) {
        overwrite<double>(bytes, kHitAt + 8 * place, is_occupied ? value : 1.0 - value);
        sealHeader(bytes);
        return bytes;
      };
      EXPECT_NO_THROW((void)fromNativeFormat(put(probability))) << place << ' ' << probability;
      EXPECT_EQ(defectOf(put(probability + step)), MapFileDefect::kCorrupted);
    }
  }
}

}  // namespace
}  // namespace cuboid_mapping
