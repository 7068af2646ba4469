// SPDX-License-Identifier: BSD-3-Clause
// The parts of the engine on their own, on made-up clouds: ray walk, bricks, R-tree.
//
// usage: micro_benchmarks --benchmark_filter=rayWalk
#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/ray_query.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "cuboid_mapping/voxels/brick_cuboids.h"
#include "evaluation/rtree.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace cuboid_mapping {
namespace {

/// Where a beam from the origin leaves a box, with 1 cm of noise; what noisy surfaces do to fusion
/// and to the number of voxels depends on it.
Eigen::Vector3f endInBox(const Eigen::Vector3f& direction, const Eigen::Vector3f& half_size_m,
                         std::mt19937& random) {
  const float range_m = (half_size_m.array() / direction.array().abs()).minCoeff();
  const float noise_m = 0.01F * (static_cast<float>(random() % 2001) / 1000.0F - 1.0F);
  return (range_m + noise_m) * direction;
}

/// A lidar of 64 lasers in a street: 120,000 beams, up to 100 m long.
Scan makeOutdoorScan() {
  constexpr int kLasers = 64;
  constexpr int kColumns = 1875;
  std::mt19937 random(1);
  Scan scan;
  scan.origin = {0.05F, 0.05F, 0.05F};
  for (int laser = 0; laser < kLasers; ++laser) {
    const double elevation = (-24.8 + 26.8 * laser / (kLasers - 1)) * M_PI / 180.0;
    for (int column = 0; column < kColumns; ++column) {
      const double azimuth = 2.0 * M_PI * (column + 0.3) / kColumns;
      const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                                      std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const bool is_down = direction.z() < 0.0;
      const Eigen::Vector3f street_m(95.0F, 9.0F, is_down ? 1.7F : 12.0F);
      scan.points.push_back(scan.origin + endInBox(direction.cast<float>(), street_m, random));
    }
  }
  return scan;
}

/// A depth camera of 640 x 480 pixels in a room: beams of 1 to 4 m.
Scan makeRgbdScan() {
  std::mt19937 random(1);
  Scan scan;
  scan.origin = {0.05F, 0.05F, 0.05F};
  for (int row = 0; row < 480; ++row) {
    for (int column = 0; column < 640; ++column) {
      const Eigen::Vector3f pixel(1.0F, (319.7F - static_cast<float>(column)) / 585.0F,
                                  (239.7F - static_cast<float>(row)) / 585.0F);
      scan.points.push_back(scan.origin + endInBox(pixel.normalized(), {3.0F, 1.4F, 1.1F}, random));
    }
  }
  return scan;
}

const Scan& scanOf(bool is_outdoor) {
  static const Scan kOutdoor = makeOutdoorScan();
  static const Scan kRgbd = makeRgbdScan();
  return is_outdoor ? kOutdoor : kRgbd;
}

/// A map of one cloud, as what the R-tree has to hold.
const CuboidMap& streetMap() {
  static const CuboidMap kMap = [] {
    MapConfig config;
    config.resolution_m = 0.2;
    CuboidMap map(config);
    ScanUpdater updater(map.grid());
    map.apply(updater.compute(scanOf(true)));
    return map;
  }();
  return kMap;
}

std::vector<Cuboid> cuboidsOf(const CuboidMap& map) {
  std::vector<Cuboid> cuboids;
  visitAll(map, CuboidFilter::kAll, [&cuboids](const Cuboid& cuboid) {
    cuboids.push_back(cuboid);
    return Visit::kContinue;
  });
  return cuboids;
}

std::vector<Cuboid> shuffledCuboids() {
  std::vector<Cuboid> cuboids = cuboidsOf(streetMap());
  std::shuffle(cuboids.begin(), cuboids.end(), std::mt19937(1));
  return cuboids;
}

/// @param is_outdoor, resolution_m  Which cloud.
void rayWalk(benchmark::State& state, bool is_outdoor, double resolution_m) {
  const Scan& scan = scanOf(is_outdoor);
  ScanUpdater updater{Grid(resolution_m)};
  for (auto _ : state) benchmark::DoNotOptimize(&updater.compute(scan));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(scan.points.size()));
}
BENCHMARK_CAPTURE(rayWalk, outdoor_0_2m, true, 0.2)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(rayWalk, outdoor_0_1m, true, 0.1)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(rayWalk, rgbd_0_05m, false, 0.05)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(rayWalk, rgbd_0_02m, false, 0.02)->Unit(benchmark::kMillisecond);

/// What a brick may look like.
enum class BrickKind : unsigned char {
  kFree,     ///< All of one value.
  kSurface,  ///< A slanted wall of four values before free space; unknown behind.
  kNoise,    ///< Half of the voxels known, with random ones of four values.
};

