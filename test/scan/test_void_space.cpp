// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/void_space.h"

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "support/random_bricks.h"
#include "support/voxel_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace cuboid_mapping {
namespace {

using test::Random;

/// Void voxels by the definition of the class, voxel by voxel.
std::set<Cell> findVoid(const ScanUpdate& update) {
  std::set<Cell> passed;
  for (const BrickUpdate& brick : update.bricks) {
    forEachCell(brick.brick, (brick.misses | brick.grazes).without(brick.hits),
                [&](const Cell& cell) { passed.insert(cell); });
  }
  std::set<Cell> found;
  for (const Cell& cell : passed) {
    bool is_void = true;
    test::visitCells({cell - Cell{1, 1, 1}, cell + Cell{2, 2, 2}},
                     [&](const Cell& near) { is_void = is_void && passed.count(near) != 0; });
    if (is_void) found.insert(cell);
  }
  return found;
}

std::set<Cell> cellsOf(const VoidSpace& space) {
  std::set<Cell> cells;
  space.forEach([&](const Cell& brick, const BrickMask& mask) {
    EXPECT_EQ(space.of(brick), mask);
    forEachCell(brick, mask, [&](const Cell& cell) {
      EXPECT_TRUE(space.contains(cell));
      cells.insert(cell);
    });
  });
  return cells;
}

TEST(VoidSpace, IsWhatOneCloudHasPassedWithAllNeighbours) {
  std::size_t num_void = 0;
  for (std::uint64_t i = 0; i < 60; ++i) {
    Random random(i);
    VoidSpace space;
    std::set<Cell> expected;
    for (int cloud = 0; cloud < 3; ++cloud) {
      ScanUpdate update = test::randomUpdate(random, {{-1, -1, -1}, {1, 1, 1}}, 12);
      for (BrickUpdate& brick : update.bricks) {
        if (random.chance(0.6)) brick.misses = BrickMask::all();
        if (random.chance(0.6)) brick.hits = {};
        if (random.chance(0.2)) std::swap(brick.misses, brick.grazes);
      }
      space.add(update);
      expected.merge(findVoid(update));
    }
    EXPECT_EQ(cellsOf(space), expected) << test::seedNote(static_cast<int>(i));
    num_void += expected.size();
  }
  EXPECT_GT(num_void, 10000U);
}

/// The old form took 300, and as long as the map update.
TEST(VoidSpace, LooksUpThreeBricksForEachOfACloud) {
  Random random(4);
  ScanUpdater updater(Grid(0.1));
  test::ScanShape shape;
  shape.num_points = 5000;
  VoidSpace space;
  std::size_t num_bricks = 0;
  std::set<Cell> expected;
  for (int cloud = 0; cloud < 5; ++cloud) {
    const ScanUpdate& update = updater.compute(test::randomScan(random, shape));
    space.add(update);
    num_bricks += update.bricks.size();
    expected.merge(findVoid(update));
  }
  EXPECT_GT(num_bricks, 1000U);
  EXPECT_GT(expected.size(), 1000U);
  EXPECT_LE(space.numLookUps(), 3 * num_bricks);
  EXPECT_EQ(cellsOf(space), expected);
}

TEST(VoidSpace, TakesABrickThatComesTwiceAsOne) {
  VoidSpace space;
  ScanUpdate twice;
  twice.bricks.push_back({{8, 0, 0}, {}, BrickMask::ofBox({{8, 0, 0}, {12, 8, 8}})});
  twice.bricks.push_back({{0, 0, 0}, {}, BrickMask::all()});
  twice.bricks.push_back({{8, 0, 0}, {}, BrickMask::ofBox({{12, 0, 0}, {16, 8, 8}})});
  space.add(twice);
  EXPECT_EQ(cellsOf(space), findVoid(twice));
  EXPECT_EQ(cellsOf(space).size(), 14U * 6U * 6U);
}

/// Beams from (0 0 0) to a wall at x = 2 m, or to a box in front of it, at 0.1 m.
Scan lookAtWall(double wall_m, double box_m) {
  Scan scan;
  scan.origin = {0.05F, 0.05F, 0.05F};
  for (int y = -60; y <= 60; ++y) {
    for (int z = -40; z <= 40; ++z) {
      const double side = 0.01 * y;
      const double up = 0.01 * z;
      const bool meets_box = std::abs(side * box_m) < 0.15;
      const double x = meets_box ? box_m : wall_m;
      scan.points.emplace_back(static_cast<float>(x), static_cast<float>(0.05 + side * x),
                               static_cast<float>(0.05 + up * x));
    }
  }
  return scan;
}

TEST(VoidSpace, AnObjectThatPassesIsInItAndTheWallIsNot) {
  const Grid grid(0.1);
  ScanUpdater updater(grid);
  VoidSpace space;
  space.add(updater.compute(lookAtWall(2.05, 2.05)));
  const ScanUpdate with_object = updater.compute(lookAtWall(2.05, 1.05));
  const ScanUpdate rest = space.withoutMoving(with_object);
  CuboidMap before{[] {
    MapConfig config;
    config.resolution_m = 0.1;
    return config;
  }()};
  before.apply(rest);
  EXPECT_EQ(before.voxels().at({10, 0, 0}), Occupancy::kUnknown) << "no hit, and nothing else";
  EXPECT_EQ(before.voxels().at({5, 0, 0}), Occupancy::kFree) << "before the object";
  EXPECT_EQ(before.voxels().at({20, 6, 0}), Occupancy::kOccupied) << "the wall";
  // A wall that appears one voxel nearer for a while is still the wall.
  for (const Eigen::Vector3f& point : lookAtWall(1.95, 1.95).points) {
    EXPECT_FALSE(space.contains(*grid.toCell(point.cast<double>())));
  }
}

TEST(VoidSpace, IsTakenToAnotherFrameVoxelByVoxel) {
  VoidSpace space;
  ScanUpdate update;
  update.bricks.push_back({{8, 0, 0}, {}, BrickMask::all()});
  space.add(update);
  const std::set<Cell> before = cellsOf(space);
  ASSERT_EQ(before.size(), 6U * 6U * 6U);
  Eigen::Isometry3d T_new_old(Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ()));
  T_new_old.translation() = Eigen::Vector3d(5.0, 0.0, -3.0);
  const VoidSpace moved = space.moved(*VoxelMotion::of(T_new_old, 1.0));
  std::set<Cell> expected;
  for (const Cell& cell : before) expected.insert({4 - cell.y, cell.x, cell.z - 3});
  EXPECT_EQ(cellsOf(moved), expected);
  EXPECT_EQ(cellsOf(moved.moved(*VoxelMotion::of(T_new_old.inverse(), 1.0))), before);
}

