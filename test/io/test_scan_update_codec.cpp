// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/scan_update_codec.h"

#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/map/mapper.h"
#include "data_sets/scan_dataset.h"
#include "support/map_cuboids.h"
#include "support/random_bricks.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>

namespace cuboid_mapping {
namespace {

using test::Random;
using test::seedNote;

/// The update in which voxels both hit and missed are hits alone, and grazed ones neither.
ScanUpdate tidy(ScanUpdate update) {
  for (BrickUpdate& brick : update.bricks) {
    brick.misses = brick.misses.without(brick.hits);
    brick.grazes = brick.grazes.without(brick.hits | brick.misses);
  }
  return update;
}

void expectSame(const ScanUpdate& a, const ScanUpdate& b, const std::string& note) {
  ASSERT_EQ(a.bricks.size(), b.bricks.size()) << note;
  for (std::size_t i = 0; i < a.bricks.size(); ++i) {
    EXPECT_EQ(a.bricks[i].brick, b.bricks[i].brick) << note;
    EXPECT_EQ(a.bricks[i].hits, b.bricks[i].hits) << note;
    EXPECT_EQ(a.bricks[i].misses, b.bricks[i].misses) << note;
    EXPECT_EQ(a.bricks[i].grazes, b.bricks[i].grazes) << note;
  }
  EXPECT_EQ(a.samples, b.samples) << note;
  EXPECT_EQ(a.num_points, b.num_points) << note;
  EXPECT_EQ(a.num_out_of_range, b.num_out_of_range) << note;
  EXPECT_EQ(a.num_too_far, b.num_too_far) << note;
}

/// Expects equal voxels and cuboids.
void expectSameMap(CuboidMap& a, CuboidMap& b, const std::string& note) {
  const MapSnapshot snapshot_a = takeSnapshot(a, "map");
  const MapSnapshot snapshot_b = takeSnapshot(b, "map");
  ASSERT_EQ(snapshot_a.bricks.size(), snapshot_b.bricks.size()) << note;
  for (std::size_t i = 0; i < snapshot_a.bricks.size(); ++i) {
    EXPECT_EQ(snapshot_a.bricks[i].brick, snapshot_b.bricks[i].brick) << note;
    EXPECT_EQ(snapshot_a.bricks[i].voxels, snapshot_b.bricks[i].voxels) << note;
  }
  EXPECT_EQ(test::cuboidsIn(a, kAllCells), test::cuboidsIn(b, kAllCells)) << note;
}

/// A random scan, sometimes far away, so that bricks are numbered from another cell.
Scan randomScan(Random& random) {
  test::ScanShape shape;
  shape.num_points = random.integer(0, 80);
  shape.num_no_returns = random.integer(0, 20);
  Scan scan = test::randomScan(random, shape);
  if (random.chance(0.2)) scan.points.push_back({1e20F, 0.0F, 0.0F});
  if (random.chance(0.3)) scan.anchor_map.setConstant(1024.0 * random.integer(-50000, 50000));
  return scan;
}

MapperConfig randomConfig(Random& random) {
  MapperConfig config;
  config.map.resolution_m = 0.1;
  config.map.fusion = random.chance(0.5) ? FusionKind::kClass : FusionKind::kGrowth;
  config.map.growth.sampling.per_m = 5.0;
  config.map.environment = random.chance(0.5) ? Environment::kDynamic : Environment::kStatic;
  config.map.threads = random.integer(1, 2);
  if (random.chance(0.3)) config.max_range_m = 2.0;
  if (random.chance(0.3)) config.end_margin_m = 0.5;
  return config;
}

TEST(ScanUpdateCodec, appliedElsewhereIsTheMapOfIntegrate) {
  constexpr int kNumMaps = 60;
  std::size_t num_samples = 0;
  for (int i = 0; i < kNumMaps; ++i) {
    Random random(static_cast<std::uint64_t>(i));
    const MapperConfig config = randomConfig(random);
    Mapper whole(config);
    Mapper walker(config);
    Mapper owner(config);
    for (int scan = random.integer(1, 8); scan > 0; --scan) {
      const Scan points = randomScan(random);
      whole.integrate(points);
      auto received = scanUpdateOfBytes(toBytes(walker.walk(points)));
      ASSERT_TRUE(received) << seedNote(i);
      num_samples += received->samples.size();
      owner.apply(std::move(*received));
    }
    expectSameMap(whole.map(), owner.map(), seedNote(i));
    EXPECT_EQ(walker.map().revision(), 0U) << "walk() leaves the map alone";
  }
  EXPECT_GT(num_samples, 1000U);
}

TEST(ScanUpdateCodec, realScansAppliedElsewhereGiveTheSameMap) {
  const char* folder = std::getenv("CUBOID_DATA_DIR");
  if (folder == nullptr) GTEST_SKIP() << "CUBOID_DATA_DIR is not set";
  const auto scans = openScanDataset(std::string(folder) + "/kitti_0005_city");
  MapperConfig config;
  config.map.resolution_m = 0.2;
  Mapper whole(config);
  Mapper walker(config);
  Mapper owner(config);
  std::size_t num_points = 0;
  std::size_t num_bytes = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const ScanDataset::Item item = scans->read(i);
    const Scan scan =
        makeScan(item.T_map_sensor, item.T_map_sensor.translation(), item.points_sensor);
    whole.integrate(scan);
    const std::string bytes = toBytes(walker.walk(scan));
    num_points += scan.points.size();
    num_bytes += bytes.size();
    owner.apply(scanUpdateOfBytes(bytes).value());
  }
  expectSameMap(whole.map(), owner.map(), "kitti_0005_city");
  EXPECT_LT(static_cast<double>(num_bytes), 0.15 * 12.0 * static_cast<double>(num_points))
      << "of points of x, y and z";
}

TEST(ScanUpdateCodec, bricksOfAnyPatternComeBack) {
  constexpr int kNumUpdates = 300;
  for (int i = 0; i < kNumUpdates; ++i) {
    Random random(static_cast<std::uint64_t>(i));
    ScanUpdate update = test::randomUpdate(random, {{-200, -200, -200}, {200, 200, 200}}, 40);
    for (int count = random.integer(0, 5); count > 0; --count) {
      update.samples.push_back(test::randomCell(random, {{-9, -9, -9}, {9, 9, 9}}));
    }
    if (random.chance(0.5)) {
      for (BrickUpdate& brick : update.bricks) {
        test::markBox(brick.grazes, test::randomBoxInside(random, brickBox(brick.brick)));
      }
    }
    update.num_points = random.index(100000);
    update.num_too_far = random.index(1000);
    const auto received = scanUpdateOfBytes(toBytes(update));
    ASSERT_TRUE(received) << seedNote(i);
    expectSame(*received, tidy(update), seedNote(i));
    const bool has_grazes =
        std::any_of(update.bricks.begin(), update.bricks.end(),
                    [](const auto& b) { return !b.grazes.without(b.hits | b.misses).isEmpty(); });
    EXPECT_EQ(toBytes(update).substr(0, 4), has_grazes ? "CBS4" : "CBS3");
  }
  ASSERT_TRUE(scanUpdateOfBytes(toBytes(ScanUpdate())));
  expectSame(*scanUpdateOfBytes(toBytes(ScanUpdate())), ScanUpdate(), "an empty one");
}

std::string ofHex(std::string_view digits) {
  std::string bytes;
  for (std::size_t i = 0; i < digits.size(); i += 2) {
    bytes += static_cast<char>(std::stoi(std::string(digits.substr(i, 2)), nullptr, 16));
  }
  return bytes;
}

/// A message of version 0.1, whose bricks are numbers on a Morton curve.
std::string oldMessage(bool has_grazes) {
  return ofHex(has_grazes ? "434253320400000002000000350300000000000028b52ffd603502a503008403d20905"
                            "ac02ffffff07e5bedbecb6"
                            "dbedb62b93f6ffe0edb6dbed3686cba4b2dbedb6db0d000303000303030303037c8002"
                            "0406a1108c01011c007c1c"
                            "254101f0003c002f0405c003f000bc1014000fc003f0425002e80e20616010bc002f18"
                            "18042fc00b0606b77a2310"
                            "6185c0b8eb26dc1104cbe4f5"
                          : "434253310400000002000000350200000000000028b52ffd6035018503007403d20905"
                            "ac02ffffff07e5bedbecb6"
                            "dbedb62b93f6ffe0edb6dbed3686cba4b2dbedb6db0d000303000303030303037c0204"
                            "06a1108c01011b004101f0"
                            "003c002f0405c003f000bc1014000fc003f0425002e80e20616010bc002f1818042fc0"
                            "0b0606b77a23106185c0b8"
                            "eb26dc117fa6a1f8");
}

TEST(ScanUpdateCodec, readsMessagesOfOldFormats) {
  for (const bool has_grazes : {false, true}) {
    const std::string bytes = oldMessage(has_grazes);
    ScanUpdate expected;
    for (const Cell& brick : {Cell{-1048, 64, -8}, {-8, 16, 2000}, {0, 0, 0}, {8, 0, 0}}) {
      expected.bricks.push_back({brick, BrickMask::ofBox({brick, brick + Cell{2, 2, 2}}),
                                 BrickMask::ofBox({brick + Cell{2, 0, 1}, brick + Cell{7, 8, 3}})});
      if (!has_grazes) continue;
      expected.bricks.back().grazes =
          BrickMask::ofBox({brick + Cell{7, 0, 0}, brick + Cell{8, 8, 8}});
    }
    expected.samples = {{1, 2, 3}, {-1041, 70, -1}};
    expected.num_points = 1234;
    expected.num_out_of_range = 5;
    expected.num_too_far = 300;
    const auto update = scanUpdateOfBytes(bytes);
    ASSERT_TRUE(update);
    expectSame(*update, expected, bytes.substr(0, 4));
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      std::string damaged = bytes;
      damaged[i] = static_cast<char>(damaged[i] ^ 0x10);
      EXPECT_FALSE(scanUpdateOfBytes(damaged)) << i;
    }
  }
}

