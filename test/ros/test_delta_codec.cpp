// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/delta_codec.h"

#include "cuboid_mapping/map/map_follower.h"
#include "support/modelled_map.h"

#include <gtest/gtest.h>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::MapDelta;
using cuboid_mapping::test::Random;

MapDelta makeSomeDelta() {
  Random random(151);
  const auto model = cuboid_mapping::test::randomMap(random, cuboid_mapping::MapConfig());
  cuboid_mapping::ChangeSet changes;
  changes.boxes = {{{-16, -16, -16}, {16, 16, 16}}, {{0, 0, 0}, {8, 8, 8}}};
  return makeDelta(model.map, changes, 3, 4);
}

bool hasSameArrays(const MapDelta& a, const MapDelta& b) {
  return a.boxes == b.boxes && a.counts == b.counts && a.offsets == b.offsets &&
         a.log_odds == b.log_odds;
}

TEST(DeltaCodec, givesBackWhatWasPackedInLessRoom) {
  const MapDelta delta = makeSomeDelta();
  ASSERT_GT(delta.log_odds.size(), 500U);
  const auto packed = packArrays(delta);
  ASSERT_TRUE(packed.has_value());
  EXPECT_LT(packed->data.size() + 4 * packed->values.size(), 5 * delta.log_odds.size());
  MapDelta unpacked;
  ASSERT_TRUE(unpackArrays(*packed, unpacked));
  EXPECT_TRUE(hasSameArrays(unpacked, delta));

  ASSERT_TRUE(unpackArrays(*packArrays(MapDelta()), unpacked));
  EXPECT_TRUE(hasSameArrays(unpacked, MapDelta())) << "nothing is something, too";
}

TEST(DeltaCodec, canNameMoreThan256Values) {
  MapDelta delta;
  delta.boxes = {0, 0, 0, 8, 8, 8};
  delta.counts = {1000};
  for (int i = 0; i < 1000; ++i) {
    delta.offsets.insert(delta.offsets.end(), {0, 0, 0, 1, 1, 1});
    delta.log_odds.push_back(0.001F * static_cast<float>(i));
  }
  MapDelta unpacked;
  ASSERT_TRUE(unpackArrays(*packArrays(delta), unpacked));
  EXPECT_TRUE(hasSameArrays(unpacked, delta));
  for (int i = 1000; i < 70000; ++i) delta.log_odds.push_back(0.001F * static_cast<float>(i));
  EXPECT_FALSE(packArrays(delta).has_value());
}

TEST(DeltaCodec, refusesDamagedData) {
  const PackedDelta good = *packArrays(makeSomeDelta());
  const auto is_refused = [&good](auto damage) {
    PackedDelta packed = good;
    damage(packed);
    MapDelta delta;
    return !unpackArrays(packed, delta);
  };
  EXPECT_FALSE(is_refused([](PackedDelta&) {}));
  EXPECT_TRUE(is_refused([](PackedDelta& p) { p.data.resize(p.data.size() / 2); }));
  EXPECT_TRUE(is_refused([](PackedDelta& p) { p.data.clear(); }));
  EXPECT_TRUE(is_refused([](PackedDelta& p) { p.data[p.data.size() / 2] ^= 0x55; }));
  EXPECT_TRUE(is_refused([](PackedDelta& p) { ++p.num_cuboids; }));
  EXPECT_TRUE(is_refused([](PackedDelta& p) { --p.num_boxes; }));
  EXPECT_TRUE(is_refused([](PackedDelta& p) { p.num_cuboids = 0xFFFFFFFF; }));
  EXPECT_TRUE(is_refused([](PackedDelta& p) { p.values.pop_back(); }));
}

}  // namespace
}  // namespace cuboid_mapping_ros
