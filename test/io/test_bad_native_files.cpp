// SPDX-License-Identifier: BSD-3-Clause
// Files of the native format that are refused.
#include "cuboid_mapping/io/map_files.h"
#include "support/native_files.h"
#include "tools/run_program.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <fstream>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping {
namespace {

using namespace test;

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
