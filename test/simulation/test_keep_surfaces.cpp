// SPDX-License-Identifier: BSD-3-Clause
// What stays of surfaces that beams graze, with BeamRanges::keep_surfaces and with OctoMap's rule.
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "simulation/lidar.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

namespace cuboid_mapping {
namespace {

constexpr double kResolution_m = 0.1;

MetricBox boxOf(const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m) {
  return {min_m, max_m};
}

/// A floor with things on it, all a little off the borders of voxels, and a lidar over it.
struct Site {
  std::vector<Solid> solids = {
      {SolidKind::kGround, boxOf({-20.0, -20.0, -0.5}, {20.0, 20.0, 0.03})}};
  std::vector<Solid> passing = {};  ///< There in the first clouds only.
  std::size_t num_with_passing = 0;
  std::vector<Eigen::Vector3d> places;  ///< Of the lidar, one for each cloud.
  double noise_m = 0.01;

  void add(const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m) {
    solids.push_back({SolidKind::kFurniture, boxOf(min_m, max_m)});
  }
  void wait(const Eigen::Vector3d& place, int num_clouds) {
    places.insert(places.end(), static_cast<std::size_t>(num_clouds), place);
  }
  void go(const Eigen::Vector3d& from, const Eigen::Vector3d& to, int num_clouds) {
    for (int i = 0; i < num_clouds; ++i) places.push_back(from + (to - from) * i / num_clouds);
  }
};

/// A map, and what it should have.
struct Result {
  std::size_t num_hit = 0;   ///< Voxels of a region that have been hit.
  std::size_t num_kept = 0;  ///< Those of them that are occupied in the end.
  CuboidMap map;

