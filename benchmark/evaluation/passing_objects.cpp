// SPDX-License-Identifier: BSD-3-Clause
#include "passing_objects.h"

#include "evaluation/cuboid_history.h"

#include "command_line.h"
#include "timing.h"

#include "cuboid_mapping/interop/octomap_parity.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "simulation/lidar.h"

#include <cmath>
#include <limits>

namespace cuboid_mapping::bench {
namespace {

using nlohmann::json;

constexpr double kUnlimited = std::numeric_limits<double>::infinity();
constexpr double kPeriod_s = 0.2;
constexpr int kCloudsWithWalker = 250;  ///< 50 s: the walker's way and back.
constexpr int kCloudsWithout = 50;

/// Clouds of a lidar that follows the robot's way.
/// @param seed  Of the building and of where the walker begins.
std::vector<Scan> makeClouds(std::uint64_t seed, bool has_walker) {
  const World world(seed);
  LidarConfig config;
  config.rings = 16;
  config.columns = 600;
  const Lidar lidar(config);
  std::vector<Scan> scans;
  for (int i = 0; i < kCloudsWithWalker + kCloudsWithout; ++i) {
    throwIfInterrupted();
    const double time_s = i * kPeriod_s;
    Eigen::Isometry3d T_map_lidar = world.computeRobotPose(0.2 * time_s);
    T_map_lidar.translate(Eigen::Vector3d(0.0, 0.0, 1.0));
    const bool is_walking = has_walker && i < kCloudsWithWalker;
    const LidarCloud cloud =
        lidar.computeCloud(is_walking ? world.computeSolids(time_s) : world.fixedSolids(),
                           T_map_lidar, static_cast<std::uint64_t>(i));
    std::vector<Eigen::Vector3f> points;
    for (const LidarPoint& point : cloud.points) {
      if (std::isfinite(point.x)) points.emplace_back(point.x, point.y, point.z);
    }
    scans.push_back(makeScan(T_map_lidar, T_map_lidar.translation(), points));
  }
  return scans;
}

/// Occupied voxels of a map that are free in another one.
std::size_t countRemains(const CuboidMap& map, const CuboidMap& without_walker) {
  std::size_t count = 0;
  map.voxels().forEach([&](const VoxelBrick& brick) {
    const PackedVoxels* other = without_walker.voxels().find(brick.brick);
    if (other == nullptr) return;
    count += static_cast<std::size_t>((brick.voxels.occupied() & other->free()).count());
  });
  return count;
}

std::size_t countRemains(const octomap::OcTree& tree, const CuboidMap& without_walker) {
  std::size_t count = 0;
  octomap::OcTree voxels(tree);
  voxels.expand();
  for (auto leaf = voxels.begin_leafs(); leaf != voxels.end_leafs(); ++leaf) {
    if (!voxels.isNodeOccupied(*leaf)) continue;
    const auto cell = without_walker.grid().toCell({leaf.getX(), leaf.getY(), leaf.getZ()});
    count += cell && without_walker.voxels().at(*cell) == Occupancy::kFree ? 1 : 0;
  }
  return count;
}

MapConfig configOf(FusionKind fusion, Environment environment, double resolution_m) {
  MapConfig config;
  config.resolution_m = resolution_m;
  config.fusion = fusion;
  config.environment = environment;
  return config;
}

/// What is measured of a map.
struct Remains {
  std::size_t left_voxels = 0;
  std::size_t remaining_voxels = 0;
  json over_time = json::array();
};

json describe(const char* map, std::uint64_t seed, const Remains& remains) {
  return {{"map", map},
          {"seed", seed},
          {"left_voxels", remains.left_voxels},
          {"remaining_voxels", remains.remaining_voxels},
          {"over_time", remains.over_time}};
}

/// Where a drive is: figures are kept of every tenth cloud.
struct Step {
  int clouds = 0;      ///< So far.
  double cpu_s = 0.0;  ///< Insertion with fusion, since the last one that was kept.

