// SPDX-License-Identifier: BSD-3-Clause
// A map that grows by real scans, as planners see it: bytes of the update messages beside those of
// octomap_full, and how long queries take while clouds come in.
#include "command_line.h"
#include "cuboid_mapping/interop/octomap_parity.h"
#include "cuboid_mapping/io/packed_bricks.h"
#include "cuboid_mapping/io/scan_update_codec.h"
#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/ray_query.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "cuboid_mapping/sharing/map_follower.h"
#include "data_sets/scan_dataset.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <random>
#include <string>
#include <thread>
#include <vector>

namespace cuboid_mapping::bench {
namespace {

using Clock = std::chrono::steady_clock;

struct Options {
  std::string dataset;
  double resolution_m = 0.2;
  double rate_hz = 10.0;
};

MapConfig makeConfig(const Options& options) {
  MapConfig config;
  config.resolution_m = options.resolution_m;
  return config;
}

std::vector<Scan> readDataset(const Options& options) {
  const auto dataset = openScanDataset(options.dataset);
  std::vector<Scan> scans;
  scans.reserve(dataset->size());
  for (std::size_t i = 0; i < dataset->size(); ++i) {
    const ScanDataset::Item item = dataset->read(i);
    scans.push_back(
        makeScan(item.T_map_sensor, item.T_map_sensor.translation(), item.points_sensor));
  }
  return scans;
}

/// Of a message: header, numbers, and lengths of the arrays.
constexpr double kHead = 150.0;
/// Of a cloud of x, y and z. Drivers add intensity, ring and more.
constexpr double kPointBytes = 12.0;

double bytesOf(const std::vector<VoxelBrick>& bricks, MapDetail detail) {
  const auto packed = packBricks(bricks.data(), bricks.data() + bricks.size(), detail);
  return kHead + static_cast<double>(packed.data.size());
}

/// One message after each cloud, as at a publish_rate of the rate of the clouds.
void measureBytes(const Options& options, const std::vector<Scan>& scans) {
  CuboidMap map(makeConfig(options));
  ScanUpdater updater(map.grid());
  octomap::OcTree octree = makeOctomap(map.config());
  double update_bytes = 0.0;
  double value_bytes = 0.0;
  double num_bricks = 0.0;
  double full_bytes = 0.0;
  double cloud_bytes = 0.0;
  double observation_bytes = 0.0;
  for (const Scan& scan : scans) {
    const ScanUpdate& update = updater.compute(scan);
    cloud_bytes += kPointBytes * static_cast<double>(scan.points.size());
    observation_bytes += kHead + static_cast<double>(toBytes(update).size());
    const ChangeSet changes = map.apply(update);
    const MapDelta delta = makeDelta(map, changes, 1, 0, MapDetail::kClasses);
    update_bytes += bytesOf(delta.bricks, MapDetail::kClasses);
    value_bytes +=
        bytesOf(makeDelta(map, changes, 1, 0, MapDetail::kValues).bricks, MapDetail::kValues);
    num_bricks += static_cast<double>(delta.bricks.size());
    insertIntoOctomap(scan, std::numeric_limits<double>::infinity(), octree);
    octree.prune();
    // octomap::OcTree::writeData: a float and a byte of children for each node.
    full_bytes += 5.0 * static_cast<double>(octree.calcNumNodes());
  }
  const auto image_mb = [&map](MapDetail detail) {
    return 1e-6 * bytesOf(makeImage(map, 1, detail).bricks, detail);
  };
  const auto num_clouds = static_cast<double>(scans.size());
  std::printf("update message: %.0f kB and %.0f bricks for each cloud, %.1f bytes for each brick\n",
              1e-3 * update_bytes / num_clouds, num_bricks / num_clouds, update_bytes / num_bricks);
  std::printf("octomap_full: %.0f kB for each cloud; updates are %.1f %% of that\n",
              1e-3 * full_bytes / num_clouds, 100.0 * update_bytes / full_bytes);
  std::printf("with publish_values: %.0f kB for each cloud, %.1f %% of octomap_full\n",
              1e-3 * value_bytes / num_clouds, 100.0 * value_bytes / full_bytes);
  std::printf(
      "observations: %.0f kB for each cloud; %.1f %% of its %.0f kB, %.1f %% of octomap_full\n",
      1e-3 * observation_bytes / num_clouds, 100.0 * observation_bytes / cloud_bytes,
      1e-3 * cloud_bytes / num_clouds, 100.0 * observation_bytes / full_bytes);
  std::printf("cuboid_map, once for each listener: %.2f MB at the end, %.2f MB with values\n",
              image_mb(MapDetail::kClasses), image_mb(MapDetail::kValues));
}

/// Asks for a box and a ray, near where the sensor is, again and again.
class Asker {
 public:
  Asker(cuboid_mapping_ros::GuardedMap& map, const std::atomic<std::size_t>& num_inserted,
        const std::vector<Scan>& scans)
      : map_(map), num_inserted_(num_inserted), scans_(scans) {}

