// SPDX-License-Identifier: BSD-3-Clause
// Times the map beside OctoMap: same process, same clouds, and how far the two agree.
#include "cuboid_mapping/interop/octomap_parity.h"
#include "cuboid_mapping/io/scan_dataset.h"
#include "cuboid_mapping/rtree/statistics.h"
#include "cuboid_mapping/rtree/traversal.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <iostream>
#include <limits>

namespace cuboid_mapping {
namespace {

struct Options {
  std::string dataset;
  MapConfig map;
  double max_range_m = std::numeric_limits<double>::infinity();
  std::size_t clouds = std::numeric_limits<std::size_t>::max();
  int repeat = 1;
  bool with_octomap = true;
};

/// CPU time of this process in seconds.
double cpuTime_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// CPU and wall time of a piece of work, in seconds.
struct Timing {
  double cpu_s = 0.0;
  double wall_s = 0.0;
};

template <typename WorkT>
Timing timeOf(WorkT work) {
  const auto wall_start = std::chrono::steady_clock::now();
  const double cpu_start = cpuTime_s();
  work();
  return {cpuTime_s() - cpu_start,
          std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start).count()};
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// Figures of one run.
struct Run {
  Timing walk;   ///< Ray walk of the cuboid map, part of its insertion.
  Timing apply;  ///< Update, fusion and R-tree, part of its insertion.
  Timing octomap;
  double access_cuboids_ms = 0.0;
  double access_octomap_ms = 0.0;
};

void add(Timing& sum, const Timing& part) {
  sum.cpu_s += part.cpu_s;
  sum.wall_s += part.wall_s;
}

std::vector<Scan> readScans(const Options& options) {
  const auto dataset = openScanDataset(options.dataset);
  std::vector<Scan> scans;
  for (std::size_t i = 0; i < std::min(dataset->size(), options.clouds); ++i) {
    const ScanDataset::Item item = dataset->read(i);
    scans.push_back(
        makeScan(item.T_map_sensor, item.T_map_sensor.translation(), item.points_sensor));
    if (!scans.back().anchor_map.isZero()) {
      throw std::runtime_error("OctoMap cannot hold scans more than 512 m from the origin exactly");
    }
  }
  return scans;
}

double accessOccupied_ms(const CuboidMap& map, double& sink) {
  const Timing timing = timeOf([&] {
    visitAll(map.tree(), CuboidFilter::kOccupied, [&sink](const Cuboid& cuboid) {
      sink += cuboid.box.min.x;
      return Visit::kContinue;
    });
  });
  return 1e3 * timing.cpu_s;
}

double accessOccupied_ms(const octomap::OcTree& tree, double& sink) {
  const Timing timing = timeOf([&] {
    for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
      if (tree.isNodeOccupied(*leaf)) sink += leaf.getX();
    }
  });
  return 1e3 * timing.cpu_s;
}

Run runOnce(const Options& options, const std::vector<Scan>& scans, CuboidMap& map,
            octomap::OcTree& tree) {
  Run run;
  ScanUpdater updater(map.grid(), options.max_range_m);
  for (const Scan& scan : scans) {
    const ScanUpdate* update = nullptr;
    add(run.walk, timeOf([&] { update = &updater.compute(scan); }));
    add(run.apply, timeOf([&] { map.apply(*update); }));
    if (options.with_octomap) {
      add(run.octomap, timeOf([&] { insertIntoOctomap(scan, options.max_range_m, tree); }));
    }
  }
  if (options.with_octomap) tree.prune();
  double sink = 0.0;
  run.access_cuboids_ms = accessOccupied_ms(map, sink);
  run.access_octomap_ms = accessOccupied_ms(tree, sink);
  if (sink == 0.5) std::puts("");  // Keeps the compiler from leaving out the loops.
  return run;
}

void printMaps(const CuboidMap& map, const octomap::OcTree& tree) {
  const TreeStatistics statistics = computeStatistics(map.tree());
  const std::size_t leaves = tree.getNumLeafNodes();
  std::printf("cells         %12zu cuboids (%zu occupied), %zu OctoMap leaves, ratio %.4f\n",
              map.tree().size(), map.content().occupied_cuboids, leaves,
              static_cast<double>(map.tree().size()) / static_cast<double>(leaves));
  std::printf("bytes         %12.1f MB R-tree (%.1f per cuboid), %.1f MB OctoMap\n",
              1e-6 * static_cast<double>(statistics.num_bytes),
              static_cast<double>(statistics.num_bytes) / static_cast<double>(map.tree().size()),
              1e-6 * static_cast<double>(tree.memoryUsage()));
  for (std::size_t level = 0; level < statistics.levels.size(); ++level) {
    const LevelStatistics& figures = statistics.levels[level];
    std::printf("level %zu       %12zu nodes, fill %.2f, overlap %.3f\n", level, figures.num_nodes,
                figures.fill_ratio, figures.overlap_ratio);
  }
  const Agreement agreement = compareWithOctomap(map, tree);
  std::printf(
      "agreement     %12.0f voxels, known mismatch %.0f, class mismatch %.0f, "
      "log-odds difference %.2g\n",
      agreement.voxels, agreement.known_mismatch, agreement.class_mismatch,
      agreement.max_log_odds_difference);
}

void printRuns(const std::vector<Run>& runs) {
  const auto median_of = [&runs](auto figure) {
    std::vector<double> values;
    values.reserve(runs.size());
    for (const Run& run : runs) values.push_back(figure(run));
    return median(values);
  };
  const auto own_cpu_s = [](const Run& run) { return run.walk.cpu_s + run.apply.cpu_s; };
  std::printf(
      "insertion     %12.3f s CPU (ray walk %.3f, update and fusion %.3f), wall %.3f; "
      "OctoMap %.3f s CPU, wall %.3f; ratio %.2f\n",
      median_of(own_cpu_s), median_of([](const Run& run) { return run.walk.cpu_s; }),
      median_of([](const Run& run) { return run.apply.cpu_s; }),
      median_of([](const Run& run) { return run.walk.wall_s + run.apply.wall_s; }),
      median_of([](const Run& run) { return run.octomap.cpu_s; }),
      median_of([](const Run& run) { return run.octomap.wall_s; }),
      median_of([&](const Run& run) { return run.octomap.cpu_s / own_cpu_s(run); }));
  std::printf("occupied      %12.3f ms to visit all, OctoMap %.3f ms\n",
              median_of([](const Run& run) { return run.access_cuboids_ms; }),
              median_of([](const Run& run) { return run.access_octomap_ms; }));
}

void compareMaps(const Options& options) {
  const std::vector<Scan> scans = readScans(options);
  std::size_t points = 0;
  for (const Scan& scan : scans) points += scan.points.size();
  std::printf(
      "dataset       %s: %zu clouds, %zu points; %g m voxels, fusion %s, (d, M) = (%d, %d)\n",
      options.dataset.c_str(), scans.size(), points, options.map.resolution_m,
      options.map.fusion.c_str(), options.map.rtree.min_branches, options.map.rtree.max_branches);
  std::vector<Run> runs;
  for (int i = 0; i < options.repeat; ++i) {
    CuboidMap map(options.map);
    octomap::OcTree tree = makeOctomap(options.map);
    runs.push_back(runOnce(options, scans, map, tree));
    if (i + 1 == options.repeat) printMaps(map, tree);
  }
  printRuns(runs);
}

}  // namespace
}  // namespace cuboid_mapping

