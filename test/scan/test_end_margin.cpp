// SPDX-License-Identifier: BSD-3-Clause
// Updates with an end margin, or with surfaces that are kept: what a scan grazes.
#include "cuboid_mapping/scan/scan_update.h"

#include "scan/observed_scan.h"
#include "support/random_shapes.h"
#include "support/voxel_map.h"

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <algorithm>
#include <array>
#include <set>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::kNoLimit;
using test::observe;
using test::ObservedCells;
using test::observeWithOctomap;
using test::scanFromVoxelZero;

/// The voxels that a scan grazes.
std::set<Cell> grazesOf(const ScanUpdate& update) {
  std::set<Cell> grazes;
  for (const BrickUpdate& brick : update.bricks) {
    EXPECT_FALSE(isEmpty(brick));
    EXPECT_FALSE(brick.grazes.intersects(brick.hits | brick.misses));
    forEachCell(brick.brick, brick.grazes, [&](const Cell& cell) { grazes.insert(cell); });
  }
  return grazes;
}

TEST(ScanUpdate, grazesTheVoxelsInTheEndMargin) {
  Scan scan = scanFromVoxelZero();
  scan.points = {{6.5F, 0.5F, 0.5F}};
  ScanUpdater updater(Grid(1.0), BeamRanges{kNoLimit, 2.0});
  const ScanUpdate& update = updater.compute(scan);
  EXPECT_EQ(test::toObservedCells(update), (ObservedCells{{{0, 0, 0}, false},
                                                          {{1, 0, 0}, false},
                                                          {{2, 0, 0}, false},
                                                          {{3, 0, 0}, false},
                                                          {{4, 0, 0}, false},
                                                          {{6, 0, 0}, true}}));
  EXPECT_EQ(grazesOf(update), (std::set<Cell>{{5, 0, 0}}));
}

TEST(ScanUpdate, grazesAllOfABeamThatIsShorterThanTheEndMargin) {
  Scan scan = scanFromVoxelZero();
  scan.points = {{0.5F, -1.5F, 0.5F}};
  for (const double margin_m : {2.0, 2.5, 1e6}) {
    ScanUpdater updater(Grid(1.0), BeamRanges{kNoLimit, margin_m});
    const ScanUpdate& update = updater.compute(scan);
    EXPECT_EQ(test::toObservedCells(update), (ObservedCells{{{0, -2, 0}, true}})) << margin_m;
    EXPECT_EQ(grazesOf(update), (std::set<Cell>{{0, 0, 0}, {0, -1, 0}})) << margin_m;
  }
}

TEST(ScanUpdate, grazesTheVoxelOfAnOriginOnABorder) {
  Scan scan = scanFromVoxelZero();
  scan.origin.x() = 1.0F;
  scan.points = {{-1.5F, 0.5F, 0.5F}};
  ScanUpdater updater(Grid(1.0), BeamRanges{kNoLimit, 3.0});
  const ScanUpdate& update = updater.compute(scan);
  EXPECT_EQ(test::toObservedCells(update), (ObservedCells{{{-2, 0, 0}, true}}));
  EXPECT_EQ(grazesOf(update), (std::set<Cell>{{1, 0, 0}, {0, 0, 0}, {-1, 0, 0}}));
}

TEST(ScanUpdate, grazesNothingWhereABeamHasNoReturnOrIsCut) {
  Scan scan = scanFromVoxelZero();
  scan.points = {{9.5F, 0.5F, 0.5F}};
  scan.no_returns = {{0.5F, 3.5F, 0.5F}};
  scan.free_points = {{0.5F, 0.5F, 4.5F}};
  ScanUpdater updater(Grid(1.0), BeamRanges{4.0, 2.0});
  const ScanUpdate& update = updater.compute(scan);
  EXPECT_EQ(test::toObservedCells(update), observe(scan, 4.0));
  EXPECT_TRUE(grazesOf(update).empty());
}

TEST(ScanUpdate, keepsTheEdgeOfAWallThatBeamsWithoutAReturnPass) {
  Scan scan;
  for (float y = -1.0F; y < 1.0F; y += 0.02F) {
    for (float z = -1.0F; z < 1.0F; z += 0.02F) scan.points.emplace_back(4.05F, y, z);
  }
  scan.no_returns = {{10.0F, 0.05F, 2.54F}, {10.0F, 0.05F, 8.0F}};
  const Cell at_edge{40, 0, 10};  // The first beam passes the wall at 1.03 m.
  const Cell behind_edge{60, 0, 15};
  const Cell before_edge{20, 0, 5};
  const Cell far_above{40, 0, 32};
  for (const double max_range_m : {kNoLimit, 8.0}) {
    for (const bool keep_surfaces : {false, true}) {
      BeamRanges ranges{max_range_m};
      ranges.keep_surfaces = keep_surfaces;
      ScanUpdater updater(Grid(0.1), ranges);
      const ScanUpdate& update = updater.compute(scan);
      const std::set<Cell> grazes = grazesOf(update);
      const ObservedCells observed = test::toObservedCells(update);
      for (const Cell& cell : {at_edge, behind_edge}) {
        EXPECT_EQ(grazes.count(cell), keep_surfaces ? 1U : 0U) << max_range_m;
        EXPECT_EQ(observed.count(cell), keep_surfaces ? 0U : 1U) << max_range_m;
      }
      for (const Cell& cell : {before_edge, far_above}) {
        EXPECT_EQ(grazes.count(cell), 0U) << max_range_m;
        EXPECT_EQ(observed.count(cell), 1U) << max_range_m;
      }
    }
  }
}

