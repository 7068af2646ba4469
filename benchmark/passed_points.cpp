// SPDX-License-Identifier: BSD-3-Clause
// How well points of moving things are told from those of standing ones: SA, DA and AA as KTH's DynamicMap benchmark
// defines them, of a simulated drive past a walker, or of a data set in that benchmark's layout.
#include "command_line.h"

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "cuboid_mapping/scan/void_space.h"
#include "data_sets/scan_dataset.h"
#include "simulation/lidar.h"

#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <vector>

namespace cuboid_mapping::bench {
namespace {

/// A point is in the output if a point of the output is so near.
constexpr double kSameDistance_m = 0.05;

struct PassedOptions {
  std::string dataset;  ///< A folder; empty: the simulated world.
  int seed = 1;
  int rings = 32;
  int clouds = 150;
  double resolution_m = 0.1;
  double noise_m = 0.01;
  double margin_m = 1.0;
};

struct TruthPoint {
  Eigen::Vector3d point_map;
  bool is_moving;
};

struct Drive {
  std::vector<Scan> scans;
  std::vector<TruthPoint> truth;
};

Eigen::Vector3d toMap(const Scan& scan, const Eigen::Vector3f& point) {
  return scan.anchor_map + point.cast<double>();
}

/// Without the door, which moves and stands still in turns.
Drive simulate(const PassedOptions& options) {
  constexpr double kPeriod_s = 0.4;
  constexpr double kLead_s = 20.0;  // The robot comes out of the building when the walker is there.
  const World world(static_cast<std::uint64_t>(options.seed));
  LidarConfig config;
  config.rings = options.rings;
  config.range_noise_m = options.noise_m;
  const Lidar lidar(config);
  Drive drive;
  for (int i = 0; i < options.clouds; ++i) {
    throwIfInterrupted();
    Eigen::Isometry3d T_map_lidar = world.computeRobotPose(i * kPeriod_s + kLead_s);
    T_map_lidar.translate(Eigen::Vector3d(0.1, 0.0, 1.0));
    std::vector<Solid> solids = world.computeSolids(i * kPeriod_s);
    solids.erase(std::remove_if(solids.begin(), solids.end(),
                                [](const Solid& solid) { return solid.kind == SolidKind::kDoor; }),
                 solids.end());
    std::vector<Eigen::Vector3f> points;
    std::vector<bool> are_moving;
    const float walker = computeReflectivity(SolidKind::kWalker);
    for (const LidarPoint& point :
         lidar.computeCloud(solids, T_map_lidar, static_cast<std::uint64_t>(i)).points) {
      if (!std::isfinite(point.x)) continue;
      points.emplace_back(point.x, point.y, point.z);
      are_moving.push_back(point.intensity == walker);
    }
    drive.scans.push_back(makeScan(T_map_lidar, T_map_lidar.translation(), points));
    for (std::size_t k = 0; k < points.size(); ++k) {
      drive.truth.push_back(
          {toMap(drive.scans.back(), drive.scans.back().points[k]), are_moving[k]});
    }
  }
  return drive;
}

/// @throws std::runtime_error  when there is no gt_cloud.pcd with an intensity: 1 for what moves.
Drive readDrive(const std::string& folder) {
  Drive drive;
  const auto dataset = openScanDataset(folder);
  for (std::size_t i = 0; i < dataset->size(); ++i) {
    throwIfInterrupted();
    const ScanDataset::Item item = dataset->read(i);
    drive.scans.push_back(
        makeScan(item.T_map_sensor, item.T_map_sensor.translation(), item.points_sensor));
  }
  const std::string file = folder + "/gt_cloud.pcd";
  pcl::PointCloud<pcl::PointXYZI> truth;
  if (pcl::io::loadPCDFile(file, truth) != 0) throw std::runtime_error("cannot read " + file);
  for (const pcl::PointXYZI& point : truth) {
    drive.truth.push_back({point.getVector3fMap().cast<double>(), point.intensity == 1.0F});
  }
  return drive;
}

/// Points, by cubes of the distance in which they count as the same.
class PointSet {
 public:
  void add(const Eigen::Vector3d& point) {
    if (const auto cell = grid_.toCell(point)) points_[*cell].push_back(point);
  }

