// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/native_format.h"

#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/voxels/uniform_boxes.h"
#include "support/snapshots.h"
#include "tools/run_program.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <sstream>

namespace cuboid_mapping {
namespace {

using test::Random;

// Offsets in the header, from doc/file_format.md.
constexpr std::size_t kVersionAt = 8;
constexpr std::size_t kEnvironmentAt = 12;
constexpr std::size_t kResolutionAt = 16;
constexpr std::size_t kNumBricksAt = 56;
constexpr std::size_t kPayloadBytesAt = 72;
constexpr std::size_t kCompressedBytesAt = 80;
constexpr std::size_t kFrameIdBytesAt = 88;
constexpr std::size_t kFrameIdAt = 92;

/// The header of both golden files, without voxels.
MapSnapshot emptySnapshot() {
  MapSnapshot snapshot;
  snapshot.resolution_m = 0.2;
  snapshot.sensor_model = {0.7, 0.4, 0.12, 0.97};
  snapshot.environment = Environment::kStatic;
  snapshot.frame_id = "map";
  return snapshot;
}

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

/// Content of test/data/version_2.cuboids: see write_version_2.py beside it.
MapSnapshot goldenSnapshot() {
  MapSnapshot snapshot = emptySnapshot();
  std::vector<UniformBox> boxes{{{{-8, 0, 8}, {-4, 8, 16}}, -0.5F},
                                {{{0, 0, 0}, {1, 1, 1}}, 0.75F},
                                {{{1, 0, 0}, {8, 1, 1}}, -0.5F},
                                {{{1000000, -1000000, 299}, {1000010, -999999, 300}}, 2.0F}};
  for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
    if (voxel % 3 == 0) continue;
    const Cell cell = cellAt({-16, -16, -16}, voxel);
    boxes.push_back({CellBox::ofCell(cell), static_cast<float>(voxel - 256) / 64.0F});
  }
  snapshot.bricks = toBricks(boxes).bricks;
  return snapshot;
}

/// Whether bricks are equal, bit by bit.
bool isSame(const std::vector<VoxelBrick>& a, const std::vector<VoxelBrick>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const VoxelBrick& one, const VoxelBrick& other) {
                      return one.brick == other.brick && one.voxels == other.voxels;
                    });
}

std::string readGolden(const std::string& name) {
  std::ostringstream bytes;
  bytes << std::ifstream(CUBOID_MAPPING_SOURCE_DIR "/test/data/" + name, std::ios::binary).rdbuf();
  EXPECT_GT(bytes.str().size(), 100U) << name;
  return bytes.str();
}

void expectHeader(const MapSnapshot& read) {
  const MapSnapshot expected = emptySnapshot();
  EXPECT_EQ(read.resolution_m, expected.resolution_m);
  EXPECT_TRUE(test::isSameModel(read.sensor_model, expected.sensor_model));
  EXPECT_EQ(read.environment, Environment::kStatic);
  EXPECT_EQ(read.frame_id, "map");
}

/// Defect of refused bytes; fails if they are accepted.
MapFileDefect defectOf(const std::string& bytes, const SnapshotLimits& limits = {}) {
  try {
    (void)fromNativeFormat(bytes, limits);
  } catch (const MapFileError& error) {
    EXPECT_GT(std::strlen(error.what()), 10U);
    return error.defect();
  }
  ADD_FAILURE() << "taken for a map";
  return {};
}

template <typename T>
void overwrite(std::string& bytes, std::size_t place, T value) {
  std::memcpy(bytes.data() + place, &value, sizeof(value));
}

/// Corrects the checksum of the header.
void sealHeader(std::string& bytes) {
  std::uint32_t frame_id_bytes = 0;
  std::memcpy(&frame_id_bytes, bytes.data() + kFrameIdBytesAt, sizeof(frame_id_bytes));
  const std::size_t end = kFrameIdAt + frame_id_bytes;
  const auto checksum = static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(end)));
  overwrite(bytes, end, checksum);
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

TEST(NativeFormat, saysThatAFileIsForeign) {
  EXPECT_EQ(defectOf("# Octomap OcTree file\n"), MapFileDefect::kForeign);
  EXPECT_EQ(defectOf("\x89PNG\r\n\x1a\n"), MapFileDefect::kForeign);
}

TEST(NativeFormat, saysThatAFileIsTruncated) {
  const std::string bytes = toNativeFormat(goldenSnapshot());
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    ASSERT_EQ(defectOf(bytes.substr(0, length)),
              length == 0 ? MapFileDefect::kForeign : MapFileDefect::kTruncated)
        << length;
  }
}

