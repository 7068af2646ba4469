// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/scan_update.h"

#include "scan/observed_scan.h"
#include "support/random_shapes.h"
#include "support/voxel_map.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::kNoLimit;
using test::observe;
using test::ObservedCells;
using test::observeWithOctomap;
using test::scanFromVoxelZero;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Beams to the ground: a beam that passes the end of another still frees that voxel.
TEST(ScanUpdate, ofOpenEndsLeavesTheirVoxelsAlone) {
  test::Random random(95);
  for (const int threads : {1, 3}) {
    Scan scan;
    scan.origin = {0.05F, 0.05F, 1.25F};
    for (int i = 0; i < 3000; ++i) {
      scan.open_ends.emplace_back(static_cast<float>(random.real(-9, 9)),
                                  static_cast<float>(random.real(-3, 3)),
                                  static_cast<float>(random.real(0.0, 0.09)));
    }
    scan.points = {{2.0F, 1.0F, 0.5F}};
    ScanUpdater updater(Grid(0.1), 8.0, threads);
    const ScanUpdate& update = updater.compute(scan);
    EXPECT_EQ(update.num_points, 3001U);
    EXPECT_EQ(test::toObservedCells(update), observeWithOctomap(scan, 0.1, 8.0));
  }
}

TEST(ScanUpdate, ofAnOpenEndWithAMarginLeavesItsVoxelAlone) {
  for (const double margin_m : {0.2, 0.8, 1.5, 9.0}) {
    Scan scan = scanFromVoxelZero();
    scan.open_ends = {{4.4F, 0.5F, 0.5F}};
    ScanUpdater updater(Grid(1.0), BeamRanges{kNoLimit, margin_m});
    const auto& bricks = updater.compute(scan).bricks;
    ASSERT_EQ(bricks.size(), 1U);
    EXPECT_TRUE(bricks[0].hits.isEmpty());
    const BrickMask seen = bricks[0].misses | bricks[0].grazes;
    for (int x = 0; x < 8; ++x) EXPECT_EQ(seen.test(x), x < 4) << x << ", margin " << margin_m;
  }
}

TEST(ScanUpdate, ofScansFromSeveralPlacesIsOneObservation) {
  test::Random random(94);
  for (int round = 0; round < 50; ++round) {
    std::vector<Scan> scans;
    ObservedCells expected;
    for (int i = random.integer(1, 6); i > 0; --i) {
      const auto place = [&random] {
        return Eigen::Vector3f(static_cast<float>(random.real(-300, 300)),
                               static_cast<float>(random.real(-300, 300)),
                               static_cast<float>(random.real(-30, 30)));
      };
      scans.emplace_back();
      scans.back().origin = place();
      for (int k = random.integer(0, 30); k > 0; --k) scans.back().points.push_back(place());
      for (int k = random.integer(0, 5); k > 0; --k) scans.back().no_returns.push_back(place());
      for (const auto& [cell, is_hit] : observe(scans.back(), 200.0)) {
        bool& is_united_hit = expected[cell];
        is_united_hit = is_united_hit || is_hit;
      }
    }
    ScanUpdater updater(Grid(1.0), 200.0, random.integer(1, 3));
    const ScanUpdate& update = updater.compute(scans.data(), scans.size());
    EXPECT_EQ(test::toObservedCells(update), expected);
    EXPECT_TRUE(isOrdered(update.bricks));
  }
}

TEST(ScanUpdate, ofScansTooFarApartHasThoseNearTheFirst) {
  std::vector<Scan> scans(3, scanFromVoxelZero());
  for (Scan& scan : scans) scan.points = {{2.5F, 0.5F, 0.5F}};
  scans[1].anchor_map.x() = 5e6;
  scans[2].anchor_map.x() = 4e6;
  ScanUpdater updater{Grid(1.0)};
  const ScanUpdate& update = updater.compute(scans.data(), scans.size());
  EXPECT_EQ(update.num_points, 2U);
  EXPECT_EQ(update.num_too_far, 1U);
  const ObservedCells cells = test::toObservedCells(update);
  EXPECT_EQ(cells.size(), 6U);
  EXPECT_TRUE(cells.at({4000002, 0, 0}));
}

