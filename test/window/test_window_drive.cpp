// SPDX-License-Identifier: BSD-3-Clause
// A simulated lidar drives around a building several times, with a window and without.
#include "page_budget.h"

#include "cuboid_mapping/scan/scan_update.h"
#include "cuboid_mapping/window/map_window.h"
#include "simulation/lidar.h"
#include "simulation/world.h"
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
  const WindowConfig window_config{4.0, 1.0, OutsideWindow::kKeep};
  MapWindow window(window_config, std::move(store), map);
  bench::PageBudget budget(window_config, map.grid());
  ScanUpdater updater(map.grid());
  const std::vector<Scan> lap = takeLap(World(3));
  std::vector<std::size_t> most_bricks;
  std::vector<std::uint64_t> num_moved;  // Pages that were read or written.
  for (int i = 0; i < kLaps; ++i) {
    most_bricks.push_back(0);
    const WindowFigures before = window.figures();
    for (const Scan& scan : lap) {
      const ScanUpdate& update = updater.compute(scan);
      const Eigen::Vector3d center_map = scan.anchor_map + scan.origin.cast<double>();
      plain.apply(update);
      budget.note(update, center_map);
      ChangeSet changes;
      const ScanUpdate& admitted = window.admit(update, center_map, changes);
      CuboidMap::PendingChange change = map.prepare(admitted, map.sensorModel());
      window.commit(change, changes);
      most_bricks.back() = std::max(most_bricks.back(), map.voxels().size());
    }
    const WindowFigures after = window.figures();
    EXPECT_LE(after.num_loads, budget.numReads());
    EXPECT_LE(after.num_writes, budget.numWrites());
    num_moved.push_back(after.num_loads + after.num_writes - before.num_loads - before.num_writes);
  }
  // From the second lap on all laps are alike.
  for (int i = 2; i < kLaps; ++i) {
    EXPECT_LE(most_bricks[i], most_bricks[1] + most_bricks[1] / 20);
    EXPECT_LE(num_moved[i], num_moved[1] + num_moved[1] / 10);
  }
  EXPECT_GT(window.figures().num_loads, budget.numReads() / 2) << "else it is no bound";
  EXPECT_LT(most_bricks.back(), plain.voxels().size() * 3 / 4);
  ASSERT_TRUE(window.save());
  MapSnapshot whole = takeSnapshot(map, "map");
  for (const Cell& page : window.storedPages()) window.addStored(page, {}, whole);
  sortBricks(whole.bricks);
  EXPECT_EQ(test::voxelsOf(whole.bricks), test::voxelsOf(plain));
}

#ifdef WINDOW_DRIVE_PROGRAM  // It is built with the node.
TEST(WindowDrive, ofTheProgramFailsWhereMorePagesComeAndGoThanAreAllowed) {
  const test::TemporaryFolder folder;
  const auto drive = [&](const std::string& budget) {
    return test::runProgram({WINDOW_DRIVE_PROGRAM, "--store", folder / "map.sqlite", "--laps", "2",
                             "--resolution", "0.2", "--size", "10", "--margin", "2", "--max-range",
                             "6", "--clouds-a-metre", "0.5", "--budget", budget});
  };
  const test::ProgramEnd good = drive("1");
  EXPECT_EQ(good.status, 0) << good.out << good.err;
  EXPECT_NE(good.out.find("the drive asks for"), std::string::npos) << good.out;
  const test::ProgramEnd bad = drive("0.1");
  EXPECT_EQ(bad.status, 1) << bad.err;
  EXPECT_NE(bad.out.find("TOO MANY"), std::string::npos) << bad.out;
}
#endif

}  // namespace
}  // namespace cuboid_mapping