TEST(NativeFormat, noticesEveryByteThatHasChanged) {
  const std::string bytes = toNativeFormat(goldenSnapshot());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    for (const int bit : {0, 3, 7}) {
      std::string damaged = bytes;
      damaged[i] = static_cast<char>(damaged[i] ^ 1 << bit);
      EXPECT_THROW((void)fromNativeFormat(damaged), MapFileError) << i;
    }
  }
  EXPECT_EQ(defectOf(bytes + "x"), MapFileDefect::kCorrupted);
  std::string damaged = bytes;
  damaged[kResolutionAt] ^= 1;
  EXPECT_EQ(defectOf(damaged), MapFileDefect::kCorrupted);
  damaged = bytes;
  damaged[bytes.size() - 10] ^= 1;
  EXPECT_EQ(defectOf(damaged), MapFileDefect::kCorrupted);
}

TEST(NativeFormat, saysThatAFileIsNewer) {
  std::string bytes = toNativeFormat(goldenSnapshot());
  overwrite<std::uint32_t>(bytes, kVersionAt, kNativeFormatVersion + 1);
  EXPECT_EQ(defectOf(bytes), MapFileDefect::kNewerVersion);
  EXPECT_EQ(defectOf(bytes.substr(0, 20)), MapFileDefect::kNewerVersion);
}

TEST(NativeFormat, saysThatAClaimIsTooBig) {
  const std::string good = toNativeFormat(goldenSnapshot());
  std::string bytes = good;
  overwrite<std::uint64_t>(bytes, kNumBricksAt, std::uint64_t{1} << 60);
  sealHeader(bytes);
  EXPECT_EQ(defectOf(bytes), MapFileDefect::kTooBig);
  bytes = good;
  overwrite<std::uint64_t>(bytes, kPayloadBytesAt, std::uint64_t{1} << 60);
  sealHeader(bytes);
  EXPECT_EQ(defectOf(bytes), MapFileDefect::kTooBig);
  SnapshotLimits few;
  few.max_bricks = 4;
  EXPECT_EQ(defectOf(good, few), MapFileDefect::kTooBig);
  EXPECT_EQ(defectOf(readGolden("version_1.cuboids"), few), MapFileDefect::kTooBig);
  few.max_bricks = 5;
  EXPECT_TRUE(isSame(fromNativeFormat(good, few).bricks, goldenSnapshot().bricks));
  few.max_bytes = 100;
  EXPECT_EQ(defectOf(good, few), MapFileDefect::kTooBig);
}