TEST(ScanUpdateCodec, keepsBricksInAnyOrderAndAtTheEndsOfTheGrid) {
  ScanUpdate update;
  constexpr std::int32_t kLast = Grid::kMaxCell - kBrickEdge;
  for (const Cell& brick : {Cell{kLast, kLast, kLast},
                            {-Grid::kMaxCell, -Grid::kMaxCell, -Grid::kMaxCell},
                            {kLast, -Grid::kMaxCell, 0},
                            {8, 0, 0},
                            {8, 0, 0}}) {
    update.bricks.push_back({brick, BrickMask::all(), {}});
  }
  const auto received = scanUpdateOfBytes(toBytes(update));
  ASSERT_TRUE(received);
  expectSame(*received, update, "");
}

TEST(ScanUpdateCodec, refusesDamagedBytes) {
  Random random;
  const std::string bytes = toBytes(test::randomUpdate(random, {{-9, -9, -9}, {9, 9, 9}}, 20));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(scanUpdateOfBytes(std::string_view(bytes).substr(0, size))) << size;
  }
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ (1 << random.integer(0, 7)));
    EXPECT_FALSE(scanUpdateOfBytes(damaged)) << i;
  }
  EXPECT_FALSE(scanUpdateOfBytes(bytes + '\0'));
}