TEST(ScanUpdate, withAnEndMarginHasTheVoxelsOfAScanWithoutOne) {
  test::Random random(15);
  std::size_t num_voxels = 0;
  std::size_t num_grazes = 0;
  std::size_t num_different = 0;
  for (int round = 0; round < 60; ++round) {
    test::ScanShape shape;
    shape.num_points = random.integer(1, 60);
    const Scan scan = test::randomScan(random, shape);
    const double margin_m = random.real(0.05, 3.0);
    ScanUpdater with(Grid(0.1), BeamRanges{kNoLimit, margin_m}, random.integer(1, 3));
    ScanUpdater without{Grid(0.1)};
    const ObservedCells all = test::toObservedCells(without.compute(scan));
    const ScanUpdate& update = with.compute(scan);
    ObservedCells cells = test::toObservedCells(update);
    for (const auto& [cell, is_hit] : all) {
      if (is_hit) {
        EXPECT_TRUE(cells.at(cell));
      }
    }
    for (const Cell& cell : grazesOf(update)) {
      cells.emplace(cell, false);
      double distance_m = kNoLimit;
      for (const Eigen::Vector3f& end : scan.points) {
        const Eigen::Vector3d center = Grid(0.1).centerOf(CellBox::ofCell(cell));
        distance_m = std::min(distance_m, (end.cast<double>() - center).norm());
      }
      EXPECT_LE(distance_m, margin_m + 0.1) << "half a diagonal of a voxel";
      ++num_grazes;
    }
    for (const auto& [cell, is_hit] : cells) num_different += all.count(cell) == 0 ? 1 : 0;
    for (const auto& [cell, is_hit] : all) num_different += cells.count(cell) == 0 ? 1 : 0;
    num_voxels += all.size();
  }
  EXPECT_GT(num_grazes, 5000U);
  EXPECT_EQ(num_different, 0U) << "of " << num_voxels;
}

/// The voxels of OctoMap's walk to an end, in [0] up to the slab where the margin begins, in [1] those behind it.
std::array<std::vector<Cell>, 2> walkToMargin(const octomap::OcTree& tree, const Scan& scan,
                                              const Eigen::Vector3f& end, double margin_m) {
  const Eigen::Vector3f way = end - scan.origin;
  int axis = 0;
  (void)way.cwiseAbs().maxCoeff(&axis);
  const double length_m = way.norm();
  const Eigen::Vector3d begin =
      scan.origin.cast<double>() + way.cast<double>() * (1.0 - margin_m / length_m);
  const int begin_key = tree.coordToKey(begin[axis]);
  const int direction = way[axis] < 0.0F ? -1 : 1;
  octomap::KeyRay keys;
  EXPECT_TRUE(tree.computeRayKeys({scan.origin.x(), scan.origin.y(), scan.origin.z()},
                                  {end.x(), end.y(), end.z()}, keys));
  std::array<std::vector<Cell>, 2> parts;
  for (const octomap::OcTreeKey& key : keys) {
    const bool is_graze = length_m <= margin_m || direction * (key[axis] - begin_key) > 0;
    parts[is_graze ? 1 : 0].push_back({key[0] - 32768, key[1] - 32768, key[2] - 32768});
  }
  return parts;
}

TEST(ScanUpdate, withAnEndMarginWalksAsOctomapAndGrazesWhereTheMarginHasBegun) {
  test::Random random(16);
  constexpr double kResolution_m = 0.1;
  constexpr double kMaxRange_m = 9.0;
  const octomap::OcTree tree(kResolution_m);
  std::size_t num_grazes = 0;
  for (int round = 0; round < 60; ++round) {
    test::ScanShape shape;
    shape.num_points = random.integer(1, 90);
    shape.half_edge_m = 8.0;
    const Scan scan = test::randomScan(random, shape);
    const double margin_m = random.real(0.05, 3.0);
    Scan cut = scan;  // The beams without a margin.
    cut.points.clear();
    std::set<Cell> misses;
    std::set<Cell> grazes;
    std::set<Cell> hits;
    for (const Eigen::Vector3f& end : scan.points) {
      if ((end - scan.origin).norm() > kMaxRange_m) {
        cut.no_returns.push_back(end);
        continue;
      }
      const auto parts = walkToMargin(tree, scan, end, margin_m);
      misses.insert(parts[0].begin(), parts[0].end());
      grazes.insert(parts[1].begin(), parts[1].end());
      hits.insert(*Grid(kResolution_m).toCell(end.cast<double>()));
    }
    ObservedCells expected = observeWithOctomap(cut, kResolution_m, kMaxRange_m);
    for (const Cell& cell : misses) expected.emplace(cell, false);
    for (const Cell& cell : hits) expected[cell] = true;
    for (const auto& [cell, is_hit] : expected) grazes.erase(cell);

    ScanUpdater updater(Grid(kResolution_m), BeamRanges{kMaxRange_m, margin_m},
                        random.integer(1, 3));
    const ScanUpdate& update = updater.compute(scan);
    EXPECT_EQ(test::toObservedCells(update), expected) << "round " << round;
    EXPECT_EQ(grazesOf(update), grazes) << "round " << round;
    num_grazes += grazes.size();
  }
  EXPECT_GT(num_grazes, 10000U);
}

}  // namespace
}  // namespace cuboid_mapping