VoxelBrick makeBrick(BrickKind kind) {
  std::mt19937 random(1);
  BrickMask known;
  VoxelValues values;
  for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
    const int x = voxel & 7;
    const int y = voxel >> 3 & 7;
    const int wall = 3 + y / 4;
    const bool is_known = kind == BrickKind::kFree || (kind == BrickKind::kSurface && x <= wall) ||
                          (kind == BrickKind::kNoise && random() % 2 == 0);
    if (!is_known) continue;
    known.set(voxel);
    const bool is_free = kind == BrickKind::kFree || (kind == BrickKind::kSurface && x < wall) ||
                         (kind == BrickKind::kNoise && random() % 2 == 0);
    values[static_cast<std::size_t>(voxel)] = is_free ? -2.0F : static_cast<float>(random() % 4);
  }
  return {{0, 0, 0}, PackedVoxels(known, values)};
}

void brickDivision(benchmark::State& state, BrickKind kind) {
  const VoxelBrick brick = makeBrick(kind);
  std::vector<Cuboid> cuboids;
  for (auto _ : state) {
    cuboids.clear();
    divideBrick(brick, cuboids);
    benchmark::DoNotOptimize(cuboids.data());
  }
  state.counters["cuboids"] = static_cast<double>(cuboids.size());
}

/// All voxels missed, and all hit, in turn.
void brickUpdate(benchmark::State& state, BrickKind kind) {
  const SensorModel model;
  VoxelBrick brick = makeBrick(kind);
  const BrickMask seen = brick.voxels.known();
  for (auto _ : state) {
    benchmark::DoNotOptimize(brick.voxels.observe({}, seen, model, brick.voxels));
    benchmark::DoNotOptimize(brick.voxels.observe(seen, {}, model, brick.voxels));
  }
}
BENCHMARK_CAPTURE(brickUpdate, free, BrickKind::kFree);
BENCHMARK_CAPTURE(brickUpdate, surface, BrickKind::kSurface);
BENCHMARK_CAPTURE(brickUpdate, noise, BrickKind::kNoise);
BENCHMARK_CAPTURE(brickDivision, free, BrickKind::kFree);
BENCHMARK_CAPTURE(brickDivision, surface, BrickKind::kSurface);
BENCHMARK_CAPTURE(brickDivision, noise, BrickKind::kNoise);

/// Update, fusion and R-tree of the first cloud of a map; clearing it is in the time, too.
void applyCloud(benchmark::State& state, bool is_outdoor, double resolution_m) {
  MapConfig config;
  config.resolution_m = resolution_m;
  CuboidMap map(config);
  ScanUpdater updater(map.grid());
  const ScanUpdate& update = updater.compute(scanOf(is_outdoor));
  for (auto _ : state) {
    map.clear();
    map.apply(update);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(update.bricks.size()));
}
BENCHMARK_CAPTURE(applyCloud, outdoor_0_2m, true, 0.2)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(applyCloud, rgbd_0_05m, false, 0.05)->Unit(benchmark::kMillisecond);

/// One cuboid after the other, in random order. The argument is M.
void treeInsert(benchmark::State& state) {
  const std::vector<Cuboid> cuboids = shuffledCuboids();
  const auto max_branches = static_cast<int>(state.range(0));
  for (auto _ : state) {
    bench::RTree tree({max_branches, std::max(1, max_branches * 3 / 8)});
    for (const Cuboid& cuboid : cuboids) tree.insert(cuboid);
    benchmark::DoNotOptimize(tree.size());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(cuboids.size()));
}
BENCHMARK(treeInsert)->Arg(8)->Arg(32)->Arg(64)->Unit(benchmark::kMillisecond);

/// One cuboid after the other goes and comes again.
void treeReplace(benchmark::State& state) {
  bench::RTree tree;
  const std::vector<Cuboid> places = shuffledCuboids();
  for (const Cuboid& cuboid : places) tree.insert(cuboid);
  std::size_t place = 0;
  for (auto _ : state) {
    tree.remove(places[place].box);
    tree.insert(places[place]);
    place = (place + 1) % places.size();
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(treeReplace);

/// Windows of that many voxels each way around cuboids.
void treeQuery(benchmark::State& state) {
  const std::vector<Cuboid> places = shuffledCuboids();
  const auto edge = static_cast<std::int32_t>(state.range(0));
  std::size_t place = 0;
  std::int64_t found = 0;
  for (auto _ : state) {
    const Cell& min = places[place].box.min;
    visitBox(streetMap(), {min, min + Cell{edge, edge, edge}}, CuboidFilter::kAll,
             [&found](const Cuboid&) {
               ++found;
               return Visit::kContinue;
             });
    place = (place + 1) % places.size();
  }
  state.counters["cuboids"] = static_cast<double>(found) /
                              static_cast<double>(std::max<std::int64_t>(1, state.iterations()));
}
BENCHMARK(treeQuery)->Arg(1)->Arg(10)->Arg(50);

void treeRay(benchmark::State& state) {
  const Scan& scan = scanOf(true);
  std::size_t point = 0;
  for (auto _ : state) {
    const Eigen::Vector3f beam = scan.points[point] - scan.origin;
    benchmark::DoNotOptimize(castRay(streetMap(), scan.origin.cast<double>(), beam.cast<double>(),
                                     30.0, UnknownPolicy::kFree, Budget::unlimited()));
    point = (point + 7919) % scan.points.size();
  }
}
BENCHMARK(treeRay);

}  // namespace
}  // namespace cuboid_mapping

BENCHMARK_MAIN();