  [[nodiscard]] bool isKept() const { return clouds % 10 == 0; }
};
static_assert(kCloudsWithWalker % 10 == 0);

/// Calls insert(scan) for all scans, timed, and note(Step) after each of them.
template <typename InsertT, typename NoteT>
void drive(const std::vector<Scan>& scans, InsertT insert, NoteT note) {
  Step step;
  for (const Scan& scan : scans) {
    throwIfInterrupted();
    step.cpu_s += timeOf([&] { insert(scan); }).cpu_s;
    ++step.clouds;
    note(step);
    if (step.isKept()) step.cpu_s = 0.0;
  }
}

json toJson(const Step& step, std::size_t cells) {
  return {{"clouds", step.clouds}, {"cells", cells}, {"cpu_s", step.cpu_s}};
}

/// Clouds of the same drive, with and without the walker.
struct Drive {
  std::vector<Scan> with_walker;
  std::vector<Scan> without;
};

CuboidMap makeReference(const MapConfig& config, const Drive& clouds) {
  CuboidMap map(config);
  ScanUpdater updater(map.grid(), kUnlimited, 1, config.beamSampling());
  for (const Scan& scan : clouds.without) map.apply(updater.compute(scan));
  return map;
}

json runOctomap(std::uint64_t seed, const Drive& clouds, double resolution_m) {
  const MapConfig config = configOf(FusionKind::kClass, Environment::kDynamic, resolution_m);
  // The same voxels as OctoMap's.
  const CuboidMap reference = makeReference(config, clouds);
  octomap::OcTree octomap = makeOctomap(config);
  Remains remains;
  drive(
      clouds.with_walker, [&](const Scan& scan) { insertIntoOctomap(scan, kUnlimited, octomap); },
      [&](const Step& step) {
        if (!step.isKept()) return;
        remains.over_time.push_back(toJson(step, octomap.getNumLeafNodes()));
        if (step.clouds == kCloudsWithWalker) {
          remains.left_voxels = countRemains(octomap, reference);
        }
      });
  remains.remaining_voxels = countRemains(octomap, reference);
  return describe("octomap", seed, remains);
}

json runOurs(const MapConfig& config, std::uint64_t seed, const Drive& clouds) {
  const CuboidMap reference = makeReference(config, clouds);
  CuboidMap map(config);
  ScanUpdater updater(map.grid(), kUnlimited, 1, config.beamSampling());
  CuboidHistory history;
  Remains remains;
  drive(
      clouds.with_walker, [&](const Scan& scan) { map.apply(updater.compute(scan)); },
      [&](const Step& step) {
        history.note(map);
        if (!step.isKept()) return;
        remains.over_time.push_back(toJson(step, countCuboids(map).total()));
        remains.over_time.back()["splits"] = history.numSplits();
        remains.over_time.back()["fused_again"] = history.numFusedAgain();
        if (step.clouds == kCloudsWithWalker) remains.left_voxels = countRemains(map, reference);
      });
  remains.remaining_voxels = countRemains(map, reference);
  json run = describe("cuboid_mapping", seed, remains);
  run["fusion"] = toString(config.fusion);
  run["environment"] = toString(config.environment);
  run["settle_clouds"] = config.growth.settle_clouds;
  return run;
}

}  // namespace

json evaluatePassingObjects(double resolution_m, int num_drives) {
  json results = json::array();
  for (int drive_number = 1; drive_number <= num_drives; ++drive_number) {
    const auto seed = static_cast<std::uint64_t>(drive_number);
    const Drive drive{makeClouds(seed, true), makeClouds(seed, false)};
    results.push_back(runOctomap(seed, drive, resolution_m));
    for (const FusionKind fusion : {FusionKind::kClass, FusionKind::kGrowth}) {
      for (const Environment environment : {Environment::kDynamic, Environment::kStatic}) {
        results.push_back(runOurs(configOf(fusion, environment, resolution_m), seed, drive));
      }
    }
    for (const int settle_clouds : {0, 3, 30}) {
      MapConfig config = configOf(FusionKind::kGrowth, Environment::kDynamic, resolution_m);
      config.growth.settle_clouds = settle_clouds;
      results.push_back(runOurs(config, seed, drive));
    }
  }
  return results;
}

}  // namespace cuboid_mapping::bench