TEST(ScanUpdate, aFreePointMissesItsVoxelUnlessABeamHitsIt) {
  Scan scan = scanFromVoxelZero();
  scan.points = {{2.5F, 0.5F, 0.5F}};
  scan.free_points = {{-9.5F, 30.5F, 4.5F},
                      {2.2F, 0.1F, 0.9F},
                      {0.5F, 0.5F, 0.5F},
                      {7e4F, 0, 0},
                      {kInfinity, 0, 0}};
  const ObservedCells expected{
      {{0, 0, 0}, false}, {{1, 0, 0}, false}, {{2, 0, 0}, true}, {{-10, 30, 4}, false}};
  EXPECT_EQ(observe(scan), expected);
  EXPECT_EQ(observe(scan, 1.5).count({-10, 30, 4}), 1U) << "a max range is of beams";
}

TEST(ScanUpdate, endsWhenItIsCancelledAndTheNextOneIsWhole) {
  test::Random random(96);
  Scan scan;
  for (int i = 0; i < 3000; ++i) {
    scan.points.push_back(test::randomPoint(random, 5.0).cast<float>());
  }
  for (const ColumnUse use : {ColumnUse::kNever, ColumnUse::kAlways}) {
    std::atomic<bool> is_cancelled{true};
    ScanUpdater updater(Grid(0.1), 8.0, 2);
    updater.setColumnUse(use);
    updater.cancelWhen(is_cancelled);
    EXPECT_THROW((void)updater.compute(scan), std::runtime_error);
    is_cancelled = false;
    EXPECT_EQ(test::toObservedCells(updater.compute(scan)), observeWithOctomap(scan, 0.1, 8.0));
  }
}

TEST(ScanUpdate, missesTheVoxelsBeforeTheEndAndHitsTheEnd) {
  Scan scan = scanFromVoxelZero();
  scan.points = {{3.5F, 0.5F, 0.5F}};
  const ObservedCells expected{
      {{0, 0, 0}, false}, {{1, 0, 0}, false}, {{2, 0, 0}, false}, {{3, 0, 0}, true}};
  EXPECT_EQ(observe(scan), expected);
}

TEST(ScanUpdate, onlyHitsTheOriginsVoxelWhenTheBeamEndsInIt) {
  Scan scan = scanFromVoxelZero();
  scan.points = {{0.9F, 0.1F, 0.5F}};
  EXPECT_EQ(observe(scan), (ObservedCells{{{0, 0, 0}, true}}));
  scan.points = {scan.origin};
  EXPECT_EQ(observe(scan), (ObservedCells{{{0, 0, 0}, true}})) << "a beam of no length";
}

TEST(ScanUpdate, missesTheVoxelWhereABeamIsCutAndHitsNone) {
  Scan scan = scanFromVoxelZero();
  scan.points = {{9.5F, 0.5F, 0.5F}};
  const ObservedCells expected{{{0, 0, 0}, false}, {{1, 0, 0}, false}, {{2, 0, 0}, false}};
  EXPECT_EQ(observe(scan, 2.0), expected);
  EXPECT_EQ(observe(scan, 0.25), (ObservedCells{{{0, 0, 0}, false}})) << "cut in its first voxel";
}

TEST(ScanUpdate, doesNotCutABeamAsLongAsTheMaxRange) {
  Scan scan = scanFromVoxelZero();
  scan.points = {{2.5F, 0.5F, 0.5F}};
  const ObservedCells expected{{{0, 0, 0}, false}, {{1, 0, 0}, false}, {{2, 0, 0}, true}};
  EXPECT_EQ(observe(scan, 2.0), expected);
}