/// The limits are for bytes from others: a file of one's own may have any size.
TEST(NativeFormat, ofAFileHasNoLimitOfSize) {
  const test::TemporaryFolder folder;
  std::string bytes = toNativeFormat(goldenSnapshot());
  overwrite<std::uint64_t>(bytes, kNumBricksAt, std::uint64_t{1} << 25);
  overwrite<std::uint64_t>(bytes, kPayloadBytesAt, std::uint64_t{1} << 32);
  sealHeader(bytes);
  EXPECT_EQ(defectOf(bytes), MapFileDefect::kTooBig);
  EXPECT_EQ(defectOf(bytes, SnapshotLimits::none()), MapFileDefect::kCorrupted);
  std::ofstream(folder / "map.cuboids", std::ios::binary) << bytes;
  try {
    (void)loadMap(folder / "map.cuboids");
    ADD_FAILURE() << "its content is shorter than it says";
  } catch (const MapFileError& error) {
    EXPECT_EQ(error.defect(), MapFileDefect::kCorrupted) << error.what();
  }
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

TEST(NativeFormat, looksAtTheNumberOfBricksBeforeItUnpacksThem) {
  std::string bytes = toNativeFormat(goldenSnapshot());
  overwrite<std::uint64_t>(bytes, kNumBricksAt, 1000);
  overwrite<std::uint64_t>(bytes, kPayloadBytesAt, 100000);  // A wrong size that is not read.
  sealHeader(bytes);
  SnapshotLimits few;
  few.max_bricks = 999;
  EXPECT_EQ(defectOf(bytes, few), MapFileDefect::kTooBig);
  few.max_bricks = 1000;
  EXPECT_EQ(defectOf(bytes, few), MapFileDefect::kCorrupted);
}

TEST(NativeFormat, refusesWhatIsNoMapThoughItsChecksumsAreRight) {
  std::string bytes = toNativeFormat(goldenSnapshot());
  overwrite<std::uint32_t>(bytes, kEnvironmentAt, 2);
  sealHeader(bytes);
  EXPECT_EQ(defectOf(bytes), MapFileDefect::kCorrupted);
  bytes = toNativeFormat(goldenSnapshot());
  overwrite<double>(bytes, kResolutionAt, 0.0);
  sealHeader(bytes);
  EXPECT_EQ(defectOf(bytes), MapFileDefect::kCorrupted);
  const auto defect_of = [](const std::function<void(std::vector<VoxelBrick>&)>& damage) {
    MapSnapshot snapshot = goldenSnapshot();
    damage(snapshot.bricks);
    return defectOf(toNativeFormat(snapshot));
  };
  using Bricks = std::vector<VoxelBrick>;
  EXPECT_EQ(defect_of([](Bricks& bricks) { bricks[1].brick = bricks[0].brick; }),
            MapFileDefect::kCorrupted);
  EXPECT_EQ(defect_of([](Bricks& bricks) { std::swap(bricks[0], bricks[1]); }),
            MapFileDefect::kCorrupted);
  EXPECT_EQ(defect_of([](Bricks& bricks) { bricks[1].voxels = {}; }), MapFileDefect::kCorrupted);
  EXPECT_EQ(defect_of([](Bricks& bricks) { bricks.back().brick.x = Grid::kMaxCell; }),
            MapFileDefect::kCorrupted);
  EXPECT_EQ(defect_of([](Bricks& bricks) {
              bricks[1].voxels =
                  PackedVoxels(BrickMask::all(), std::numeric_limits<float>::infinity());
            }),
            MapFileDefect::kCorrupted);
}

/// A file of version 1 with this content before compression.
std::string makeVersion1(const std::string& content, std::uint64_t num_cuboids,
                         std::uint64_t num_log_odds) {
  std::string bytes = readGolden("version_1.cuboids").substr(0, kFrameIdAt + 3);
  overwrite<std::uint64_t>(bytes, kNumBricksAt, num_cuboids);
  overwrite<std::uint64_t>(bytes, kNumBricksAt + 8, num_log_odds);
  overwrite<std::uint64_t>(bytes, kPayloadBytesAt, content.size());
  // One zstd frame with one uncompressed block, see write_version_2.py.
  std::string frame("\x28\xB5\x2F\xFD\x20\0\0\0\0", 9);
  frame[5] = static_cast<char>(content.size());
  frame[6] = static_cast<char>((content.size() << 3 | 1) & 0xFF);
  frame[7] = static_cast<char>(content.size() >> 5);
  frame += content;
  overwrite<std::uint64_t>(bytes, kCompressedBytesAt, frame.size());
  bytes.resize(bytes.size() + sizeof(std::uint32_t));
  sealHeader(bytes);
  const auto checksum = static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(frame.data()), static_cast<uInt>(frame.size())));
  bytes += frame;
  bytes.resize(bytes.size() + sizeof(checksum));
  overwrite(bytes, bytes.size() - sizeof(checksum), checksum);
  return bytes;
}

TEST(NativeFormat, refusesWhatIsNoMapInVersion1) {
  // Two cuboids of 4 and 1 voxels along x, both of log-odds 1: least x, y, z, sizes, places.
  const std::string one("\0\0\x80\x3F", 4);
  const auto content = [&one](char second_x) {
    std::string columns("\0\0\0\0\0\0\3\0\0\0\0\0\0\0", 14);
    columns[1] = second_x;
    return one + columns;
  };
  const MapSnapshot good = fromNativeFormat(makeVersion1(content(8), 2, 1));
  EXPECT_TRUE(isSame(good.bricks, toBricks({{{{0, 0, 0}, {5, 1, 1}}, 1.0F}}).bricks));
  EXPECT_EQ(defectOf(makeVersion1(content(6), 2, 1)), MapFileDefect::kCorrupted) << "overlap";
  const std::string infinite = std::string("\0\0\x80\x7F", 4) + content(8).substr(4);
  EXPECT_EQ(defectOf(makeVersion1(infinite, 2, 1)), MapFileDefect::kCorrupted);
  EXPECT_EQ(defectOf(makeVersion1(content(8).substr(0, 17), 2, 1)), MapFileDefect::kCorrupted);
  EXPECT_EQ(defectOf(makeVersion1(content(8) + "x", 2, 1)), MapFileDefect::kCorrupted);
  EXPECT_EQ(defectOf(makeVersion1(content(8), 1000, 1)), MapFileDefect::kTooBig);
  // A box of all cells of a map: 2^28 along each axis.
  std::string huge = one;
  const std::string least("\xFF\xFE\xFF\xFF\7", 5);  // The least cell in zigzag code.
  const std::string size("\xFF\xFE\xFF\xFF\7", 5);   // 2^31 - 129
  huge += least + least + least + size + size + size + std::string(1, '\0');
  EXPECT_EQ(defectOf(makeVersion1(huge, 1, 1)), MapFileDefect::kTooBig);
}

}  // namespace
}  // namespace cuboid_mapping
