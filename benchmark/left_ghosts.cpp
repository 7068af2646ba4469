// SPDX-License-Identifier: BSD-3-Clause
// What people leave in the map of a robot that drives past them, and what is lost of things that stand: of a simulated
// building, where the truth is known.
#include "command_line.h"

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "cuboid_mapping/scan/void_space.h"
#include "simulation/lidar.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

namespace cuboid_mapping::bench {
namespace {

constexpr double kPeriod_s = 0.1;
constexpr std::array<int, 5> kLags_s{1, 2, 5, 10, 30};

struct GhostOptions {
  int seed = 1;
  int rings = 32;
  double duration_s = 90.0;
  double resolution_m = 0.1;
  double noise_m = 0.01;
  double no_return_range_m = 15.0;
};

/// A person of the simulated world: a cylinder.
Solid makePerson(const Eigen::Vector2d& position_m, double ground_m) {
  return {SolidKind::kWalker, Cylinder{position_m, 0.25, ground_m, ground_m + 1.75}};
}

/// People that walk where the robot drives: ahead of it, standing for 2 s of every 6, and behind it.
std::vector<Solid> computePeople(const World& world, double time_s) {
  const double ground_m = world.computeRobotPose(0.0).translation().z();
  const double in_period = std::fmod(time_s, 6.0);
  const double ahead_m = time_s - in_period + std::min(1.5 * in_period, 6.0) + 5.0;
  const double behind_m = time_s * World::kRobotSpeed - 2.5;
  std::vector<Solid> people;
  for (const double way_m : {ahead_m, behind_m}) {
    people.push_back(makePerson(world.robotPath().computePlace(way_m).position_m, ground_m));
  }
  return people;
}

/// A cloud as the map takes it, and the voxels in which it has seen people, the door, and what stands.
struct Seen {
  Scan scan;
  std::vector<Cell> people;
  std::vector<Cell> door;
  std::vector<Cell> standing;
};

class Drive {
 public:
  Drive(const GhostOptions& options, const Grid& grid)
      : world_(static_cast<std::uint64_t>(options.seed)), grid_(grid) {
    config_.rings = options.rings;
    config_.range_noise_m = options.noise_m;
    no_return_range_m_ = options.no_return_range_m;
  }

  [[nodiscard]] const World& world() const { return world_; }

  /// All that moves at a time, but the door.
  [[nodiscard]] std::vector<Solid> people(double time_s) const {
    std::vector<Solid> people = computePeople(world_, time_s);
    people.push_back(world_.computeSolids(time_s).back());
    return people;
  }

  [[nodiscard]] Seen see(int number, bool has_people) const {
    const double time_s = number * kPeriod_s;
    std::vector<Solid> solids = world_.computeSolids(time_s);
    solids.pop_back();  // The walker.
    if (has_people) {
      for (const Solid& person : people(time_s)) solids.push_back(person);
    }
    Eigen::Isometry3d T_map_lidar = world_.computeRobotPose(time_s);
    T_map_lidar.translate(Eigen::Vector3d(0.1, 0.0, 1.0));
    const LidarCloud cloud =
        Lidar(config_).computeCloud(solids, T_map_lidar, static_cast<std::uint64_t>(number));
    std::vector<Eigen::Vector3f> points;
    std::vector<Eigen::Vector3f> no_returns;
    Seen seen;
    for (int i = 0; i < cloud.rings * cloud.columns; ++i) {
      const LidarPoint& point = cloud.points[static_cast<std::size_t>(i)];
      if (!std::isfinite(point.x)) {
        no_returns.push_back(directionOf(i).cast<float>() * static_cast<float>(no_return_range_m_));
        continue;
      }
      points.emplace_back(point.x, point.y, point.z);
      const auto cell = grid_.toCell(T_map_lidar * points.back().cast<double>());
      if (!cell) continue;
      const bool is_person = point.intensity == computeReflectivity(SolidKind::kWalker);
      const bool is_door = point.intensity == computeReflectivity(SolidKind::kDoor);
      (is_person ? seen.people : is_door ? seen.door : seen.standing).push_back(*cell);
    }
    seen.scan = makeScan(T_map_lidar, T_map_lidar.translation(), points, no_returns);
    return seen;
  }

