// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/moving_filter.h"

#include <gtest/gtest.h>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::BrickMask;
using cuboid_mapping::BrickUpdate;
using cuboid_mapping::Cell;
using cuboid_mapping::CellBox;
using cuboid_mapping::Occupancy;
using cuboid_mapping::Scan;
using cuboid_mapping::ScanUpdate;

/// In a brick all of whose voxels are passed: inside, and beside another brick.
constexpr Cell kInside{3, 3, 3};
constexpr Cell kAtBorder{0, 3, 3};

/// A cloud that passes a whole brick but for the voxels that it hits.
ScanUpdate passBrick(const std::vector<Cell>& hits = {}) {
  ScanUpdate update;
  BrickUpdate brick;
  brick.misses = BrickMask::all();
  for (const Cell& hit : hits) brick.hits.set(voxelIndex(hit));
  update.bricks.push_back(brick);
  return update;
}

Scan scanTo(const Cell& cell) {
  Scan scan;
  scan.anchor_map = Eigen::Vector3d(1024.0, 0.0, 0.0);
  scan.points.emplace_back(static_cast<float>(cell.x + 0.5 - 1024.0),
                           static_cast<float>(cell.y + 0.5), static_cast<float>(cell.z + 0.5));
  return scan;
}

cuboid_mapping::CuboidMap makeMap() {
  cuboid_mapping::MapConfig config;
  config.resolution_m = 1.0;
  return cuboid_mapping::CuboidMap(config);
}

TEST(MovingFilter, FindsPointsWhereEarlierCloudsSawNothing) {
  MovingFilter filter(1.0, MovingPoints::kPublish);
  EXPECT_TRUE(filter.findMoving({scanTo(kInside)}).empty()) << "nothing is known yet";
  (void)filter.take(passBrick());
  const auto moving = filter.findMoving({scanTo(kAtBorder), scanTo(kInside)});
  ASSERT_EQ(moving.size(), 1U);
  EXPECT_EQ(moving[0], Eigen::Vector3d(3.5, 3.5, 3.5)) << "in the map's frame";
  filter.reset();
  EXPECT_TRUE(filter.findMoving({scanTo(kInside)}).empty());
  (void)filter.take(passBrick({kInside}));
  EXPECT_TRUE(filter.findMoving({scanTo(kInside)}).empty()) << "it has been there ever since";
}

TEST(MovingFilter, LeavesHitsOutOfTheMapOnlyIfAsked) {
  for (const MovingPoints what :
       {MovingPoints::kIgnore, MovingPoints::kPublish, MovingPoints::kLeaveOut}) {
    MovingFilter filter(1.0, what);
    cuboid_mapping::CuboidMap map = makeMap();
    map.apply(filter.take(passBrick()));
    for (int i = 0; i < 5; ++i) map.apply(filter.take(passBrick({kInside, kAtBorder})));
    const bool is_left_out = what == MovingPoints::kLeaveOut;
    EXPECT_EQ(map.voxels().at(kInside), is_left_out ? Occupancy::kFree : Occupancy::kOccupied);
    EXPECT_EQ(map.voxels().at(kAtBorder), Occupancy::kOccupied);
    EXPECT_EQ(filter.voidSpace().contains(kInside), what != MovingPoints::kIgnore);
  }
}

TEST(MovingFilter, FreesWhatHasPassedBeforeButForLockedVoxels) {
  MovingFilter filter(1.0, MovingPoints::kPublish);
  cuboid_mapping::CuboidMap map = makeMap();
  const Cell locked{4, 4, 4};
  for (int i = 0; i < 3; ++i) map.apply(filter.take(passBrick({kInside, kAtBorder, locked})));
  (void)filter.take(passBrick());  // What passed is gone.
  map.lock(CellBox::ofCell(locked));
  EXPECT_EQ(freeVoidVoxels(filter.voidSpace(), map), 1U);
  EXPECT_EQ(map.voxels().logOddsAt(kInside), map.sensorModel().miss());
  EXPECT_EQ(map.voxels().at(kAtBorder), Occupancy::kOccupied);
  EXPECT_EQ(map.voxels().at(locked), Occupancy::kOccupied);
  EXPECT_EQ(freeVoidVoxels(filter.voidSpace(), map), 0U);
}

}  // namespace
}  // namespace cuboid_mapping_ros
