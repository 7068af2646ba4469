// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/native_format.h"

#include "support/snapshots.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>

namespace cuboid_mapping {
namespace {

using test::Random;

// Places in the header, as doc/file_format.md has them.
constexpr std::size_t kVersionAt = 8;
constexpr std::size_t kEnvironmentAt = 12;
constexpr std::size_t kResolutionAt = 16;
constexpr std::size_t kNumCuboidsAt = 56;
constexpr std::size_t kPayloadBytesAt = 72;
constexpr std::size_t kFrameIdBytesAt = 88;
constexpr std::size_t kFrameIdAt = 92;

MapSnapshot goldenSnapshot() {
  MapSnapshot snapshot;
  snapshot.resolution_m = 0.2;
  snapshot.sensor_model = {0.7, 0.4, 0.12, 0.97};
  snapshot.environment = Environment::kStatic;
  snapshot.frame_id = "map";
  snapshot.cuboids = {{{{-8, 0, 8}, {-4, 8, 16}}, -0.5F},
                      {{{0, 0, 0}, {1, 1, 1}}, 0.75F},
                      {{{1, 0, 0}, {8, 1, 1}}, -0.5F},
                      {{{1000000, -1000000, 0}, {1000001, -999000, 300}}, 2.0F}};
  return snapshot;
}

/// Why bytes are refused; fails when they are not.
MapFileDefect defectOf(const std::string& bytes, const NativeFormatLimits& limits = {}) {
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

/// Makes the checksum of the header right again.
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
  std::size_t num_cuboids = 0;
  for (int i = 0; i < kCases; ++i) {
    const Cell offset{8 * random.integer(-100000, 100000), 0, 8 * random.integer(-9, 9)};
    MapSnapshot snapshot = test::randomSnapshot(random, offset);
    const MapSnapshot read = fromNativeFormat(toNativeFormat(snapshot));
    sortCuboids(snapshot.cuboids);
    ASSERT_EQ(read.cuboids, snapshot.cuboids) << test::seedNote(i);
    EXPECT_EQ(read.resolution_m, snapshot.resolution_m);
    EXPECT_TRUE(test::isSameModel(read.sensor_model, snapshot.sensor_model));
    EXPECT_EQ(read.environment, snapshot.environment);
    EXPECT_EQ(read.frame_id, "odom");
    num_cuboids += read.cuboids.size();
  }
  EXPECT_GT(num_cuboids, 10000U);
}

TEST(NativeFormat, doesNotDependOnTheOrderOfCuboids) {
  Random random(32);
  MapSnapshot snapshot = test::randomSnapshot(random);
  const std::string bytes = toNativeFormat(snapshot);
  random.shuffle(snapshot.cuboids);
  EXPECT_EQ(toNativeFormat(snapshot), bytes);
}

TEST(NativeFormat, holdsAnEmptyMapAndTheGreatestCells) {
  MapSnapshot snapshot;
  EXPECT_TRUE(fromNativeFormat(toNativeFormat(snapshot)).cuboids.empty());
  constexpr std::int32_t kMax = Grid::kMaxCell;
  snapshot.cuboids = {{CellBox::ofCell({-kMax, -kMax, -kMax}), -1.0F},
                      {CellBox::ofCell({kMax - 1, kMax - 1, kMax - 1}), 1.0F}};
  EXPECT_EQ(fromNativeFormat(toNativeFormat(snapshot)).cuboids, snapshot.cuboids);
}

TEST(NativeFormat, readsAFileOfVersion1) {
  std::ostringstream bytes;
  bytes << std::ifstream(CUBOID_MAPPING_SOURCE_DIR "/test/data/version_1.cuboids", std::ios::binary)
               .rdbuf();
  ASSERT_GT(bytes.str().size(), 100U);
  const MapSnapshot read = fromNativeFormat(bytes.str());
  const MapSnapshot expected = goldenSnapshot();
  EXPECT_EQ(test::sorted(read.cuboids), test::sorted(expected.cuboids));
  EXPECT_EQ(read.resolution_m, expected.resolution_m);
  EXPECT_TRUE(test::isSameModel(read.sensor_model, expected.sensor_model));
  EXPECT_EQ(read.environment, Environment::kStatic);
  EXPECT_EQ(read.frame_id, "map");
  // The compressed content may differ with the library; all before it may not.
  const std::string now = toNativeFormat(expected);
  EXPECT_EQ(now.substr(0, kPayloadBytesAt), bytes.str().substr(0, kPayloadBytesAt));
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
  overwrite<std::uint64_t>(bytes, kNumCuboidsAt, std::uint64_t{1} << 60);
  sealHeader(bytes);
  EXPECT_EQ(defectOf(bytes), MapFileDefect::kTooBig);
  bytes = good;
  overwrite<std::uint64_t>(bytes, kPayloadBytesAt, std::uint64_t{1} << 60);
  sealHeader(bytes);
  EXPECT_EQ(defectOf(bytes), MapFileDefect::kTooBig);
  MapSnapshot huge = goldenSnapshot();
  huge.cuboids = {{kAllCells, 1.0F}};
  EXPECT_EQ(defectOf(toNativeFormat(huge)), MapFileDefect::kTooBig);
  NativeFormatLimits few;
  few.snapshot.max_bricks = 3;
  EXPECT_EQ(defectOf(good, few), MapFileDefect::kTooBig);
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
  MapSnapshot overlapping = goldenSnapshot();
  overlapping.cuboids.push_back({{{4, 0, 0}, {5, 1, 1}}, 1.0F});
  EXPECT_EQ(defectOf(toNativeFormat(overlapping)), MapFileDefect::kCorrupted);
  MapSnapshot infinite = goldenSnapshot();
  infinite.cuboids[0].log_odds = std::numeric_limits<float>::infinity();
  EXPECT_EQ(defectOf(toNativeFormat(infinite)), MapFileDefect::kCorrupted);
}

}  // namespace
}  // namespace cuboid_mapping
