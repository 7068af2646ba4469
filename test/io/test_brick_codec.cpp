// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/packed_bricks.h"

#include "support/modelled_map.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace cuboid_mapping {
namespace {

using test::Random;
using Bricks = std::vector<VoxelBrick>;

Bricks makeSomeBricks(MapDetail detail) {
  Random random(151);
  const auto model = test::randomMap(random, MapConfig());
  ChangeSet changes;
  forEachBrick({{-16, -16, -16}, {16, 16, 16}}, [&changes](const Cell& brick) {
    changes.bricks.push_back({brick, true});
  });
  changes.bricks.push_back({{800, 0, 0}, true});  // A brick without a known voxel.
  return makeDelta(model.map, changes, 3, 4, detail).bricks;
}

bool isSame(const Bricks& a, const Bricks& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const VoxelBrick& one, const VoxelBrick& other) {
                      return one.brick == other.brick && one.voxels == other.voxels;
                    });
}

PackedBricks pack(const Bricks& bricks, MapDetail detail) {
  return packBricks(bricks.data(), bricks.data() + bricks.size(), detail);
}

TEST(BrickCodec, givesBackWhatWasPackedInLessRoom) {
  for (const MapDetail detail : {MapDetail::kClasses, MapDetail::kValues}) {
    const Bricks bricks = makeSomeBricks(detail);
    ASSERT_EQ(bricks.size(), 65U);
    std::size_t num_voxels = 0;
    for (const VoxelBrick& brick : bricks) {
      num_voxels += static_cast<std::size_t>(brick.voxels.known().count());
    }
    const PackedBricks packed = pack(bricks, detail);
    EXPECT_EQ(packed.num_values == 0, detail == MapDetail::kClasses);
    EXPECT_LT(packed.data.size(), (detail == MapDetail::kValues ? num_voxels : 0) + 150 * 65);
    const auto unpacked = unpackBricks(packed);
    ASSERT_TRUE(unpacked);
    EXPECT_TRUE(isSame(*unpacked, bricks));
    const auto nothing = unpackBricks(pack({}, detail));
    ASSERT_TRUE(nothing) << "nothing is something, too";
    EXPECT_TRUE(nothing->empty());
  }
}

TEST(BrickCodec, tellsClassesAloneOfAnyVoxels) {
  const Bricks classes = makeSomeBricks(MapDetail::kClasses);
  const auto unpacked = unpackBricks(pack(makeSomeBricks(MapDetail::kValues), MapDetail::kClasses));
  ASSERT_TRUE(unpacked);
  EXPECT_TRUE(isSame(*unpacked, classes));
}

TEST(BrickCodec, dividesBricksAmongMessages) {
  for (const MapDetail detail : {MapDetail::kClasses, MapDetail::kValues}) {
    const Bricks all = makeSomeBricks(detail);
    const VoxelBrick* const last = all.data() + all.size();
    std::size_t last_num_parts = all.size() + 1;
    for (const std::size_t max_bytes : {0UL, 3000UL, 8000UL, 1UL << 30}) {
      Bricks joined;
      std::size_t num_parts = 0;
      for (const VoxelBrick* first = all.data(); first != last; ++num_parts) {
        const VoxelBrick* const end = endOfPart(first, last, detail, max_bytes);
        ASSERT_GT(end, first);
        const auto part = unpackBricks(packBricks(first, end, detail));
        ASSERT_TRUE(part);
        std::size_t num_bytes = 0;
        for (const VoxelBrick& brick : *part) {
          num_bytes += 70 + (detail == MapDetail::kClasses
                                 ? 64U
                                 : 2 * static_cast<std::size_t>(brick.voxels.known().count()));
        }
        EXPECT_TRUE(num_bytes <= max_bytes || part->size() == 1) << num_bytes;
        joined.insert(joined.end(), part->begin(), part->end());
        first = end;
      }
      EXPECT_TRUE(isSame(joined, all));
      EXPECT_LT(num_parts, last_num_parts) << "fewer, the more fits into one";
      last_num_parts = num_parts;
    }
    EXPECT_EQ(last_num_parts, 1U);
    EXPECT_EQ(endOfPart(last, last, detail, 100), last);
  }
}

TEST(BrickCodec, canNameAnyNumberOfValues) {
  for (const std::size_t num_values : {1U, 127U, 128U, 16384U, 16385U, 70000U}) {
    Bricks bricks;
    std::size_t number = 0;
    for (std::size_t i = 0; i < (num_values + 511) / 512; ++i) {
      VoxelValues values;
      for (float& value : values) value = 0.001F * static_cast<float>(number++ % num_values);
      bricks.push_back(
          {{8 * static_cast<std::int32_t>(i), 0, -8}, PackedVoxels(BrickMask::all(), values)});
    }
    const PackedBricks packed = pack(bricks, MapDetail::kValues);
    EXPECT_EQ(packed.num_values, num_values);
    const auto unpacked = unpackBricks(packed);
    ASSERT_TRUE(unpacked) << num_values;
    EXPECT_TRUE(isSame(*unpacked, bricks)) << num_values;
  }
}

TEST(BrickCodec, refusesDamagedData) {
  for (const MapDetail detail : {MapDetail::kClasses, MapDetail::kValues}) {
    const PackedBricks good = pack(makeSomeBricks(detail), detail);
    const auto is_refused = [&good](auto damage) {
      PackedBricks packed = good;
      damage(packed);
      return !unpackBricks(packed);
    };
    EXPECT_FALSE(is_refused([](PackedBricks&) {}));
    EXPECT_TRUE(is_refused([](PackedBricks& p) { p.data.resize(p.data.size() / 2); }));
    EXPECT_TRUE(is_refused([](PackedBricks& p) { p.data.clear(); }));
    EXPECT_TRUE(is_refused([](PackedBricks& p) { p.data.push_back(0); }));
    EXPECT_TRUE(is_refused([](PackedBricks& p) { p.data[p.data.size() / 2] ^= 0x55; }));
    EXPECT_TRUE(is_refused([](PackedBricks& p) { p.num_values = 0xFFFFFFFF; }));
    EXPECT_TRUE(is_refused([](PackedBricks& p) { p.num_bricks = 0xFFFFFFFF; }));
    EXPECT_TRUE(is_refused([](PackedBricks& p) { p.num_bricks = 0; }));
    EXPECT_TRUE(is_refused([](PackedBricks& p) { ++p.num_values; }));
    EXPECT_TRUE(is_refused([](PackedBricks& p) { p.has_values = !p.has_values; }));
  }
}

}  // namespace
}  // namespace cuboid_mapping
