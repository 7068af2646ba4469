// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/moving_filter.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::BrickMask;
using cuboid_mapping::BrickUpdate;
using cuboid_mapping::Cell;
using cuboid_mapping::CellBox;
using cuboid_mapping::Occupancy;
using cuboid_mapping::Scan;
using cuboid_mapping::ScanUpdate;

/// Voxel inside a brick all of whose voxels are passed, and one beside another brick.
constexpr Cell kInside{3, 3, 3};
constexpr Cell kAtBorder{0, 3, 3};

/// A cloud that passes a whole brick except the voxels that it hits.
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

/// Drives along x, 8 voxels per cloud, through the bricks of passBrick().
std::size_t driveAlong(int num_clouds, MovingFilter& filter) {
  std::size_t most = 0;
  for (int i = 0; i < num_clouds; ++i) {
    ScanUpdate update = passBrick();
    update.bricks.front().brick.x = 8 * i;
    (void)filter.take(update, Eigen::Vector3d(8.0 * i, 0.0, 0.0));
    most = std::max(most, filter.voidSpace().numBricks());
  }
  return most;
}

TEST(MovingFilter, ForgetsWithAWindowWhatIsFarAway) {
  WindowParameters window;
  EXPECT_FALSE(window.isOn());
  MovingFilter without(1.0, MovingPoints::kPublish, window);
  EXPECT_EQ(driveAlong(1000, without), 1000U);
  window.frame_id = "base";
  window.config.size_m = 200.0;
  window.config.margin_m = 20.0;
  for (const auto outside :
       {cuboid_mapping::OutsideWindow::kKeep, cuboid_mapping::OutsideWindow::kForget,
        cuboid_mapping::OutsideWindow::kRefuse}) {
    window.config.outside = outside;
    MovingFilter filter(1.0, MovingPoints::kPublish, window);
    // Range behind the robot: half of the window, the margin, and a page that is cut.
    EXPECT_LE(driveAlong(1000, filter), (100U + 20U + 64U) / 8U + 1U);
    const Cell last{999 * 8 + 3, 3, 3};
    EXPECT_EQ(filter.findMoving({scanTo(last)}).size(), 1U);
    EXPECT_TRUE(filter.findMoving({scanTo(kInside)}).empty()) << "it has to be seen empty again";
    (void)filter.take(passBrick(), Eigen::Vector3d::Zero());
    EXPECT_EQ(filter.findMoving({scanTo(kInside)}).size(), 1U);
  }
}

TEST(MovingFilter, KeepsOutsideTheWindowWhatCloudsTouchUnlessThatIsRefused) {
  WindowParameters window;
  window.frame_id = "base";
  window.config.size_m = 10.0;
  const Eigen::Vector3d far_away(5000.0, 0.0, 0.0);
  for (const bool is_refused : {false, true}) {
    window.config.outside = is_refused ? cuboid_mapping::OutsideWindow::kRefuse
                                       : cuboid_mapping::OutsideWindow::kForget;
    MovingFilter filter(1.0, MovingPoints::kPublish, window);
    (void)filter.take(passBrick(), far_away);
    EXPECT_EQ(filter.voidSpace().contains(kInside), !is_refused);
    for (int i = 0; i < 20; ++i) (void)filter.take(passBrick({kAtBorder}), far_away);
    EXPECT_EQ(filter.voidSpace().contains(kInside), !is_refused);
    for (int i = 0; i < 10; ++i) (void)filter.take({}, far_away);
    EXPECT_FALSE(filter.voidSpace().contains(kInside));
  }
}

TEST(MovingFilter, FreesWhatHasPassedBeforeButForLockedVoxels) {
  MovingFilter filter(1.0, MovingPoints::kPublish);
  cuboid_mapping::CuboidMap map = makeMap();
  const Cell locked{4, 4, 4};
  for (int i = 0; i < 3; ++i) map.apply(filter.take(passBrick({kInside, kAtBorder, locked})));
  (void)filter.take(passBrick());  // The object is gone.
  map.lock(CellBox::ofCell(locked));
  EXPECT_EQ(freeVoidVoxels(filter.voidSpace(), map), 1U);
  EXPECT_EQ(map.voxels().logOddsAt(kInside), map.sensorModel().miss());
  EXPECT_EQ(map.voxels().at(kAtBorder), Occupancy::kOccupied);
  EXPECT_EQ(map.voxels().at(locked), Occupancy::kOccupied);
  EXPECT_EQ(freeVoidVoxels(filter.voidSpace(), map), 0U);
}

}  // namespace
}  // namespace cuboid_mapping_ros