 private:
  /// As Lidar has it.
  [[nodiscard]] Eigen::Vector3d directionOf(int index) const {
    const double step = config_.rings > 1 ? 1.0 / (config_.rings - 1) : 0.0;
    const int ring = index / config_.columns;
    const double elevation = config_.max_elevation_rad -
                             ring * step * (config_.max_elevation_rad - config_.min_elevation_rad);
    const double azimuth = 2.0 * M_PI * (index % config_.columns) / config_.columns;
    return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
            std::sin(elevation)};
  }

  World world_;
  Grid grid_;
  LidarConfig config_;
  double no_return_range_m_;
};

/// A set of options, with the map that it makes with people, and the one without.
class Candidate {
 public:
  Candidate(std::string name, const MapConfig& config, bool keeps_surfaces, bool leaves_out,
            bool has_no_returns)
      : name_(std::move(name)),
        leaves_out_(leaves_out),
        has_no_returns_(has_no_returns),
        maps_{CuboidMap(config), CuboidMap(config)},
        updater_(maps_[0].grid(), rangesOf(keeps_surfaces)) {}

  void add(const std::array<const Scan*, 2>& scans) {
    for (std::size_t i = 0; i < 2; ++i) {
      Scan scan = *scans[i];
      if (!has_no_returns_) scan.no_returns.clear();
      const std::clock_t begin = std::clock();
      const ScanUpdate& update = updater_.compute(scan);
      maps_[i].apply(leaves_out_ ? void_[i].withoutMoving(update) : update);
      if (leaves_out_) void_[i].add(update);
      cpu_s_ += static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    }
  }

  [[nodiscard]] bool isOccupied(const Cell& cell, bool has_people) const {
    return maps_[has_people ? 1 : 0].voxels().at(cell) == Occupancy::kOccupied;
  }
  [[nodiscard]] const CuboidMap& map(bool has_people) const { return maps_[has_people ? 1 : 0]; }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] double cpu_s() const { return cpu_s_; }

  std::array<double, kLags_s.size()> num_left{};  ///< Ghosts, by time after the people left.
  double num_door = 0.0;                          ///< Voxels of the closed door in the map.

 private:
  static BeamRanges rangesOf(bool keeps_surfaces) {
    BeamRanges ranges{30.0};
    ranges.keep_surfaces = keeps_surfaces;
    return ranges;
  }

  std::string name_;
  bool leaves_out_;
  bool has_no_returns_;
  std::array<CuboidMap, 2> maps_;  ///< Without people, and with them.
  std::array<VoidSpace, 2> void_;
  ScanUpdater updater_;
  double cpu_s_ = 0.0;
};

/// The voxels where people were seen, and when they were last there.
class Visits {
 public:
  void add(const Drive& drive, const Grid& grid, const Seen& seen, int number) {
    for (const Cell& cell : seen.people) last_.try_emplace(cell, number);
    for (const Solid& person : drive.people(number * kPeriod_s)) {
      const MetricBox bounds = computeBounds(person.shape);
      const auto box = grid.toCellBox(bounds);
      if (!box) continue;
      forEachCellOf(*box, [&](const Cell& cell) {
        const auto found = last_.find(cell);
        if (found != last_.end()) found->second = number;
      });
    }
  }

  /// Calls visit(cell) for each voxel that people left so many clouds ago.
  template <typename VisitT>
  void forEachLeft(int number, int lag, VisitT visit) const {
    for (const auto& [cell, last] : last_) {
      if (last == number - lag) visit(cell);
    }
  }

 private:
  template <typename VisitT>
  static void forEachCellOf(const CellBox& box, VisitT visit) {
    for (int x = box.min[0]; x < box.max[0]; ++x) {
      for (int y = box.min[1]; y < box.max[1]; ++y) {
        for (int z = box.min[2]; z < box.max[2]; ++z) visit(Cell{x, y, z});
      }
    }
  }

  std::unordered_map<Cell, int, CellHash> last_;  ///< Number of a cloud.
};

