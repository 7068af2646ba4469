// SPDX-License-Identifier: BSD-3-Clause
// Memory that changes of a map request from the allocator: a measure of work that does not depend on the machine. This is
// a program of its own because it counts calls of operator new.
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/voxels/brick_store.h"
#include "support/counted_memory.h"

#include <gtest/gtest.h>

#include <vector>

namespace cuboid_mapping {
namespace {

/// Bytes that some work requests, also if it frees them.
template <typename WorkT>
std::size_t bytesOf(const WorkT& work) {
  const std::size_t before = test::requested_bytes;
  work();
  return test::requested_bytes - before;
}

VoxelBrick occupiedBrick(const Cell& brick) {
  return {brick, PackedVoxels(BrickMask::all(), 1.0F)};
}

TEST(ChangeMemory, OfEditsBrickByBrickGrowsWithTheMapAndNotWithItsSquare) {
  const auto bytes_of = [](std::int32_t num_edits) {
    return bytesOf([num_edits] {
      CuboidMap map;
      for (std::int32_t i = 0; i < num_edits; ++i) {
        const VoxelBrick brick = occupiedBrick({8 * (i % 200), 8 * (i / 200), 0});
        map.replace(brickBox(brick.brick), std::vector<VoxelBrick>{brick});
      }
    });
  };
  EXPECT_LT(bytes_of(40000), 12 * bytes_of(5000));
}

TEST(ChangeMemory, OfLocksGrowsWithTheirNumberAndNotWithItsSquare) {
  const auto bytes_of = [](std::int32_t num_locks) {
    return bytesOf([num_locks] {
      CuboidMap map;
      for (std::int32_t i = 0; i < num_locks; ++i) {
        map.lock(CellBox::ofCell({2 * (i % 200), 2 * (i / 200), 0}));
      }
    });
  };
  EXPECT_LT(bytes_of(20000), 12 * bytes_of(2500));
}

TEST(ChangeMemory, OfACloudHasNoRoomForACopyOfIt) {
  ScanUpdate update;
  for (std::int32_t i = 0; i < 4096; ++i) {
    update.bricks.push_back({Cell{8 * (i % 64), 8 * (i / 64), 0}, BrickMask::all(), {}});
  }
  sortBricks(update.bricks);
  CuboidMap map;
  for (int i = 0; i < 20; ++i) map.apply(update);  // All voxels are clamped: nothing changes.
  const std::size_t num_bricks = update.bricks.size();
  EXPECT_LT(bytesOf([&] { map.apply(update); }),
            num_bricks * (sizeof(VoxelStore::PendingBrick) + sizeof(BrickUpdate) / 2));
}

TEST(ChangeMemory, OfAnErasedBrickAtTheBoundsIsThatOfOneInside) {
  CuboidMap map;
  std::vector<VoxelBrick> bricks;
  for (std::int32_t i = 0; i < 40000; ++i) {
    bricks.push_back(occupiedBrick({8 * (i % 200), 8 * (i / 200), 0}));
  }
  map.replace(kAllCells, bricks);
  const auto bytes_of = [&](const Cell& brick) {
    return bytesOf([&] { map.replace(brickBox(brick), std::vector<VoxelBrick>()); });
  };
  const std::size_t inside = bytes_of({800, 800, 0});
  EXPECT_LE(bytes_of({0, 0, 0}), inside + 1000);
  EXPECT_LE(bytes_of({1592, 1592, 0}), inside + 1000);
  EXPECT_EQ(map.bounds(), (CellBox{{0, 0, 0}, {1600, 1600, 8}}));
}

}  // namespace
}  // namespace cuboid_mapping