int main(int argc, char** argv) {
  using namespace cuboid_mapping;
  Options options;
  options.map.resolution_m = 0.2;
  CLI::App app("Times cuboid_mapping beside OctoMap on the same clouds, in CPU seconds.");
  app.option_defaults()->always_capture_default();
  app.add_option("dataset", options.dataset, "Folder with scans/*.pcd and poses.txt, or a .graph")
      ->required();
  app.add_option("--resolution", options.map.resolution_m, "Edge of a voxel [m]")
      ->check(CLI::PositiveNumber);
  app.add_option("--max-range", options.max_range_m, "Beams are cut there [m]")
      ->check(CLI::PositiveNumber);
  app.add_option("--fusion", options.map.fusion, "Fusion strategy")
      ->check(CLI::IsMember(fusionNames()));
  app.add_option("--branching", options.map.rtree.max_branches, "M of the R-tree")
      ->check(CLI::Range(2, RTreeConfig::kMaxBranchesLimit));
  app.add_option("--clouds", options.clouds, "Only the first N clouds");
  app.add_option("--repeat", options.repeat, "Runs; the medians are printed")
      ->check(CLI::PositiveNumber);
  app.add_flag("!--no-octomap", options.with_octomap, "Without OctoMap, for profiling");
  CLI11_PARSE(app, argc, argv);
  options.map.rtree.min_branches = std::max(1, options.map.rtree.max_branches * 3 / 8);
  try {
    compareMaps(options);
  } catch (const std::exception& error) {
    std::cerr << "compare_maps: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