int run(int argc, char** argv) {
  GhostOptions options;
  CommandLine line("left_ghosts",
                   "Measures which voxels of walking people stay in the map, and which voxels of "
                   "standing things are lost, in a simulated building.");
  line.addNumber("seed", options.seed, "seed of the simulated world", {0, 1e9});
  line.addNumber("rings", options.rings, "number of rings of the lidar", {1, 1024});
  line.addNumber("duration", options.duration_s, "length of the drive [s]", {1.0, 3600.0});
  line.addNumber("resolution", options.resolution_m, "edge of a voxel [m]", {0.01, 1.0});
  line.addNumber("noise", options.noise_m, "standard deviation of ranges [m]", {0.0, 1.0});
  line.addNumber("no-return-range", options.no_return_range_m,
                 "sensor_model/no_return_range of the sets that have one [m]", {0.1, 100.0});
  if (const auto status = line.parse(argc, argv)) return *status;

  MapConfig config;
  config.resolution_m = options.resolution_m;
  std::vector<Candidate> candidates;
  candidates.reserve(5);
  candidates.emplace_back("OctoMap's rule", config, false, false, false);
  candidates.emplace_back("keep_surfaces", config, true, false, false);
  candidates.emplace_back("keep_surfaces, no-returns", config, true, false, true);
  candidates.emplace_back("keep_surfaces, leave_out", config, true, true, false);
  candidates.emplace_back("keep_surfaces, leave_out, no-returns", config, true, true, true);
  const Grid grid = candidates.front().map(true).grid();
  const Drive drive(options, grid);
  Visits visits;
  std::unordered_set<Cell, CellHash> standing;
  std::array<double, kLags_s.size()> num_left{};
  double num_door = 0.0;
  const int count = static_cast<int>(options.duration_s / kPeriod_s);
  for (int number = 0; number < count; ++number) {
    throwIfInterrupted();
    const Seen without = drive.see(number, false);
    const Seen with = drive.see(number, true);
    for (Candidate& candidate : candidates) candidate.add({&without.scan, &with.scan});
    visits.add(drive, grid, with, number);
    standing.insert(with.standing.begin(), with.standing.end());
    for (std::size_t k = 0; k < kLags_s.size(); ++k) {
      visits.forEachLeft(number, static_cast<int>(kLags_s[k] / kPeriod_s), [&](const Cell& cell) {
        num_left[k] += 1.0;
        for (Candidate& candidate : candidates) {
          const bool is_ghost =
              candidate.isOccupied(cell, true) && !candidate.isOccupied(cell, false);
          candidate.num_left[k] += is_ghost ? 1.0 : 0.0;
        }
      });
    }
    // It closes until 17.5 s of every 30: it has been closed for 5 s.
    if (std::fmod(number * kPeriod_s + 27.0, 30.0) < 19.5) continue;
    for (const Cell& cell : with.door) {
      num_door += 1.0;
      for (Candidate& candidate : candidates)
        candidate.num_door += candidate.isOccupied(cell, true) ? 1.0 : 0.0;
    }
  }

  std::printf("%d clouds of %d rings at %.2f m, seed %d; %.0f voxels in which people were seen\n\n",
              count, options.rings, options.resolution_m, options.seed, num_left.front());
  std::printf(
      "| | left after 1 s %% | 2 s | 5 s | 10 s | 30 s | standing voxels lost %% | "
      "closed door in the map %% | CPU per cloud [ms] |\n|---|---|---|---|---|---|---|---|---|\n");
  for (const Candidate& candidate : candidates) {
    std::printf("| %s |", candidate.name().c_str());
    for (std::size_t k = 0; k < kLags_s.size(); ++k) {
      std::printf(" %.2f |", 100.0 * candidate.num_left[k] / std::max(1.0, num_left[k]));
    }
    const auto num_lost = std::count_if(standing.begin(), standing.end(), [&](const Cell& cell) {
      return !candidate.isOccupied(cell, true);
    });
    std::printf(" %.3f | %.1f | %.1f |\n",
                100.0 * static_cast<double>(num_lost) / static_cast<double>(standing.size()),
                100.0 * candidate.num_door / std::max(1.0, num_door),
                1e3 * candidate.cpu_s() / (2.0 * count));
  }
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("left_ghosts", argc, argv, cuboid_mapping::bench::run);
}