/// A cloud that passes all voxels of one brick.
ScanUpdate passing(const Cell& brick) {
  ScanUpdate update;
  update.bricks.push_back({brick, {}, BrickMask::all()});
  return update;
}

TEST(VoidSpace, ForgetsPagesOutsideABoxThatNoneOfTheLastCloudsHasTouched) {
  const std::vector<Cell> bricks = {{-8, 0, 0}, {0, 0, 0}, {56, 56, 56}, {64, 0, 0}, {1000, 0, 0}};
  const auto known = [&](const VoidSpace& space) {
    std::vector<Cell> found;
    for (const Cell& brick : bricks) {
      if (!space.of(brick).isEmpty()) found.push_back(brick);
    }
    EXPECT_EQ(found.size(), space.numBricks());
    return found;
  };
  VoidSpace space;
  for (const Cell& brick : bricks) space.add(passing(brick));
  space.forgetOutside({{63, 0, 0}, {65, 1, 1}}, 5);
  EXPECT_EQ(known(space), bricks) << "all were touched by one of the last five clouds";
  space.forgetOutside({{63, 0, 0}, {65, 1, 1}}, 4);
  EXPECT_EQ(known(space), (std::vector<Cell>{{0, 0, 0}, {56, 56, 56}, {64, 0, 0}, {1000, 0, 0}}))
      << "a page is whole, or goes";
  ScanUpdate hit;
  hit.bricks.push_back({{1008, 0, 0}, BrickMask::all(), {}});
  space.add(hit);
  for (int i = 0; i < 3; ++i) space.add({});
  space.forgetOutside({}, 4);
  EXPECT_EQ(known(space), (std::vector<Cell>{{1000, 0, 0}})) << "a cloud ends in its page";
  space.forgetOutside({}, 0);
  EXPECT_EQ(space.numBricks(), 0U);
}

TEST(VoidSpace, IsAsYoungInAnotherFrame) {
  VoidSpace space;
  space.add(passing({0, 0, 0}));
  for (int i = 0; i < 20; ++i) space.add({});
  const Eigen::Isometry3d T_new_old(Eigen::Translation3d(300.0, 0.0, 0.0));
  VoidSpace moved = space.moved(*VoxelMotion::of(T_new_old, 1.0));
  moved.forgetOutside({}, 1);
  EXPECT_GT(moved.numBricks(), 0U) << "the next cloud may touch it";
  moved.add({});
  moved.forgetOutside({}, 1);
  EXPECT_EQ(moved.numBricks(), 0U);
}

TEST(VoidSpace, LeavesOutMovingHitsThatAnotherSensorHasGrazed) {
  ScanUpdate passed;
  forEachBrick({{-8, -8, -8}, {16, 16, 16}}, [&](const Cell& brick) {
    passed.bricks.push_back({brick, {}, BrickMask::all()});
  });
  VoidSpace space;
  space.add(passed);
  ScanUpdate hit;
  hit.bricks.push_back({{0, 0, 0}, BrickMask::all(), {}, BrickMask::all()});
  EXPECT_TRUE(space.withoutMoving(hit).bricks.empty());
  keepClears(hit);
  EXPECT_TRUE(hit.bricks.empty()) << "neither are they of a sensor that only clears";
}

TEST(VoidSpace, EmptyUpdatesLeaveItEmpty) {
  VoidSpace space;
  space.add(ScanUpdate());
  EXPECT_TRUE(cellsOf(space).empty());
  EXPECT_TRUE(space.withoutMoving(ScanUpdate()).bricks.empty());
  EXPECT_FALSE(space.contains({0, 0, 0}));
}

}  // namespace
}  // namespace cuboid_mapping
