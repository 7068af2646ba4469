// SPDX-License-Identifier: BSD-3-Clause
// Work for whole bricks, in counts: they are copied, not encoded again, and not divided before they are read.
#include "cuboid_mapping/boxes/joined_cuboids.h"
#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/sharing/map_follower.h"
#include "cuboid_mapping/voxels/brick_store.h"
#include "support/modelled_map.h"
#include "support/snapshots.h"

#include <gtest/gtest.h>

#include <vector>

namespace cuboid_mapping {
namespace {

using test::Random;

/// Bricks that some work encodes.
template <typename WorkT>
std::uint64_t numEncodedBy(const WorkT& work) {
  const std::uint64_t before = PackedVoxels::numEncoded();
  work();
  return PackedVoxels::numEncoded() - before;
}

std::size_t numDivided(const CuboidMap& map) {
  std::size_t count = 0;
  map.voxels().bricks().forEach([&](const Brick& brick) {
    if (!brick.cuboids.isStale()) ++count;
  });
  return count;
}

CuboidMap someMap() {
  Random random(131);
  CuboidMap map;
  for (int i = 0; i < 20; ++i) {
    map.apply(test::randomUpdate(random, {{-4, -4, -4}, {4, 4, 4}}, 40));
  }
  EXPECT_GT(map.voxels().size(), 200U);
  EXPECT_EQ(numDivided(map), map.voxels().size()) << "clouds divide the bricks that they change";
  return map;
}

TEST(CopiedBricks, areNotEncodedAgainByASnapshot) {
  const CuboidMap map = someMap();
  CuboidMap restored;
  EXPECT_EQ(numEncodedBy([&] { restoreSnapshot(takeSnapshot(map, "map"), restored); }), 0U);
  EXPECT_EQ(numDivided(restored), 0U);
  EXPECT_EQ(test::voxelsOf(restored), test::voxelsOf(map));
  EXPECT_EQ(test::allCuboids(restored), test::allCuboids(map));
}

TEST(CopiedBricks, areNotEncodedAgainByAFollower) {
  CuboidMap map = someMap();
  MapFollower follower;
  EXPECT_EQ(
      numEncodedBy([&] { EXPECT_TRUE(follower.take(makeImage(map, 1, MapDetail::kValues))); }), 0U);
  Random random(132);
  const std::uint64_t base = map.revision();
  const ChangeSet changes = map.apply(test::randomUpdate(random, {{-6, -6, -6}, {4, 4, 4}}, 60));
  ASSERT_GT(changes.bricks.size(), 20U);
  const MapDelta delta = makeDelta(map, changes, 1, base, MapDetail::kValues);
  const std::uint64_t revision = follower.map()->revision();
  EXPECT_EQ(numEncodedBy([&] { EXPECT_EQ(follower.take(delta), FollowResult::kApplied); }), 0U);
  EXPECT_EQ(follower.map()->revision(), revision + 1) << "one change, not one for each brick";
  EXPECT_EQ(numDivided(*follower.map()), 0U);
  EXPECT_EQ(test::voxelsOf(*follower.map()), test::voxelsOf(map));
  EXPECT_EQ(test::allCuboids(*follower.map()), test::allCuboids(map));
}

TEST(CopiedBricks, areDividedOnceByTheFirstOneWhoJoinsTheirCuboids) {
  CuboidMap restored;
  restoreSnapshot(takeSnapshot(someMap(), "map"), restored);
  const CellBox whole_bricks{{-24, -24, -24}, {24, 24, 24}};
  const CellBox part{{-25, -25, -25}, {25, 25, 25}};
  EXPECT_FALSE(joinCuboids(restored, part, CuboidFilter::kAll, Budget::unlimited()).value.empty());
  EXPECT_EQ(numDivided(restored), restored.voxels().copyIn(whole_bricks).size())
      << "bricks that the box cuts are not divided as a whole";
  EXPECT_FALSE(
      joinCuboids(restored, kAllCells, CuboidFilter::kAll, Budget::unlimited()).value.empty());
  EXPECT_EQ(numDivided(restored), restored.voxels().size());
}

TEST(CopiedBricks, ofAnEditAreEncodedOnlyWhereItsFacesCutThem) {
  const std::vector<VoxelBrick> bricks = someMap().voxels().copyIn(kAllCells);
  CuboidMap edited = someMap();
  edited.replace(kAllCells, {UniformBox{{{-64, -64, -64}, {64, 64, 64}}, -1.0F}});
  const CellBox box{{-16, -16, -17}, {16, 16, 16}};  // The lowest layer of 16 bricks is cut.
  const std::uint64_t num_encoded = numEncodedBy([&] { edited.replace(box, bricks); });
  EXPECT_GT(num_encoded, 0U);
  EXPECT_LE(num_encoded, 16U);
}

TEST(CopiedBricks, takeThePlaceOfTheirOwnAndOfNoOthers) {
  CuboidMap map;
  map.replace(kAllCells, {UniformBox{{{0, 0, 0}, {24, 8, 8}}, -1.0F}});
  const PackedVoxels wall(BrickMask::all(), 1.0F);
  const ChangeSet changes = map.replace({VoxelBrick{{0, 0, 0}, {}}, VoxelBrick{{8, 0, 0}, {}},
                                         VoxelBrick{{8, 0, 0}, wall}, VoxelBrick{{-8, 0, 0}, {}}});
  EXPECT_EQ(map.revision(), 2U);
  EXPECT_EQ(changes.bricks.size(), 2U);
  EXPECT_EQ(test::allCuboids(map),
            (std::vector<Cuboid>{{{{8, 0, 0}, {16, 8, 8}}, Occupancy::kOccupied},
                                 {{{16, 0, 0}, {24, 8, 8}}, Occupancy::kFree}}));
  EXPECT_EQ(checkMap(map), std::vector<std::string>{});
  EXPECT_TRUE(map.replace({VoxelBrick{{8, 0, 0}, wall}}).bricks.empty());
  EXPECT_EQ(map.revision(), 2U) << "the voxels are there already";
}

}  // namespace
}  // namespace cuboid_mapping
