// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/scan_update.h"

#include "support/random_shapes.h"
#include "support/voxel_map.h"

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::ObservedCells;

constexpr double kNoLimit = std::numeric_limits<double>::infinity();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A scan from the middle of voxel (0 0 0) at 1 m.
Scan scanFromVoxelZero() {
  Scan scan;
  scan.origin = {0.5F, 0.5F, 0.5F};
  return scan;
}

ObservedCells observe(const Scan& scan, double max_range_m = kNoLimit) {
  ScanUpdater updater(Grid(1.0), max_range_m);
  return test::toObservedCells(updater.compute(scan));
}

/// The update as octomap_server's OctomapServer::insertScan computes it, with OctoMap's ray walk.
ObservedCells observeWithOctomap(const Scan& scan, double resolution_m, double max_range_m) {
  const octomap::OcTree tree(resolution_m);
  octomap::KeyRay keys;
  ObservedCells cells;
  const octomap::point3d origin(scan.origin.x(), scan.origin.y(), scan.origin.z());
  const auto mark = [&](const octomap::OcTreeKey& key, bool is_hit) {
    bool& was_hit = cells[{key[0] - 32768, key[1] - 32768, key[2] - 32768}];
    was_hit = was_hit || is_hit;
  };
  const auto addBeam = [&](const Eigen::Vector3f& point, bool is_return, bool is_open = false) {
    octomap::point3d end(point.x(), point.y(), point.z());
    const bool is_cut = (end - origin).norm() > max_range_m;
    if (is_cut) end = origin + (end - origin).normalized() * static_cast<float>(max_range_m);
    EXPECT_TRUE(tree.computeRayKeys(origin, end, keys));
    for (const octomap::OcTreeKey& key : keys) mark(key, false);
    if (!is_open || is_cut) mark(tree.coordToKey(end), is_return && !is_cut);
  };
  for (const Eigen::Vector3f& point : scan.points) addBeam(point, true);
  for (const Eigen::Vector3f& end : scan.no_returns) addBeam(end, false);
  for (const Eigen::Vector3f& end : scan.open_ends) addBeam(end, false, true);
  return cells;
}

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
    for (const BrickUpdate& brick : updater.compute(scan).bricks) {
      EXPECT_TRUE(brick.hits.isEmpty());
      const BrickMask seen = brick.misses | brick.grazes;
      for (int x = 0; x < 8; ++x) EXPECT_EQ(seen.test(x), x < 4) << x << ", margin " << margin_m;
    }
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
