// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/paper_grid.h"

#include "support/random.h"
#include "support/tree_invariants.h"

#include "evaluation/rtree.h"

#include <gtest/gtest.h>

#include <set>

namespace cuboid_mapping::bench::test {
namespace {

const SensorModel kModel(SensorModelConfig(), Environment::kStatic);

/// A grid in which these voxels of the brick at the origin are stable and free.
PaperGrid makeGrid(const PaperReading& reading, const std::vector<Cell>& free) {
  PaperGrid grid(kModel, {4, 2}, reading);
  ScanUpdate update;
  update.bricks.push_back({});
  for (const Cell& voxel : free) update.bricks.front().misses.set(voxelIndex(voxel));
  for (int i = 0; i < 5; ++i) grid.update(update);  // Five misses of 0.4 give less than alpha_min.
  return grid;
}

std::set<Cell> leastVoxelsOf(const PaperGrid& grid, const Cell& size) {
  std::set<Cell> cells;
  visitAll(grid.tree(), CuboidFilter::kAll, [&](const Cuboid& cell) {
    if (cell.box.size() == size) cells.insert(cell.box.min);
    return Visit::kContinue;
  });
  return cells;
}

const std::vector<Cell> kRowOfSix{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}, {5, 0, 0}};
const Cell kStart{0, 0, 0};

TEST(PaperGrid, DoublesItsWidthAsEquation5IsWritten) {
  PaperGrid grid = makeGrid({}, kRowOfSix);
  grid.fuse({kStart});
  EXPECT_EQ(grid.tree().size(), 3U);
  EXPECT_EQ(leastVoxelsOf(grid, {4, 1, 1}), std::set<Cell>{kStart});
}

TEST(PaperGrid, GrowsByOneVoxelWhenSoRead) {
  PaperGrid grid = makeGrid({true, true, GrowthStep::kCell}, kRowOfSix);
  grid.fuse({{2, 0, 0}});
  EXPECT_EQ(leastVoxelsOf(grid, {6, 1, 1}), std::set<Cell>{kStart});
  EXPECT_EQ(grid.tree().size(), 1U);
}

TEST(PaperGrid, CoversUnknownVoxelsOnlyWhenCellsNeedNotFillTheExpandedOne) {
  const std::vector<Cell> with_gap{{0, 0, 0}, {1, 0, 0}, {3, 0, 0}};
  PaperGrid full = makeGrid({}, with_gap);
  full.fuse({kStart});
  EXPECT_EQ(full.tree().size(), 2U);
  EXPECT_EQ(full.numVoxels(), 3.0);
  PaperGrid gaps = makeGrid({false, true, GrowthStep::kOwnWidth}, with_gap);
  gaps.fuse({kStart});
  EXPECT_EQ(gaps.tree().size(), 1U);
  EXPECT_EQ(gaps.numVoxels(), 4.0);
}

TEST(PaperGrid, TriesTheLongestSideOrTheLargestFaceFirst) {
  const std::vector<Cell> corner{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  PaperGrid along = makeGrid({}, corner);
  along.fuse({kStart});
  EXPECT_EQ(leastVoxelsOf(along, {4, 1, 1}), std::set<Cell>{kStart});
  PaperGrid across = makeGrid({true, false, GrowthStep::kOwnWidth}, corner);
  across.fuse({kStart});
  EXPECT_EQ(leastVoxelsOf(across, {2, 2, 1}), std::set<Cell>{kStart});
}

TEST(PaperGrid, LeavesCellsAloneThatAreStableOrOfTheOtherClass) {
  PaperGrid grid = makeGrid({}, kRowOfSix);
  ScanUpdate hits;
  hits.bricks.push_back({});
  hits.bricks.front().hits.set(voxelIndex(kStart));
  hits.bricks.front().hits.set(voxelIndex({6, 0, 0}));
  for (int i = 0; i < 10; ++i) grid.update(hits);
  grid.fuse({{4, 0, 0}, {6, 0, 0}});
  EXPECT_EQ(grid.tree().size(), 4U) << "0, 1, 2 to 5, and 6, which is occupied";
  visitCell(grid.tree(), kStart, [](const Cuboid& cell) {
    EXPECT_FALSE(cell.isOccupied());
    return Visit::kStop;
  });
}

TEST(PaperGrid, HoldsEveryObservedVoxelOnceWhenGapFree) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    cuboid_mapping::test::Random random(seed);
    PaperGrid grid(kModel, {4, 2},
                   {true, seed % 2 == 0, seed % 4 < 2 ? GrowthStep::kOwnWidth : GrowthStep::kCell});
    BrickMask seen;
    for (int cloud = 0; cloud < 20; ++cloud) {
      ScanUpdate update;
      update.bricks.push_back({});
      for (int i = 0; i < 300; ++i) {
        const auto voxel = static_cast<int>(random.integer(0, 511));
        (i < 30 ? update.bricks.front().hits : update.bricks.front().misses).set(voxel);
        seen.set(voxel);
      }
      grid.update(update);
      grid.fuse(startersOf(update));
      EXPECT_EQ(checkTree(grid.tree()), std::vector<std::string>());
    }
    EXPECT_EQ(checkDisjoint(grid.tree()), std::vector<std::string>());
    EXPECT_EQ(grid.numVoxels(), static_cast<double>(seen.count()));
    EXPECT_LT(grid.tree().size(), static_cast<std::size_t>(seen.count()));
  }
}

}  // namespace
}  // namespace cuboid_mapping::bench::test
