// SPDX-License-Identifier: BSD-3-Clause
// A drive of many laps with a window and a store, beside the same one without: time per cloud, memory, pages, and
// whether the maps are equal in the end and no more pages came and went than the drive asks for.
#include "command_line.h"
#include "page_budget.h"
#include "timing.h"

#include "cuboid_mapping/scan/scan_update.h"
#include "cuboid_mapping/window/map_window.h"
#include "data_sets/scan_dataset.h"
#include "simulation/lidar.h"
#include "simulation/world.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping::bench {
namespace {

struct Options {
  std::vector<std::string> datasets;
  std::string store = "window_drive.sqlite";
  double resolution_m = 0.1;
  double max_range_m = std::numeric_limits<double>::infinity();
  int laps = 20;
  double clouds_a_metre = 1.0;
  double apart_m = 0.0;  ///< Of a lap and the next one.
  WindowConfig window;
  bool has_plain = true;
  double budget = 1.0;  ///< Pages that may come and go, as a multiple of what the drive asks for.
};

/// The clouds of a lap of the simulated lidar.
std::vector<Scan> simulateLap(const Options& options) {
  const World world(1);
  LidarConfig config;
  config.max_range_m = std::min(30.0, options.max_range_m);
  const Lidar lidar(config);
  std::vector<Scan> scans;
  const double step_s = 1.0 / (options.clouds_a_metre * World::kRobotSpeed);
  for (double time_s = 0.0; time_s < world.lapDuration(); time_s += step_s) {
    throwIfInterrupted();
    const Eigen::Isometry3d T_map_lidar =
        world.computeRobotPose(time_s) * Eigen::Translation3d(0.0, 0.0, 1.0);
    std::vector<Eigen::Vector3f> points;
    const LidarCloud cloud =
        lidar.computeCloud(world.computeSolids(time_s), T_map_lidar, scans.size());
    for (const LidarPoint& point : cloud.points) {
      if (std::isfinite(point.x)) points.emplace_back(point.x, point.y, point.z);
    }
    scans.push_back(makeScan(T_map_lidar, T_map_lidar.translation(), points));
  }
  return scans;
}

/// The clouds of data sets, one behind the other and back again, so that the last is beside the first. Each set
/// begins some way from where the one before ends.
std::vector<Scan> readLap(const Options& options) {
  constexpr double kGap_m = 50.0;
  std::vector<Scan> scans;
  Eigen::Vector3d begin = Eigen::Vector3d::Zero();
  for (const std::string& name : options.datasets) {
    const auto dataset = openScanDataset(name);
    std::optional<Eigen::Vector3d> shift;
    for (std::size_t i = 0; i < dataset->size(); ++i) {
      throwIfInterrupted();
      ScanDataset::Item item = dataset->read(i);
      if (!shift) shift = begin - item.T_map_sensor.translation();
      item.T_map_sensor.pretranslate(*shift);
      begin = item.T_map_sensor.translation() + kGap_m * Eigen::Vector3d::UnitX();
      scans.push_back(
          makeScan(item.T_map_sensor, item.T_map_sensor.translation(), item.points_sensor));
    }
  }
  for (std::size_t i = scans.size() - 1; i-- > 1;) scans.push_back(scans[i]);
  return scans;
}

double residentMegabytes() {
  std::ifstream statm("/proc/self/statm");
  double total_pages = 0.0;
  double resident_pages = 0.0;
  statm >> total_pages >> resident_pages;
  constexpr double kMegabytesAPage = 4096e-6;
  return resident_pages * kMegabytesAPage;
}

/// Of one lap.
struct LapFigures {
  Timing walk;
  Timing plain;
  Timing window;
  double slowest_s = 0.0;  ///< Wall time of the slowest step of the window.
  double most_mb = 0.0;    ///< Of the map in the window, at its largest.
};

/// The two maps.
struct Drive {
  Drive(const MapConfig& config, const Options& options)
      : plain(config),
        map(config),
        updater(map.grid(), options.max_range_m),
        budget(options.window, map.grid()) {}

