// SPDX-License-Identifier: BSD-3-Clause
#include "options.h"

#include "command_line.h"
#include "machine.h"

#include <cstdint>
#include <iostream>
#include <limits>
#include <map>
#include <stdexcept>

namespace cuboid_mapping::bench {
namespace {

/// What has to be checked or converted behind the parser.
struct RawOptions {
  std::vector<std::string> peers;
  std::int64_t clouds = std::numeric_limits<std::int64_t>::max();
};

void addEngineOptions(CLI::App& app, Options& options) {
  app.add_option("--threads", options.engine.threads, "Threads of cuboid_mapping and OpenVDB")
      ->check(CLI::Range(1, 256));
  app.add_flag("--fuse-every-cloud", options.engine.fuses_every_cloud,
               "Bring all cuboids into the R-tree after every cloud");
}

void addMapOptions(CLI::App& app, Options& options) {
  MapConfig& map = options.insertion.map;
  std::map<std::string, Environment> environments;
  for (const Environment value : {Environment::kDynamic, Environment::kStatic}) {
    environments.emplace(toString(value), value);
  }
  app.add_option("--resolution", map.resolution_m, "Edge of a voxel [m]")
      ->capture_default_str()
      ->check(CLI::Range(0.001, 1000.0));
  app.add_option("--max-range", options.insertion.max_range_m,
                 "Beams are cut there [m]; no limit unless given")
      ->check(CLI::PositiveNumber);
  std::map<std::string, FusionKind> fusions;
  for (const FusionKind kind : {FusionKind::kClass, FusionKind::kGrowth, FusionKind::kNone}) {
    fusions.emplace(toString(kind), kind);
  }
  app.add_option("--fusion", map.fusion, "class, growth or none")
      ->transform(CLI::CheckedTransformer(fusions));
  app.add_option("--environment", map.environment,
                 "dynamic or static; OctoMap has no static one, and differs then")
      ->transform(CLI::CheckedTransformer(environments));
  app.add_option("--branching", map.rtree.max_branches, "M of the R-tree")
      ->capture_default_str()
      ->check(CLI::Range(2, RTreeConfig::kMaxBranchesLimit));
}

void addInputOptions(CLI::App& app, Options& options, RawOptions& raw) {
  app.add_option("dataset", options.dataset,
                 "A folder with poses.txt and scans/NNNN.pcd, an OctoMap .graph, or a .bag")
      ->required();
  app.add_option("--cloud-topic", options.cloud_topic,
                 "Of the bag's PointCloud2; need not be given where there is one only");
  app.add_option("--map-frame", options.map_frame, "Fixed frame in the bag's tf")
      ->capture_default_str();
  app.add_option("--clouds", raw.clouds, "Only the first N clouds")
      ->check(CLI::Range(std::int64_t{1}, std::numeric_limits<std::int64_t>::max()));
}

void addRunOptions(CLI::App& app, Options& options, RawOptions& raw) {
  app.add_option("--laps", options.laps,
                 "All clouds so many times, each time elsewhere: how cost grows with the map")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  app.add_option("--repeat", options.repeat, "Runs; the medians are reported")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  app.add_option("--peers", raw.peers,
                 "octomap, openvdb, or both with a comma, or none; all that there are unless given")
      ->delimiter(',')
      ->check(CLI::IsMember({"octomap", "openvdb", "none"}));
  app.add_option("--json", options.json_file, "Write all figures there");
}

void takePeers(const std::vector<std::string>& peers, Options& options) {
  if (peers.empty()) return;
  const auto has = [&peers](const char* name) {
    return std::find(peers.begin(), peers.end(), name) != peers.end();
  };
  if (has("none") && peers.size() > 1) {
    throw std::runtime_error("--peers: none goes with no other");
  }
  options.with_octomap = has("octomap");
  options.with_openvdb = has("openvdb");
  if (options.with_openvdb && !Options::hasOpenvdb()) {
    throw std::runtime_error(
        "--peers openvdb: this program was built without OpenVDB; install "
        "libopenvdb-dev and build it anew");
  }
}

}  // namespace

bool Options::hasOpenvdb() { return CUBOID_MAPPING_HAS_OPENVDB != 0; }

std::optional<int> parseOptions(int argc, char** argv, Options& options) {
  RawOptions raw;
  options.insertion.max_range_m = std::numeric_limits<double>::infinity();
  options.insertion.map.resolution_m = 0.2;
  CLI::App app("Times cuboid_mapping beside OctoMap and OpenVDB on the same clouds.",
               "compare_maps");
  addInputOptions(app, options, raw);
  addMapOptions(app, options);
  addEngineOptions(app, options);
  addRunOptions(app, options, raw);
  app.add_flag_callback(
      "--version",
      [] {
        std::cout << describeMachine().commit << std::endl;
        throw CLI::Success();
      },
      "Print the commit of the sources and exit");
  if (const auto status = parseCommandLine(app, argc, argv)) return status;
  takePeers(raw.peers, options);
  options.clouds = static_cast<std::size_t>(raw.clouds);
  RTreeConfig& rtree = options.insertion.map.rtree;
  rtree.min_branches = std::max(1, rtree.max_branches * 3 / 8);
  return std::nullopt;
}

}  // namespace cuboid_mapping::bench