TEST(ScanUpdate, missesEveryVoxelOfANoReturnUpToItsEndOrItsCut) {
  Scan scan = scanFromVoxelZero();
  scan.no_returns = {{0.5F, 2.5F, 0.5F}};
  const ObservedCells up_to_end{{{0, 0, 0}, false}, {{0, 1, 0}, false}, {{0, 2, 0}, false}};
  EXPECT_EQ(observe(scan), up_to_end);
  EXPECT_EQ(observe(scan, 1.0), (ObservedCells{{{0, 0, 0}, false}, {{0, 1, 0}, false}}));
  scan.no_returns = {{0.6F, 0.5F, 0.5F}};
  EXPECT_EQ(observe(scan), (ObservedCells{{{0, 0, 0}, false}})) << "in the origin's voxel";
}

TEST(ScanUpdate, leavesOutAndCountsWhatIsNotFiniteOrOutsideTheGrid) {
  const Grid grid(0.001);  // The grid reaches to 1.07e6 m.
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (const float bad : {kNan, kInfinity, -kInfinity, 2e6F, -2e6F, 3e38F}) {
    for (int axis = 0; axis < 3; ++axis) {
      Scan scan;
      Eigen::Vector3f point(0.0F, 0.0F, 0.0F);
      point[axis] = bad;
      scan.points = {point, {0.0015F, 0.0F, 0.0F}};
      scan.no_returns = {point};
      ScanUpdater updater(grid);
      const ScanUpdate& update = updater.compute(scan);
      EXPECT_EQ(update.num_out_of_range, 2U) << bad;
      EXPECT_EQ(update.num_points, 1U) << bad;
      EXPECT_EQ(test::toObservedCells(update),
                (ObservedCells{{{0, 0, 0}, false}, {{1, 0, 0}, true}}));
    }
  }
}

TEST(ScanUpdate, leavesOutWhatIsNotFiniteWithAMaxRangeToo) {
  ScanUpdater updater(Grid(1.0), 10.0);
  for (const float bad : {std::nanf(""), kInfinity, -kInfinity}) {
    Scan scan = scanFromVoxelZero();
    scan.points = {{bad, 0.5F, 0.5F}, {0.5F, bad, bad}};
    const ScanUpdate& update = updater.compute(scan);
    EXPECT_EQ(update.num_out_of_range, 2U) << bad;
    EXPECT_TRUE(update.bricks.empty()) << bad;
  }
}

TEST(ScanUpdate, cutsABeamThatEndsOutsideTheGridBeyondTheMaxRange) {
  ScanUpdater updater(Grid(0.001), 0.002);
  Scan scan;
  scan.points = {{2e6F, 0.0F, 0.0F}};
  const ScanUpdate& update = updater.compute(scan);
  EXPECT_EQ(update.num_points, 1U);
  EXPECT_EQ(test::toObservedCells(update).size(), 3U);
}

TEST(ScanUpdate, isEmptyWhenTheOriginIsOutsideTheGridOrNotFinite) {
  ScanUpdater updater(Grid(1.0));
  for (const float bad : {std::nanf(""), kInfinity, 2e9F, -2e9F}) {
    Scan scan;
    scan.points = {{1.0F, 2.0F, 3.0F}, {3.0F, 2.0F, 3.0F}};
    scan.no_returns = {{1.0F, 2.0F, 3.0F}};
    scan.origin = {0.0F, bad, 0.0F};
    const ScanUpdate& update = updater.compute(scan);
    EXPECT_TRUE(update.bricks.empty()) << bad;
    EXPECT_EQ(update.num_points, 0U) << bad;
    EXPECT_EQ(update.num_out_of_range, 3U) << bad;
  }
}

TEST(ScanUpdate, isEmptyForAnEmptyScan) {
  ScanUpdater updater(Grid(1.0));
  const ScanUpdate& update = updater.compute(Scan{});
  EXPECT_TRUE(update.bricks.empty());
  EXPECT_EQ(update.num_points + update.num_out_of_range, 0U);
}

TEST(ScanUpdate, letsAHitWinOverMissesWhateverTheOrderOfTheBeams) {
  Scan scan = scanFromVoxelZero();
  scan.points = {{2.5F, 0.5F, 0.5F}, {4.5F, 0.5F, 0.5F}};
  scan.no_returns = {{3.5F, 0.5F, 0.5F}};
  const ObservedCells expected{{{0, 0, 0}, false},
                               {{1, 0, 0}, false},
                               {{2, 0, 0}, true},
                               {{3, 0, 0}, false},
                               {{4, 0, 0}, true}};
  EXPECT_EQ(observe(scan), expected);
  std::swap(scan.points[0], scan.points[1]);
  EXPECT_EQ(observe(scan), expected);
  scan.points.push_back(scan.origin);
  EXPECT_TRUE(observe(scan).at({0, 0, 0})) << "the origin's voxel can be hit, too";
}