  CuboidMap plain;
  CuboidMap map;
  ScanUpdater updater;
  PageBudget budget;
  std::unique_ptr<MapWindow> window;
};

/// @param shift_m  How far along x the lap is from the first one.
LapFigures driveLap(const std::vector<Scan>& scans, double shift_m, bool has_plain, Drive& drive) {
  LapFigures lap;
  for (Scan scan : scans) {
    throwIfInterrupted();
    scan.anchor_map.x() += shift_m;
    const ScanUpdate* update = nullptr;
    lap.walk += timeOf([&] { update = &drive.updater.compute(scan); });
    if (has_plain) lap.plain += timeOf([&] { drive.plain.apply(*update); });
    const Eigen::Vector3d center_map = scan.anchor_map + scan.origin.cast<double>();
    drive.budget.note(*update, center_map);
    const Timing step = timeOf([&] {
      ChangeSet changes;
      const ScanUpdate& admitted = drive.window->admit(*update, center_map, changes);
      CuboidMap::PendingChange change = drive.map.prepare(admitted, drive.map.sensorModel());
      drive.window->commit(change, changes);
    });
    lap.window += step;
    lap.slowest_s = std::max(lap.slowest_s, step.wall_s);
    lap.most_mb = std::max(lap.most_mb, 1e-6 * static_cast<double>(drive.map.numBytes()));
  }
  return lap;
}

/// Known voxels in a store.
std::size_t countKnown(const MapStore& store) {
  std::size_t count = 0;
  for (const Cell& page : store.pages()) {
    for (const VoxelBrick& brick : store.read(page)) count += brick.voxels.known().count();
  }
  return count;
}

/// Whether the store has the voxels of the map without a window, and no others.
bool isEqual(const CuboidMap& plain, const std::string& file) {
  const MapStore store(file, StoreAccess::kRead);
  std::size_t num_bricks = 0;
  for (const Cell& page : store.pages()) {
    for (const VoxelBrick& brick : store.read(page)) {
      const PackedVoxels* expected = plain.voxels().find(brick.brick);
      if (expected == nullptr || *expected != brick.voxels) return false;
      ++num_bricks;
    }
  }
  return num_bricks == plain.voxels().size();
}

void printLap(int number, std::size_t num_clouds, const LapFigures& lap,
              const WindowFigures& pages) {
  const auto per_cloud_ms = [&](double time_s) {
    return 1e3 * time_s / static_cast<double>(num_clouds);
  };
  std::cout << std::setw(3) << number << std::fixed << std::setprecision(2) << std::setw(10)
            << per_cloud_ms(lap.walk.wall_s) << std::setw(10) << per_cloud_ms(lap.plain.wall_s)
            << std::setw(10) << per_cloud_ms(lap.window.wall_s) << std::setw(10)
            << 1e3 * lap.slowest_s << std::setw(10) << lap.most_mb << std::setw(10)
            << residentMegabytes() << std::setw(10) << pages.num_loads << std::setw(10)
            << pages.num_writes << std::setw(10) << pages.num_in_memory + pages.num_on_disk_only
            << std::endl;
}

/// Says how many pages came and went. @return Whether there were no more than are allowed.
bool checkTraffic(const WindowFigures& pages, const PageBudget& budget, double factor) {
  const auto line = [&](const char* name, std::uint64_t count, std::uint64_t asked) {
    const bool is_within = static_cast<double>(count) <= factor * static_cast<double>(asked);
    std::cout << "pages " << name << ": " << count << ", the drive asks for " << asked
              << (is_within ? "" : ": TOO MANY") << std::endl;
    return is_within;
  };
  const bool are_reads_within = line("read", pages.num_loads, budget.numReads());
  return line("written", pages.num_writes, budget.numWrites()) && are_reads_within;
}

int drive(const Options& options) {
  MapConfig config;
  config.resolution_m = options.resolution_m;
  Drive drive(config, options);
  std::filesystem::remove(options.store);
  drive.window = std::make_unique<MapWindow>(
      options.window, openStoreOf(takeSnapshot(drive.map, "map"), options.store), drive.map);
  const std::vector<Scan> scans =
      options.datasets.empty() ? simulateLap(options) : readLap(options);
  std::cout << scans.size()
            << " clouds a lap\nlap   walk[ms] plain[ms]  window[ms] slowest[ms]  "
               "map[MB]  RSS[MB]  loads  writes  pages\n";
  LapFigures all;
  for (int lap = 1; lap <= options.laps; ++lap) {
    const LapFigures figures =
        driveLap(scans, (lap - 1) * options.apart_m, options.has_plain, drive);
    printLap(lap, scans.size(), figures, drive.window->figures());
    all.walk += figures.walk;
    all.plain += figures.plain;
    all.window += figures.window;
  }
  const bool is_within = checkTraffic(drive.window->figures(), drive.budget, options.budget);
  if (!drive.window->save()) {
    throw std::runtime_error(drive.window->figures().last_failure);
  }
  drive.window.reset();
  std::cout << "store: " << 1e-6 * static_cast<double>(std::filesystem::file_size(options.store))
            << " MB, " << countKnown(MapStore(options.store, StoreAccess::kRead))
            << " known voxels\n";
  if (!options.has_plain) return is_within ? 0 : 1;
  std::cout << "map without a window: " << 1e-6 * static_cast<double>(drive.plain.numBytes())
            << " MB\ntime with window / without, ray walk included: "
            << (all.walk.wall_s + all.window.wall_s) / (all.walk.wall_s + all.plain.wall_s)
            << " (wall), "
            << (all.walk.cpu_s + all.window.cpu_s) / (all.walk.cpu_s + all.plain.cpu_s)
            << " (CPU)\n";
  const bool is_equal = isEqual(drive.plain, options.store);
  std::cout << (is_equal ? "the maps are equal, voxel by voxel" : "THE MAPS DIFFER") << std::endl;
  return is_equal && is_within ? 0 : 1;
}

int run(int argc, char** argv) {
  Options options;
  bool is_alone = false;
  CommandLine line("window_drive",
                   "Drives a window through a map for many laps, and compares the result with a "
                   "map without a window.");
  line.addTexts("dataset", options.datasets,
                "data sets of scans, driven in this order; default: the simulated building");
  line.addText("store", options.store, "file of the store; it is replaced");
  line.addNumber("resolution", options.resolution_m, "edge of a voxel in metres", {1e-3, 1e2});
  line.addNumber("max-range", options.max_range_m, "longer beams are cut off here, in metres",
                 {0.01, 1e5});
  line.addNumber("laps", options.laps, "number of laps", {1, 100000});
  line.addNumber("clouds-a-metre", options.clouds_a_metre,
                 "clouds per metre of the simulated drive", {0.01, 100});
  line.addNumber("apart", options.apart_m,
                 "distance from a lap to the next one along x in metres, for a map that grows",
                 {0.0, 1e4});
  line.addNumber("size", options.window.size_m, "edge of the window in metres", {0.1, 1e6});
  line.addNumber("margin", options.window.margin_m,
                 "width of the margin around the window in metres", {0.0, 1e6});
  line.addNumber(
      "budget", options.budget,
      "largest number of pages read and written, as a multiple of the pages that the drive needs",
      {0.0, 1e3});
  line.addFlag("alone", is_alone,
               "drive without the other map, to measure the memory of the process");
  if (const auto status = line.parse(argc, argv)) return *status;
  options.has_plain = !is_alone;
  return drive(options);
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("window_drive", argc, argv, cuboid_mapping::bench::run);
}