  void run() {
    while (num_inserted_ < scans_.size()) {
      const Scan& scan = scans_[std::min<std::size_t>(num_inserted_, scans_.size() - 1)];
      const Eigen::Vector3d sensor = scan.anchor_map + scan.origin.cast<double>();
      const auto begin = Clock::now();
      ask(sensor + Eigen::Vector3d(offset_(engine_), offset_(engine_), 0.0));
      const std::chrono::duration<double, std::milli> passed = Clock::now() - begin;
      times_ms_.push_back(passed.count());
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    std::sort(times_ms_.begin(), times_ms_.end());
  }

  [[nodiscard]] std::size_t numAsked() const { return times_ms_.size(); }
  [[nodiscard]] double quantile_ms(double ratio) const {
    const auto last = static_cast<double>(times_ms_.size() - 1);
    return times_ms_[static_cast<std::size_t>(ratio * last)];
  }

 private:
  void ask(const Eigen::Vector3d& point) {
    const MetricBox box = boxAround(point, Eigen::Vector3d::Constant(2.0));
    map_.read([&](const CuboidMap& map, const ros::Time& /*stamp*/) {
      is_free_ = queryBox(map, box, Budget::unlimited())->occupancy() == Occupancy::kFree;
      return castRay(map, point, {1.0, 0.3, 0.0}, 10.0, UnknownPolicy::kFree, Budget::unlimited())
          ->distance_m;
    });
  }

  cuboid_mapping_ros::GuardedMap& map_;
  const std::atomic<std::size_t>& num_inserted_;
  const std::vector<Scan>& scans_;
  std::mt19937 engine_{1};
  std::uniform_real_distribution<> offset_{-10.0, 10.0};
  std::vector<double> times_ms_;
  bool is_free_ = false;
};

void measureLatency(const Options& options, const std::vector<Scan>& scans) {
  cuboid_mapping_ros::GuardedMap map(makeConfig(options));
  ScanUpdater updater(map.grid());
  std::atomic<std::size_t> num_inserted{0};
  Asker asker(map, num_inserted, scans);
  std::thread asking([&asker] { asker.run(); });
  auto next = Clock::now();
  for (const Scan& scan : scans) {
    std::this_thread::sleep_until(next);
    next += std::chrono::duration_cast<Clock::duration>(
        std::chrono::duration<double>(1.0 / options.rate_hz));
    const ScanUpdate& update = updater.compute(scan);
    map.change(ros::Time(1.0), [&update](CuboidMap& content) { return content.apply(update); });
    ++num_inserted;
  }
  asking.join();
  std::printf(
      "%zu queries (a box of 2 m and a ray of 10 m each) beside clouds at %.0f Hz: "
      "median %.2f ms, p99 %.2f ms, longest %.2f ms\n",
      asker.numAsked(), options.rate_hz, asker.quantile_ms(0.5), asker.quantile_ms(0.99),
      asker.quantile_ms(1.0));
}

int run(int argc, char** argv) {
  Options options;
  CommandLine line("planner_load",
                   "Measures the size of map updates and the latency of queries while a map grows "
                   "from real scans.");
  line.addArgument("dataset", options.dataset, "folder of scans, or .graph file");
  line.addNumber("resolution", options.resolution_m, "edge of a voxel [m]", {0.001, 100.0});
  line.addNumber("rate", options.rate_hz, "rate of the clouds [Hz]", {0.01, 1000.0});
  if (const auto status = line.parse(argc, argv)) return *status;
  const std::vector<Scan> scans = readDataset(options);
  measureLatency(options, scans);
  measureBytes(options, scans);
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("planner_load", argc, argv, cuboid_mapping::bench::run);
}