TEST(ScanUpdate, isThatOfOctomapServerForRandomScans) {
  test::Random random(1);
  std::size_t num_cases = 0;
  std::size_t num_hits = 0;
  std::size_t num_misses = 0;
  for (const double resolution_m : {0.05, 0.1, 0.2, 0.3}) {
    // One updater for all scans: nothing may remain from the previous scan.
    ScanUpdater without_limit{Grid(resolution_m)};
    ScanUpdater with_limit(Grid(resolution_m), 20.0 * resolution_m);
    test::ScanShape shape;
    shape.resolution_m = resolution_m;
    for (int i = 0; i < 250; ++i, ++num_cases) {
      shape.half_edge_m = (i % 10 == 0 ? 150.0 : 15.0) * resolution_m;
      shape.lattice_ratio = 0.25 * (i % 4);
      const Scan scan = test::randomScan(random, shape);
      const bool has_limit = i % 2 == 0;
      const ScanUpdate& update = (has_limit ? with_limit : without_limit).compute(scan);
      const ObservedCells observed = test::toObservedCells(update);
      ASSERT_EQ(observed,
                observeWithOctomap(scan, resolution_m, has_limit ? 20.0 * resolution_m : kNoLimit))
          << resolution_m << " m, " << test::seedNote(num_cases);
      ASSERT_EQ(update.num_points, scan.points.size() + scan.no_returns.size());
      ASSERT_EQ(update.num_out_of_range, 0U);
      for (const auto& voxel : observed) ++(voxel.second ? num_hits : num_misses);
    }
  }
  EXPECT_EQ(num_cases, 1000U);
  EXPECT_GT(num_hits, 20000U);
  EXPECT_GT(num_misses, 200000U);
}

TEST(ScanUpdate, hasEachTouchedBrickOnceInMortonOrder) {
  test::Random random(2);
  ScanUpdater updater(Grid(0.1));
  test::ScanShape shape;
  shape.half_edge_m = 20.0;
  std::size_t num_bricks = 0;
  for (std::size_t i = 0; i < 100; ++i) {
    const ScanUpdate& update = updater.compute(test::randomScan(random, shape));
    for (const BrickUpdate& brick : update.bricks) {
      ASSERT_EQ(brickOf(brick.brick), brick.brick) << "not aligned";
      std::uint64_t observed = 0;
      for (std::size_t z = 0; z < kBrickEdge; ++z) observed |= brick.hits[z] | brick.misses[z];
      ASSERT_NE(observed, 0U) << "not touched: " << brick.brick;
    }
    ASSERT_TRUE(isOrdered(update.bricks)) << test::seedNote(i);
    num_bricks += update.bricks.size();
  }
  EXPECT_GT(num_bricks, 10000U);
}

TEST(ScanUpdate, isInMortonOrderAcrossEveryBorderOfTheCurve) {
  test::Random random(3);
  test::ScanShape shape;
  shape.half_edge_m = 200.0;
  ScanUpdater updater(Grid(1.0));
  std::size_t num_across = 0;  // Axes on which a cloud lies on both sides of such a border.
  for (std::size_t i = 0; i < 300; ++i) {
    Scan scan = test::randomScan(random, shape);
    for (int axis = 0; axis < 3; ++axis) {
      scan.anchor_map[axis] = random.integer(-9, 9) * std::ldexp(1.0, random.integer(20, 26));
    }
    const ScanUpdate& update = updater.compute(scan);
    ASSERT_GT(update.bricks.size(), 100U);
    ASSERT_TRUE(isOrdered(update.bricks)) << test::seedNote(i);
    for (int axis = 0; axis < 3; ++axis) {
      const auto side = [&](const BrickUpdate& brick) {
        return (brick.brick[axis] < scan.anchor_map[axis]) ==
               (update.bricks.front().brick[axis] < scan.anchor_map[axis]);
      };
      num_across += std::all_of(update.bricks.begin(), update.bricks.end(), side) ? 0 : 1;
    }
  }
  EXPECT_GT(num_across, 500U);
}