  [[nodiscard]] double share() const {
    return static_cast<double>(num_kept) / static_cast<double>(num_hit);
  }
};

/// @param region_m  Where voxels count. @param keep_surfaces  The rule.
Result mapOf(const Site& site, const MetricBox& region_m, bool keep_surfaces) {
  LidarConfig lidar_config;
  lidar_config.min_elevation_rad = -35.0 * M_PI / 180.0;
  lidar_config.max_elevation_rad = 18.0 * M_PI / 180.0;
  lidar_config.range_noise_m = site.noise_m;
  const Lidar lidar(lidar_config);
  MapConfig config;
  config.resolution_m = kResolution_m;
  Result result{0, 0, CuboidMap(config)};
  BeamRanges ranges;
  ranges.keep_surfaces = keep_surfaces;
  ScanUpdater updater(result.map.grid(), ranges);
  const CellBox region = *result.map.grid().toCellBox(region_m);
  std::set<Cell> hit;
  std::uint64_t number = 0;
  for (const Eigen::Vector3d& place : site.places) {
    const Eigen::Isometry3d T_map_lidar(Eigen::Translation3d{place});
    std::vector<Solid> solids = site.solids;
    if (number < site.num_with_passing) {
      solids.insert(solids.end(), site.passing.begin(), site.passing.end());
    }
    std::vector<Eigen::Vector3f> points;
    for (const LidarPoint& point : lidar.computeCloud(solids, T_map_lidar, number++).points) {
      if (std::isfinite(point.x)) points.emplace_back(point.x, point.y, point.z);
    }
    const ScanUpdate& update = updater.compute(makeScan(T_map_lidar, place, points));
    for (const BrickUpdate& brick : update.bricks) {
      forEachCell(brick.brick, brick.hits, [&](const Cell& cell) {
        if (region.contains(cell)) hit.insert(cell);
      });
    }
    result.map.apply(update);
  }
  result.num_hit = hit.size();
  for (const Cell& cell : hit) {
    if (result.map.voxels().at(cell) == Occupancy::kOccupied) ++result.num_kept;
  }
  EXPECT_GT(result.num_hit, 100U);
  return result;
}

/// Ten steps of 0.3 by 0.2 m to a landing. The robot waits at the foot, goes up, down, and waits again.
Site makeStairs() {
  Site site;
  for (int i = 0; i < 10; ++i) {
    site.add({1.03 + 0.3 * i, -1.0, 0.0}, {1.33 + 0.3 * i, 1.0, 0.23 + 0.2 * i});
  }
  site.add({4.03, -1.0, 0.0}, {7.0, 1.0, 2.03});
  const Eigen::Vector3d foot(-1.0, 0.02, 0.7);
  const Eigen::Vector3d first(0.9, 0.02, 0.7);
  const Eigen::Vector3d top(4.5, 0.02, 2.7);
  site.wait(foot, 20);
  site.go(foot, first, 20);
  site.go(first, top, 40);
  site.go(top, first, 40);
  site.go(first, foot, 20);
  site.wait(foot, 20);
  return site;
}

TEST(KeepSurfaces, StairsStay) {
  const MetricBox stairs = boxOf({1.0, -1.0, 0.1}, {4.0, 1.0, 2.1});
  const Site site = makeStairs();
  EXPECT_GE(mapOf(site, stairs, true).share(), 0.95);
  EXPECT_LE(mapOf(site, stairs, false).share(), 0.8);
}

TEST(KeepSurfaces, StairsSeenFromTheirFootStay) {
  Site site = makeStairs();
  site.places.clear();
  site.go({-2.0, 0.02, 0.7}, {0.5, 0.02, 0.7}, 30);
  site.wait({0.5, 0.02, 0.7}, 30);
  EXPECT_GE(mapOf(site, boxOf({1.0, -1.0, 0.1}, {4.0, 1.0, 2.1}), true).share(), 0.95);
}

TEST(KeepSurfaces, ALandingJustBelowEyeHeightStays) {
  Site site;
  site.add({1.03, -1.0, 0.0}, {6.0, 1.0, 0.63});
  site.go({-2.0, 0.02, 0.8}, {0.5, 0.02, 0.8}, 30);
  site.wait({0.5, 0.02, 0.8}, 30);
  const MetricBox landing = boxOf({1.0, -1.0, 0.55}, {6.0, 1.0, 0.7});
  EXPECT_GE(mapOf(site, landing, true).share(), 0.95);
}

TEST(KeepSurfaces, AFloorFarAwayStays) {
  Site site;
  site.go({-15.0, 0.02, 0.8}, {10.0, 0.02, 0.8}, 60);
  const MetricBox floor = boxOf({-15.0, -15.0, 0.0}, {15.0, 15.0, 0.1});
  EXPECT_GE(mapOf(site, floor, true).share(), 0.95);
  EXPECT_LE(mapOf(site, floor, false).share(), 0.9);
}

TEST(KeepSurfaces, ATableTopStays) {
  Site site;
  site.add({2.03, -0.6, 0.7}, {3.53, 0.6, 0.73});
  site.go({-3.0, 0.02, 0.9}, {1.5, 0.02, 0.9}, 40);
  site.wait({1.5, 0.02, 0.9}, 20);
  const MetricBox table = boxOf({2.0, -0.6, 0.65}, {3.55, 0.6, 0.8});
  EXPECT_GE(mapOf(site, table, true).share(), 0.9);
}

TEST(KeepSurfaces, AThinFenceStaysAndWallsGetNoThicker) {
  Site site;
  for (int i = 0; i < 20; ++i) {
    site.add({4.0, -2.0 + 0.2 * i, 0.0}, {4.02, -1.97 + 0.2 * i, 1.5});
  }
  site.add({7.03, -5.0, 0.0}, {7.5, 5.0, 2.5});
  site.noise_m = 0.03;
  site.go({0.0, -1.0, 0.8}, {2.0, 1.0, 0.8}, 60);
  const MetricBox fence = boxOf({3.9, -2.0, 0.2}, {4.1, 2.0, 1.4});
  const Result kept = mapOf(site, fence, true);
  const Result usual = mapOf(site, fence, false);
  EXPECT_GE(kept.share(), usual.share());
  // The wall's face lies in the voxel from 7.0 m on: those before it are noise.
  const CellBox before = *kept.map.grid().toCellBox(boxOf({6.5, -3.0, 0.2}, {6.99, 3.0, 1.9}));
  const auto count = [&](const CuboidMap& map) {
    std::size_t num_occupied = 0;
    map.voxels().forEachIn(before, [&](const VoxelBrick& brick) {
      forEachCell(brick.brick, brick.voxels.occupied(), [&](const Cell& cell) {
        if (before.contains(cell)) ++num_occupied;
      });
    });
    return num_occupied;
  };
  EXPECT_LE(count(kept.map), count(usual.map) * 12 / 10);
}

TEST(KeepSurfaces, WhatHasGoneIsCleared) {
  Site site;
  site.add({7.03, -5.0, 0.0}, {7.5, 5.0, 2.5});
  site.passing = {{SolidKind::kWalker, Cylinder{{2.5, 0.0}, 0.25, 0.0, 1.7}}};
  site.num_with_passing = 10;
  site.wait({0.0, 0.02, 0.8}, 40);
  // The voxels beside the floor belong to it.
  const MetricBox walker = boxOf({2.2, -0.3, 0.21}, {2.8, 0.3, 1.8});
  EXPECT_LE(mapOf(site, walker, true).share(), mapOf(site, walker, false).share() + 0.02);
}

}  // namespace
}  // namespace cuboid_mapping
