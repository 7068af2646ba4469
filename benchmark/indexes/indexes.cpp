// SPDX-License-Identifier: BSD-3-Clause
// Why an R-tree: the same queries to the R-tree, a hash of bricks and a list of the same cuboids.
#include "indexes/cuboid_index.h"
#include "indexes/index_queries.h"

#include "dataset.h"
#include "machine.h"
#include "measurement.h"
#include "result_file.h"
#include "timing.h"

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/rtree/inner_tree.h"
#include "cuboid_mapping/scan/scan_update.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <stdexcept>

namespace cuboid_mapping::bench {
namespace {

using nlohmann::json;

struct Options : Measurement {
  int runs = 3;
  double query_time_s = kTimedQueries_s;  ///< CPU time of the timed queries of a kind, at least.
};

using Indexes = std::vector<std::unique_ptr<CuboidIndex>>;

struct Asked {
  std::vector<std::uint64_t> answers;  ///< Of the first queries: as many as there was time for.
  double us = 0.0;                     ///< CPU time of one.
};

Asked ask(const CuboidIndex& index, const IndexQueries& queries, double query_time_s) {
  using Clock = std::chrono::steady_clock;
  Asked asked;
  const auto deadline = Clock::now() + std::chrono::duration<double>(query_time_s);
  do {
    asked.answers.push_back(queries.ask(index, asked.answers.size()));
  } while (asked.answers.size() < queries.count && Clock::now() < deadline);
  const double all_s = cpuTimeOfOne_s(
      [&] {
        std::uint64_t sum = 0;
        for (std::size_t i = 0; i < asked.answers.size(); ++i) sum += queries.ask(index, i);
        return static_cast<double>(sum);
      },
      query_time_s);
  asked.us = 1e6 * all_s / static_cast<double>(asked.answers.size());
  return asked;
}

/// Medians of the CPU time of a query, by index. The indexes are asked in turns.
/// @throws std::logic_error when their answers differ.
json timeQueries(const Indexes& indexes, const IndexQueries& queries, const Options& options) {
  std::vector<std::vector<double>> times_us(indexes.size());
  std::vector<std::uint64_t> expected;
  std::size_t num_compared = queries.count;
  for (int run = 0; run < options.runs; ++run) {
    for (std::size_t i = 0; i < indexes.size(); ++i) {
      throwIfInterrupted();
      Asked asked = ask(*indexes[i], queries, options.query_time_s);
      times_us[i].push_back(asked.us);
      num_compared = std::min(num_compared, asked.answers.size());
      if (expected.size() < asked.answers.size()) expected.swap(asked.answers);
      if (!std::equal(asked.answers.begin(), asked.answers.end(), expected.begin())) {
        throw std::logic_error(queries.name + ": the answers of " + indexes[i]->name() + " differ");
      }
    }
  }
  json report{{"queries", queries.name}, {"compared", num_compared}};
  for (std::size_t i = 0; i < indexes.size(); ++i) {
    report[indexes[i]->name() + "_us"] = median(times_us[i]);
  }
  return report;
}

/// The branches of all bricks, as the map inserts them.
std::vector<Branch> branchesOf(const CuboidMap& map) {
  std::vector<Branch> branches;
  map.voxels().bricks().forEach([&](const Brick& brick) {
    Branch branch{{}, brick.voxels.isAnyOccupied(), map.voxels().bricks().indexOf(brick.brick)};
    (void)brick.cuboids.visit(CuboidFilter::kAll, [&](PackedBox box, Occupancy occupancy) {
      const CellBox cells = unpackCuboid(brick.brick, box, occupancy).box;
      branch.box = branch.box.isEmpty() ? cells : unite(branch.box, cells);
      return Visit::kContinue;
    });
    branches.push_back(branch);
  });
  std::sort(branches.begin(), branches.end(),
            [](const Branch& a, const Branch& b) { return a.child < b.child; });
  return branches;
}

/// CPU time in which all bricks get into the R-tree and into the hash, in the order in which they came.
json timeBuilding(const CuboidMap& map) {
  const std::vector<Branch> branches = branchesOf(map);
  const double rtree_s = cpuTimeOfOne_s([&] {
    InnerTree tree(map.config().rtree);
    tree.reserve(branches.size(), 0, map.voxels().bricks().endIndex());
    for (const Branch& branch : branches) tree.insert(branch);
    return static_cast<double>(tree.size());
  });
  struct Item {
    Cell brick;
    NodeIndex leaf = kNoNode;
  };
  const double hash_s = cpuTimeOfOne_s([&] {
    BrickTable<Item> table;
    for (const Branch& branch : branches) {
      table.findOrAdd(brickOf(branch.box.min)).leaf = branch.child;
    }
    return static_cast<double>(table.size());
  });
  const double list_s =
      cpuTimeOfOne_s([&] { return static_cast<double>(FlatList(map).numBytes()); });
  return {{"rtree_ms", 1e3 * rtree_s}, {"brick_hash_ms", 1e3 * hash_s}, {"list_ms", 1e3 * list_s}};
}

json measure(const Options& options) {
  MapConfig config;
  config.resolution_m = options.resolution_m;
  const std::vector<Scan> scans = readScans({options.dataset, "", "", options.max_clouds, 1});
  CuboidMap map(config);
  ScanUpdater updater(map.grid());
  std::vector<Eigen::Vector3d> places_map;
  for (const Scan& scan : scans) {
    throwIfInterrupted();
    map.apply(updater.compute(scan));
    places_map.push_back(scan.anchor_map + scan.origin.cast<double>());
  }
  const CuboidCounts counts = countCuboids(map);
  const Indexes indexes = makeIndexes(map);
  json report{{"resolution_m", options.resolution_m},
              {"clouds", scans.size()},
              {"runs", options.runs},
              {"commit", describeMachine().commit},
              {"cpu", describeMachine().cpu},
              {"cuboids", counts.total()},
              {"occupied", counts.occupied},
              {"bricks", map.voxels().size()},
              {"building", timeBuilding(map)}};
  for (const auto& index : indexes) report["bytes"][index->name()] = index->numBytes();
  const ByPlace<QuerySet> queries = makeQueries(map, scans);
  for (const IndexQueries& kind : makeIndexQueries(map, queries, places_map)) {
    report["queries"].push_back(timeQueries(indexes, kind, options));
  }
  return report;
}

int run(int argc, char** argv) {
  Options options;
  CommandLine line("cuboid_indexes",
                   "Sends the same queries to the R-tree, a hash of bricks and a list of the same "
                   "cuboids. Fails if answers differ.");
  declareMeasurement(line, options);
  line.addNumber("runs", options.runs, "repetitions of each kind of query; medians are shown",
                 {1, 100});
  line.addNumber("query-time", options.query_time_s, "least CPU time for each kind of query [s]",
                 {0.001, 60.0});
  if (const auto status = line.parse(argc, argv)) return *status;
  writeOrPrint(options.out, [&options] { return measure(options).dump(1) + '\n'; });
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("cuboid_indexes", argc, argv, cuboid_mapping::bench::run);
}