TEST(ScanUpdate, isTheSameForEveryNumberOfThreads) {
  test::Random random(5);
  test::ScanShape shape;
  shape.half_edge_m = 20.0;
  ScanUpdater one(Grid(0.1), 15.0);
  for (const int threads : {2, 3, 16}) {
    ScanUpdater many(Grid(0.1), 15.0, threads);
    for (std::size_t i = 0; i < 30; ++i) {
      Scan scan = test::randomScan(random, shape);
      scan.no_returns = test::randomScan(random, shape).points;
      const ScanUpdate& expected = one.compute(scan);
      const ScanUpdate& update = many.compute(scan);
      ASSERT_EQ(update.num_points, expected.num_points);
      ASSERT_EQ(update.num_out_of_range, expected.num_out_of_range);
      ASSERT_EQ(update.bricks.size(), expected.bricks.size()) << test::seedNote(i);
      for (std::size_t b = 0; b < update.bricks.size(); ++b) {
        ASSERT_EQ(update.bricks[b].brick, expected.bricks[b].brick) << test::seedNote(i);
        ASSERT_EQ(update.bricks[b].hits, expected.bricks[b].hits) << test::seedNote(i);
        ASSERT_EQ(update.bricks[b].misses, expected.bricks[b].misses) << test::seedNote(i);
      }
    }
  }
}

TEST(ScanUpdate, isTheShiftedOneFarFromTheOriginWithAnAnchor) {
  test::Random random(3);
  std::size_t num_cases = 0;
  for (const double resolution_m : {0.05, 0.0625}) {
    const Grid grid(resolution_m);
    ScanUpdater near_updater(grid, 8.0);
    ScanUpdater far_updater(grid, 8.0);
    const Eigen::Vector3d anchor(977.0 * 1024.0, -977.0 * 1024.0, 1024.0);
    const Cell shift = *grid.toCell(anchor + Eigen::Vector3d::Constant(1e-3));
    test::ScanShape shape;
    shape.half_edge_m = 10.0;
    shape.num_points = 20;
    for (int i = 0; i < 50; ++i, ++num_cases) {
      const Scan scan = test::randomScan(random, shape);
      ObservedCells expected;
      for (const auto& [cell, is_hit] : test::toObservedCells(near_updater.compute(scan))) {
        expected[cell + shift] = is_hit;
      }
      Scan far_scan = scan;
      far_scan.anchor_map = anchor;
      ASSERT_EQ(test::toObservedCells(far_updater.compute(far_scan)), expected)
          << resolution_m << " m, " << test::seedNote(num_cases);
    }
  }
  EXPECT_EQ(num_cases, 100U);
}

TEST(ScanUpdate, worksAtTheBordersOfTheGrid) {
  const double bound_m = Grid::kMaxCell;
  for (const double sign : {-1.0, 1.0}) {
    Scan scan;
    scan.anchor_map = Eigen::Vector3d::Constant(sign * (bound_m - 64.0));
    scan.points = {Eigen::Vector3f::Constant(static_cast<float>(sign) * 63.5F),
                   Eigen::Vector3f::Constant(static_cast<float>(sign) * 64.5F)};
    ScanUpdater updater(Grid(1.0));
    const ScanUpdate& update = updater.compute(scan);
    EXPECT_EQ(update.num_points, 1U);
    EXPECT_EQ(update.num_out_of_range, 1U);
    const int last = sign > 0.0 ? Grid::kMaxCell - 1 : -Grid::kMaxCell;
    const ObservedCells cells = test::toObservedCells(update);
    ASSERT_EQ(cells.count({last, last, last}), 1U);
    EXPECT_TRUE(cells.at({last, last, last}));
  }
}

}  // namespace
}  // namespace cuboid_mapping
