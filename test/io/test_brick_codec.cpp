// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/brick_codec.h"

#include "cuboid_mapping/sharing/map_follower.h"
#include "support/modelled_map.h"

#include <gtest/gtest.h>

namespace cuboid_mapping {
namespace {

using test::Random;

BrickArrays makeSomeBricks(MapDetail detail) {
  Random random(151);
  const auto model = test::randomMap(random, MapConfig());
  ChangeSet changes;
  changes.addCuboidsIn({{-16, -16, -16}, {16, 16, 16}});
  changes.addCuboidsIn({{800, 0, 0}, {808, 8, 8}});  // Nothing is known there.
  return makeDelta(model.map, changes, 3, 4, detail).content;
}

bool isSame(const BrickArrays& a, const BrickArrays& b) {
  return a.bricks == b.bricks && a.counts == b.counts && a.bounds == b.bounds &&
         a.occupied == b.occupied && a.has_values == b.has_values && a.values == b.values;
}

std::size_t numBytes(const PackedBricks& packed) {
  return packed.data.size() + packed.values.size() * sizeof(float);
}

TEST(BrickCodec, givesBackWhatWasPackedInLessRoom) {
  for (const MapDetail detail : {MapDetail::kClasses, MapDetail::kValues}) {
    const BrickArrays arrays = makeSomeBricks(detail);
    ASSERT_GT(arrays.occupied.size(), 500U);
    ASSERT_EQ(arrays.has_values, detail == MapDetail::kValues);
    ASSERT_EQ(arrays.values.empty(), detail == MapDetail::kClasses);
    const PackedBricks packed = packBricks(arrays);
    EXPECT_LT(numBytes(packed), 5 * arrays.occupied.size() + arrays.values.size());
    BrickArrays unpacked;
    ASSERT_TRUE(unpackBricks(packed, unpacked));
    EXPECT_TRUE(isSame(unpacked, arrays));

    ASSERT_TRUE(unpackBricks(packBricks(BrickArrays()), unpacked));
    EXPECT_TRUE(isSame(unpacked, BrickArrays())) << "nothing is something, too";
  }
}

TEST(BrickCodec, dividesBricksAmongMessages) {
  for (const MapDetail detail : {MapDetail::kClasses, MapDetail::kValues}) {
    const BrickArrays all = makeSomeBricks(detail);
    std::size_t last_num_parts = all.counts.size() + 1;
    for (const std::size_t max_bytes : {0UL, 3000UL, 10000UL, 1UL << 30}) {
      BrickSplitter splitter(all, max_bytes);
      BrickArrays joined;
      joined.has_values = all.has_values;
      std::size_t num_parts = 0;
      while (!splitter.isDone()) {
        const BrickArrays part = splitter.next();
        const std::size_t num_bytes =
            14 * part.counts.size() + 7 * part.occupied.size() + 2 * part.values.size();
        EXPECT_TRUE(num_bytes <= max_bytes || part.counts.size() == 1) << num_bytes;
        BrickArrays unpacked;
        ASSERT_TRUE(unpackBricks(packBricks(part), unpacked));
        appendBricks(unpacked, joined);
        ++num_parts;
      }
      EXPECT_TRUE(isSame(joined, all));
      EXPECT_LT(num_parts, last_num_parts) << "fewer, the more fits into one";
      last_num_parts = num_parts;
    }
    EXPECT_EQ(last_num_parts, 1U);
  }
  const BrickArrays nothing;
  EXPECT_TRUE(BrickSplitter(nothing, 100).isDone());
}

TEST(BrickCodec, canNameAnyNumberOfValues) {
  for (const std::size_t num_values : {1U, 256U, 257U, 65536U, 65537U, 70000U}) {
    BrickArrays arrays;
    arrays.has_values = true;
    for (std::size_t i = 0; i < (num_values + 511) / 512; ++i) {
      arrays.bricks.insert(arrays.bricks.end(), {8 * static_cast<std::int32_t>(i), 0, -8});
      arrays.counts.push_back(1);
      arrays.bounds.insert(arrays.bounds.end(), {0, 0, 0, 8, 8, 8});
      arrays.occupied.push_back(1);
    }
    for (std::size_t i = 0; i < 512 * arrays.counts.size(); ++i) {
      arrays.values.push_back(0.001F * static_cast<float>(i % num_values));
    }
    const PackedBricks packed = packBricks(arrays);
    EXPECT_EQ(packed.values.size(), num_values);
    BrickArrays unpacked;
    ASSERT_TRUE(unpackBricks(packed, unpacked)) << num_values;
    EXPECT_TRUE(isSame(unpacked, arrays)) << num_values;
  }
}

TEST(BrickCodec, refusesDamagedData) {
  for (const MapDetail detail : {MapDetail::kClasses, MapDetail::kValues}) {
    const PackedBricks good = packBricks(makeSomeBricks(detail));
    const auto is_refused = [&good](auto damage) {
      PackedBricks packed = good;
      damage(packed);
      BrickArrays arrays;
      return !unpackBricks(packed, arrays);
    };
    EXPECT_FALSE(is_refused([](PackedBricks&) {}));
    EXPECT_TRUE(is_refused([](PackedBricks& p) { p.data.resize(p.data.size() / 2); }));
    EXPECT_TRUE(is_refused([](PackedBricks& p) { p.data.clear(); }));
    EXPECT_TRUE(is_refused([](PackedBricks& p) { p.data.push_back(0); }));
    EXPECT_TRUE(is_refused([](PackedBricks& p) { p.data[p.data.size() / 2] ^= 0x55; }));
    EXPECT_TRUE(is_refused([](PackedBricks& p) { p.num_cuboids = 0xFFFFFFFF; }));
    EXPECT_TRUE(is_refused([](PackedBricks& p) { p.num_bricks = 0xFFFFFFFF; }));
    if (detail == MapDetail::kValues) {
      EXPECT_TRUE(is_refused([](PackedBricks& p) { p.values.pop_back(); }));
      EXPECT_TRUE(is_refused([](PackedBricks& p) { p.has_values = false; }));
    } else {
      EXPECT_TRUE(is_refused([](PackedBricks& p) { ++p.num_cuboids; }));
      EXPECT_TRUE(is_refused([](PackedBricks& p) { --p.num_bricks; }));
    }
  }
}

/// What is wrong in its counts alone is noticed by the one who takes it: the number of voxels follows
/// from the cuboids.
TEST(BrickCodec, leavesCountsThatDoNotFitToTheFollower) {
  PackedBricks packed = packBricks(makeSomeBricks(MapDetail::kValues));
  ++packed.num_cuboids;
  cuboid_mapping::MapImage image;
  image.resolution_m = 0.1;
  cuboid_mapping::MapFollower follower;
  EXPECT_FALSE(unpackBricks(packed, image.content) && follower.take(image));
  EXPECT_EQ(follower.map(), nullptr);
}

}  // namespace
}  // namespace cuboid_mapping
