// SPDX-License-Identifier: BSD-3-Clause
#include "passing_objects.h"

#include "command_line.h"

#include "cuboid_mapping/interop/octomap_parity.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "cuboid_mapping/simulation/lidar.h"

#include <cmath>
#include <limits>

namespace cuboid_mapping::bench {
namespace {

using nlohmann::json;

constexpr double kNoLimit = std::numeric_limits<double>::infinity();
constexpr double kPeriod_s = 0.2;
constexpr int kCloudsWithWalker = 250;  ///< 50 s: the walker's way and back.
constexpr int kCloudsWithout = 50;

/// Clouds of a lidar that follows the robot's way.
std::vector<Scan> makeClouds(bool has_walker) {
  const World world(1);
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

/// A map of all clouds. @param when_left  Called when the walker has left.
template <typename CallbackT>
CuboidMap fill(const MapConfig& config, const std::vector<Scan>& scans, CallbackT when_left) {
  CuboidMap map(config);
  ScanUpdater updater(map.grid(), kNoLimit, 1, config.beamSampling());
  for (std::size_t i = 0; i < scans.size(); ++i) {
    throwIfInterrupted();
    if (i == kCloudsWithWalker) when_left(map);
    map.apply(updater.compute(scans[i]));
  }
  return map;
}

}  // namespace

json evaluatePassingObjects(double resolution_m) {
  const std::vector<Scan> scans = makeClouds(true);
  const CuboidMap without_walker =
      fill(configOf(FusionKind::kClass, Environment::kDynamic, resolution_m), makeClouds(false),
           [](const CuboidMap&) {});
  json results = json::array();
  octomap::OcTree octomap = makeOctomap(without_walker.config());
  std::size_t left = 0;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    throwIfInterrupted();
    if (i == kCloudsWithWalker) left = countRemains(octomap, without_walker);
    insertIntoOctomap(scans[i], kNoLimit, octomap);
  }
  results.push_back({{"map", "octomap"},
                     {"left_voxels", left},
                     {"remaining_voxels", countRemains(octomap, without_walker)}});
  for (const FusionKind fusion : {FusionKind::kClass, FusionKind::kGrowth}) {
    for (const Environment environment : {Environment::kDynamic, Environment::kStatic}) {
      CuboidMap map =
          fill(configOf(fusion, environment, resolution_m), scans,
               [&](const CuboidMap& current) { left = countRemains(current, without_walker); });
      results.push_back({{"map", "cuboid_mapping"},
                         {"fusion", toString(fusion)},
                         {"environment", toString(environment)},
                         {"left_voxels", left},
                         {"remaining_voxels", countRemains(map, without_walker)},
                         {"cells", map.tree().size()}});
    }
  }
  return results;
}

}  // namespace cuboid_mapping::bench