  [[nodiscard]] bool hasNear(const Eigen::Vector3d& point) const {
    const auto cell = grid_.toCell(point);
    if (!cell) return false;
    for (int i = 0; i < 27; ++i) {
      const Cell near = *cell + Cell{i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
      const auto found = points_.find(near);
      if (found == points_.end()) continue;
      for (const Eigen::Vector3d& other : found->second) {
        if ((other - point).norm() <= kSameDistance_m) return true;
      }
    }
    return false;
  }

 private:
  Grid grid_{kSameDistance_m};
  std::unordered_map<Cell, std::vector<Eigen::Vector3d>, CellHash> points_;
};

/// SA: standing points that stay. DA: moving ones that go. AA: the root of their product.
void print(const char* name, const PointSet& output, const std::vector<TruthPoint>& truth) {
  double counts[2] = {0.0, 0.0};
  double near[2] = {0.0, 0.0};
  for (const TruthPoint& point : truth) {
    counts[point.is_moving ? 1 : 0] += 1.0;
    near[point.is_moving ? 1 : 0] += output.hasNear(point.point_map) ? 1.0 : 0.0;
  }
  const double sa = counts[0] > 0.0 ? near[0] / counts[0] : 1.0;
  const double da = counts[1] > 0.0 ? 1.0 - near[1] / counts[1] : 1.0;
  std::printf("| %s | %.2f | %.2f | %.2f |\n", name, 100.0 * sa, 100.0 * da,
              100.0 * std::sqrt(sa * da));
}

class Evaluation {
 public:
  Evaluation(const Drive& drive, const MapConfig& config, double margin_m)
      : drive_(drive), plain_(config), clean_(config) {
    BeamRanges ranges;
    ranges.end_margin_m = margin_m;
    ScanUpdater updater(plain_.grid(), ranges);
    for (const Scan& scan : drive.scans) {
      throwIfInterrupted();
      for (const Eigen::Vector3f& point : scan.points) {
        const Eigen::Vector3d point_map = toMap(scan, point);
        const auto cell = plain_.grid().toCell(point_map);
        if (cell && !void_.contains(*cell)) online_.add(point_map);
      }
      const ScanUpdate& update = updater.compute(scan);
      plain_.apply(update);
      clean_.apply(void_.withoutMoving(update));
      void_.add(update);
    }
  }

  void printMaps(const std::string& note) const {
    const auto is_occupied = [](const CuboidMap& map, const Cell& cell) {
      return map.voxels().at(cell) == Occupancy::kOccupied;
    };
    print(("the map" + note).c_str(),
          select([&](const Cell& cell) { return is_occupied(plain_, cell); }), drive_.truth);
    print(("leave_out and --free-passed" + note).c_str(), select([&](const Cell& cell) {
            return is_occupied(clean_, cell) && !void_.contains(cell);
          }),
          drive_.truth);
  }

  void printPoints() const {
    print("points not in moving_points", online_, drive_.truth);
    print("points never in a void voxel",
          select([&](const Cell& cell) { return !void_.contains(cell); }), drive_.truth);
  }

 private:
  /// The points of the drive in voxels of a kind.
  [[nodiscard]] PointSet select(const std::function<bool(const Cell&)>& is_kept) const {
    PointSet points;
    for (const Scan& scan : drive_.scans) {
      for (const Eigen::Vector3f& point : scan.points) {
        const Eigen::Vector3d point_map = toMap(scan, point);
        const auto cell = plain_.grid().toCell(point_map);
        if (cell && is_kept(*cell)) points.add(point_map);
      }
    }
    return points;
  }

  const Drive& drive_;
  CuboidMap plain_;
  CuboidMap clean_;  ///< Without hits in voxels that were void.
  VoidSpace void_;
  PointSet online_;
};

int run(int argc, char** argv) {
  PassedOptions options;
  CommandLine line("passed_points",
                   "Measures how well moving points are separated from standing ones: SA, DA and "
                   "AA of KTH's DynamicMap benchmark.");
  line.addText("dataset", options.dataset,
               "a folder with pcd/*.pcd and gt_cloud.pcd, instead of the simulated drive");
  line.addNumber("seed", options.seed, "seed of the simulated world", {0, 1e9});
  line.addNumber("rings", options.rings, "number of rings of the lidar", {1, 1024});
  line.addNumber("clouds", options.clouds, "number of clouds of the drive, 0.4 s apart",
                 {1, 10000});
  line.addNumber("resolution", options.resolution_m, "edge of a voxel [m]", {0.01, 1.0});
  line.addNumber("noise", options.noise_m, "standard deviation of ranges [m]", {0.0, 1.0});
  line.addNumber("margin", options.margin_m, "end margin of beams [m]", {0.0, 100.0});
  if (const auto status = line.parse(argc, argv)) return *status;
  const Drive drive = options.dataset.empty() ? simulate(options) : readDrive(options.dataset);
  MapConfig config;
  config.resolution_m = options.resolution_m;
  const auto num_moving = std::count_if(drive.truth.begin(), drive.truth.end(),
                                        [](const TruthPoint& point) { return point.is_moving; });
  std::printf("%zu clouds, %td standing points, %td of moving objects\n\n", drive.scans.size(),
              static_cast<std::ptrdiff_t>(drive.truth.size()) - num_moving, num_moving);
  std::printf("| at %.2f m | SA %% | DA %% | AA %% |\n|---|---|---|---|\n", options.resolution_m);
  const Evaluation plain(drive, config, 0.0);
  plain.printPoints();
  plain.printMaps("");
  if (options.margin_m > 0.0) {
    Evaluation(drive, config, options.margin_m).printMaps(", with end_margin");
  }
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("passed_points", argc, argv, cuboid_mapping::bench::run);
}