/// Bytes with a valid checksum, as an attacker could send.
std::string withChecksum(std::string bytes) {
  const auto size = static_cast<uInt>(bytes.size() - 4);
  const auto checksum = static_cast<std::uint32_t>(
      crc32(crc32(0L, Z_NULL, 0), reinterpret_cast<const Bytef*>(bytes.data()), size));
  for (std::size_t i = 0; i < 4; ++i) bytes[size + i] = static_cast<char>(checksum >> 8 * i);
  return bytes;
}

/// An update of a small area, with grazes in every other one.
ScanUpdate fewBricks(Random& random) {
  ScanUpdate update = test::randomUpdate(random, {{-9, -9, -9}, {9, 9, 9}}, 3);
  if (random.chance(0.5)) update.bricks[0].grazes = BrickMask::all();
  return update;
}

TEST(ScanUpdateCodec, whatHasARightChecksumIsRefusedOrCanBeApplied) {
  Random random;
  MapConfig config;
  std::size_t num_taken = 0;
  std::size_t num_refused = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string bytes =
        random.chance(0.5) ? toBytes(fewBricks(random)) : oldMessage(random.chance(0.5));
    for (int count = random.integer(1, 3); count > 0; --count) {
      bytes[random.index(bytes.size() - 4)] = static_cast<char>(random.bits());
    }
    const auto update = scanUpdateOfBytes(withChecksum(bytes));
    ++(update ? num_taken : num_refused);
    if (!update) continue;
    CuboidMap map(config);
    map.apply(*update);
    EXPECT_FALSE(findFault(takeSnapshot(map, "map"))) << seedNote(i);
  }
  EXPECT_GT(num_taken, 20U);
  EXPECT_GT(num_refused, 1000U);
}

TEST(ScanUpdateCodec, takesNoMoreThanTheLimit) {
  Random random;
  const ScanUpdate update = test::randomUpdate(random, {{-9, -9, -9}, {9, 9, 9}}, 20);
  const std::string bytes = toBytes(update);
  EXPECT_TRUE(scanUpdateOfBytes(bytes, update.bricks.size()));
  EXPECT_FALSE(scanUpdateOfBytes(bytes, update.bricks.size() - 1));
  std::string claim = bytes;
  std::memset(&claim[4], 0xFF, 4);  // Number of bricks.
  EXPECT_FALSE(scanUpdateOfBytes(withChecksum(claim), std::size_t{1} << 40));
}

}  // namespace
}  // namespace cuboid_mapping
