// SPDX-License-Identifier: BSD-3-Clause
// A simulated lidar goes round a building several times, with a window and without.
#include "cuboid_mapping/scan/scan_update.h"
#include "cuboid_mapping/simulation/lidar.h"
#include "cuboid_mapping/simulation/world.h"
#include "cuboid_mapping/window/map_window.h"
#include "support/snapshots.h"
#include "tools/run_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace cuboid_mapping {
namespace {

constexpr int kLaps = 4;
constexpr int kCloudsALap = 60;
constexpr double kHeight_m = 0.8;

/// The clouds of a lap.
std::vector<Scan> takeLap(const World& world) {
  LidarConfig config;
  config.rings = 12;
  config.columns = 120;
  config.max_range_m = 4.0;
  const Lidar lidar(config);
  std::vector<Scan> scans;
  for (int i = 0; i < kCloudsALap; ++i) {
    const double time_s = world.lapDuration() * i / kCloudsALap;
    const Eigen::Isometry3d T_map_lidar =
        world.computeRobotPose(time_s) * Eigen::Translation3d(0.0, 0.0, kHeight_m);
    const LidarCloud cloud =
        lidar.computeCloud(world.fixedSolids(), T_map_lidar, static_cast<std::uint64_t>(i));
    std::vector<Eigen::Vector3f> points;
    for (const LidarPoint& point : cloud.points) {
      if (std::isfinite(point.x)) points.emplace_back(point.x, point.y, point.z);
    }
    scans.push_back(makeScan(T_map_lidar, T_map_lidar.translation(), points));
  }
  return scans;
}

TEST(WindowDrive, ofSeveralLapsHasTheSameMapInMemoryThatStaysAsItIs) {
  const test::TemporaryFolder folder;
  MapConfig config;
  config.resolution_m = 0.05;
  CuboidMap plain(config);
  CuboidMap map(config);
  auto store = openStoreOf(takeSnapshot(map, "map"), folder / "map.sqlite");
  MapWindow window({4.0, 1.0, OutsideWindow::kKeep}, std::move(store), map);
  ScanUpdater updater(map.grid());
  const std::vector<Scan> lap = takeLap(World(3));
  std::vector<std::size_t> most_bricks;
  std::vector<std::uint64_t> num_moved;  // Pages that were read or written.
  for (int i = 0; i < kLaps; ++i) {
    most_bricks.push_back(0);
    const WindowFigures before = window.figures();
    for (const Scan& scan : lap) {
      const ScanUpdate& update = updater.compute(scan);
      plain.apply(update);
      window.integrate(update, scan.anchor_map + scan.origin.cast<double>(), map,
                       [&](const ScanUpdate& part) { return map.apply(part); });
      most_bricks.back() = std::max(most_bricks.back(), map.voxels().size());
    }
    const WindowFigures after = window.figures();
    num_moved.push_back(after.num_loads + after.num_writes - before.num_loads - before.num_writes);
  }
  // From the second lap on all laps are alike.
  for (int i = 2; i < kLaps; ++i) {
    EXPECT_LE(most_bricks[i], most_bricks[1] + most_bricks[1] / 20);
    EXPECT_LE(num_moved[i], num_moved[1] + num_moved[1] / 10);
  }
  EXPECT_LT(most_bricks.back(), plain.voxels().size() * 3 / 4);
  ASSERT_TRUE(window.save(map));
  MapSnapshot whole = takeSnapshot(map, "map");
  window.addStored({}, whole);
  EXPECT_EQ(test::voxelsOf(whole.bricks), test::voxelsOf(plain));
}

}  // namespace
}  // namespace cuboid_mapping
