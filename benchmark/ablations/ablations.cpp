// SPDX-License-Identifier: BSD-3-Clause
// What the speed comes from: the same work with parts of the engine, and with OctoMap given parts of it.
#include "ablations/box_counts.h"
#include "ablations/tree_only_adapter.h"

#include "command_line.h"
#include "cuboid_adapter.h"
#include "dataset.h"
#include "machine.h"
#include "measurement.h"
#include "octomap_descent.h"
#include "octomap_update.h"
#include "queries.h"
#include "result_file.h"
#include "timing.h"

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/scan/scan_update.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <functional>
#include <iostream>
#include <stdexcept>

namespace cuboid_mapping::bench {
namespace {

using nlohmann::json;
using octomap::OcTree;

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

struct Options : Measurement {
  int runs = 3;
};

/// One way of inserting all scans.
struct Insertion {
  std::string name;
  std::function<void(const std::vector<Scan>&)> run;
};

std::vector<Insertion> makeInsertions(const MapConfig& config) {
  const auto with_map = [](const MapConfig& map_config) {
    return [map_config](const std::vector<Scan>& scans) {
      CuboidMap map(map_config);
      ScanUpdater updater(map.grid());
      for (const Scan& scan : scans) map.apply(updater.compute(scan));
      if (map_config.fuse == FusionTime::kWhenRead) (void)countCuboids(map);
    };
  };
  MapConfig without_fusion = config;
  without_fusion.fusion = FusionKind::kNone;
  MapConfig when_read = config;
  when_read.fuse = FusionTime::kWhenRead;
  MapConfig every_cloud = config;
  every_cloud.fuse = FusionTime::kEveryCloud;
  return {{"octomap",
           [config](const std::vector<Scan>& scans) {
             OcTree tree = makeOctomap(config);
             for (const Scan& scan : scans) insertIntoOctomap(scan, kNoLimit, tree);
           }},
          {"octomap_with_ray_walk",
           [config](const std::vector<Scan>& scans) {
             OcTree tree = makeOctomap(config);
             ScanUpdater updater{Grid(config.resolution_m)};
             for (const Scan& scan : scans) updateOctomap(updater.compute(scan), tree);
           }},
          {"ray_walk",
           [config](const std::vector<Scan>& scans) {
             ScanUpdater updater{Grid(config.resolution_m)};
             for (const Scan& scan : scans) updater.compute(scan);
           }},
          {"voxels_without_tree", with_map(without_fusion)},  // As kept reports name it.
          {"fused_at_the_end", with_map(when_read)},
          {"fused_after_every_cloud", with_map(every_cloud)}};
}

json describe(std::vector<double> times_s) {
  std::sort(times_s.begin(), times_s.end());
  return {{"median_s", times_s[times_s.size() / 2]},
          {"min_s", times_s.front()},
          {"max_s", times_s.back()}};
}

/// In turn, so that all ways meet the same machine.
json timeInsertions(const Options& options, const MapConfig& config,
                    const std::vector<Scan>& scans) {
  const std::vector<Insertion> insertions = makeInsertions(config);
  std::vector<std::vector<double>> times_s(insertions.size());
  for (int run = 0; run < options.runs; ++run) {
    for (std::size_t i = 0; i < insertions.size(); ++i) {
      throwIfInterrupted();
      times_s[i].push_back(timeOf([&] { insertions[i].run(scans); }).cpu_s);
    }
  }
  json report;
  for (std::size_t i = 0; i < insertions.size(); ++i)
    report[insertions[i].name] = describe(times_s[i]);
  return report;
}

void addRates(const QueryRates& rates, json& report) {
  report["points_per_s"] = rates.points_per_s;
  report["boxes_per_s"] = rates.boxes_per_s;
  report["rays_per_s"] = rates.rays_per_s;
}

/// Rates of each map, and how many of its answers differ from those of the first.
json timeQueries(const std::vector<const MapAdapter*>& maps, const QuerySet& queries,
                 double resolution_m) {
  json report;
  std::optional<QueryAnswers> expected;
  for (const MapAdapter* map : maps) {
    throwIfInterrupted();
    const QueryRun run = askQueries(*map, queries);
    addRates(run.rates, report[map->name()]);
    if (!expected) expected = run.answers;
    const AnswerDifferences differences = compareAnswers(*expected, run.answers, resolution_m);
    const std::size_t num_different =
        differences.points.different + differences.boxes.different + differences.rays.different;
    report[map->name()]["different_answers"] = num_different;
  }
  return report;
}

json timeVisits(const OcTree& octomap, const MapAdapter& octomap_adapter, const MapAdapter& map) {
  return {{"octomap_iterator_ms",
           1e3 * cpuTimeOfOne_s([&] { return octomap_adapter.visitOccupied(); })},
          {"octomap_skipping_ms", 1e3 * cpuTimeOfOne_s([&] { return sumOccupied(octomap); })},
          {"rtree_ms", 1e3 * cpuTimeOfOne_s([&] { return map.visitOccupied(); })}};
}

json describeBoxes(const CuboidMap& map) {
  constexpr std::size_t kMaxBricks = 2000;
  std::vector<Cuboid> cuboids;
  visitAll(map, CuboidFilter::kAll, [&cuboids](const Cuboid& cuboid) {
    cuboids.push_back(cuboid);
    return Visit::kContinue;
  });
  const BoxCounts counts = countBoxes(map.voxels(), kMaxBricks);
  return {{"cuboids", cuboids.size()},
          {"joined_across_bricks", countJoined(cuboids)},
          {"sample",
           {{"bricks", counts.bricks},
            {"cuboids", counts.cuboids},
            {"best_of_orders", counts.best_of_orders},
            {"lower_bound", counts.lower_bound}}}};
}

/// Voxels that are known, and those of them that are stable: the paper fuses no others.
json describeStability(const CuboidMap& map) {
  std::size_t num_voxels = 0;
  std::size_t num_stable = 0;
  map.voxels().forEach([&](const VoxelBrick& brick) {
    brick.voxels.forEachValue([&](float log_odds, const BrickMask& voxels) {
      const auto count = static_cast<std::size_t>(voxels.count());
      num_voxels += count;
      if (map.sensorModel().isStable(log_odds)) num_stable += count;
    });
  });
  return {{"voxels", num_voxels}, {"stable", num_stable}};
}

json measure(const Options& options) {
  MapConfig config;
  config.resolution_m = options.resolution_m;
  const std::vector<Scan> scans = readScans({options.dataset, "", "", options.max_clouds, 1});
  json report{{"resolution_m", options.resolution_m},
              {"clouds", scans.size()},
              {"runs", options.runs},
              {"commit", describeMachine().commit},
              {"insertion", timeInsertions(options, config, scans)}};
  const InsertionConfig insertion{config, kNoLimit};
  CuboidAdapter ours(insertion, {});
  const auto octomap = makeOctomapAdapter(insertion);
  OcTree tree = makeOctomap(config);
  ScanUpdater updater{Grid(config.resolution_m)};
  CuboidMap growing(config);
  for (const Scan& scan : scans) {
    ours.insert(scan);
    octomap->insert(scan);
    const ScanUpdate& update = updater.compute(scan);
    updateOctomap(update, tree);
    growing.apply(update);
    report["stability"].push_back(describeStability(growing));
  }
  ours.finish();
  if (!octomap->compareWith(ours.map()).isExact() ||
      !compareWithOctomap(ours.map(), tree).isExact()) {
    throw std::logic_error("the maps differ");
  }
  const TreeOnlyAdapter tree_only(ours.map());
  const auto queries = makeQueries(ours.map(), scans);
  report["queries"] =
      timeQueries({octomap.get(), &ours, &tree_only}, queries.near_surface, options.resolution_m);
  report["boxes"] = describeBoxes(ours.map());
  report["visit_occupied"] = timeVisits(tree, *octomap, ours);
  return report;
}

int run(int argc, char** argv) {
  Options options;
  CommandLine line(
      "ablations",
      "Measures the time of parts of the map, and of OctoMap with some of these parts.");
  declareMeasurement(line, options);
  line.addNumber("runs", options.runs, "repetitions of each insertion; medians are shown",
                 {1, 100});
  if (const auto status = line.parse(argc, argv)) return *status;
  writeOrPrint(options.out, [&options] { return measure(options).dump(1) + '\n'; });
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("ablations", argc, argv, cuboid_mapping::bench::run);
}
