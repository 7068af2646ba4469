// SPDX-License-Identifier: BSD-3-Clause
#include "options.h"

#include "command_line.h"
#include "machine.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace cuboid_mapping::bench {
namespace {

/// What has to be checked or converted behind the parser.
struct RawOptions {
  std::vector<std::string> peers;
  std::string environment = toString(Environment::kDynamic);
  std::string fusion = toString(FusionKind::kClass);
};

void addInputOptions(CommandLine& line, Options& options) {
  line.addArgument("dataset", options.dataset,
                   "a folder with poses.txt and scans/NNNN.pcd, an OctoMap .graph, or a .bag");
  line.addText("cloud-topic", options.cloud_topic,
               "topic of the clouds in a bag; needed only if there are several");
  line.addText("map-frame", options.map_frame, "fixed frame in the bag's tf");
  line.addNumber("clouds", options.clouds, "only the first N clouds", {1});
  line.addNumber("every", options.every, "only the first of N clouds", {1, 1000000});
  line.addNumber("point-step", options.point_step, "only the first of N points of a cloud",
                 {1, 1000000});
}

void addMapOptions(CommandLine& line, Options& options, RawOptions& raw) {
  MapConfig& map = options.insertion.map;
  line.addNumber("resolution", map.resolution_m, "edge of a voxel [m]", {0.001, 1000.0});
  line.addNumber("max-range", options.insertion.max_range_m,
                 "longer beams are cut off here [m]; without it, there is no limit", {0.001});
  line.addText(
      "fusion", raw.fusion, "how voxels become cuboids",
      {toString(FusionKind::kClass), toString(FusionKind::kGrowth), toString(FusionKind::kNone)});
  line.addText("environment", raw.environment,
               "environment of the map; static maps differ from OctoMap, which has no such option",
               {toString(Environment::kDynamic), toString(Environment::kStatic)});
  line.addNumber("branching", map.rtree.max_branches, "M of the R-tree",
                 {4, RTreeConfig::kMaxBranchesLimit});
}

std::string namesOfBuilt() {
  std::string names;
  for (const Peer& peer : allPeers()) {
    if (peer.make != nullptr) names += (names.empty() ? "" : ", ") + peer.name;
  }
  return names;
}

void addRunOptions(CommandLine& line, Options& options, RawOptions& raw) {
  line.addNumber("threads", options.insertion.map.threads,
                 "number of threads for cuboid_mapping and OpenVDB", {1, 256});
  line.addFlag("fuse-every-cloud", options.engine.fuses_every_cloud,
               "divide changed bricks into cuboids after every cloud, as the node does; else once, "
               "at the end");
  line.addNumber(
      "laps", options.laps,
      "insert all clouds this often, each time at another place: shows how cost grows with the map",
      {1, 1000});
  line.addNumber(
      "repeat", options.repeat,
      "number of runs, every second one with the maps in reverse order; medians are reported",
      {1, 1000});
  line.addNumber("shuffle", options.shuffle,
                 "seed of a random order of the maps in each run; 0: no random order",
                 {0, 1000000});
  line.addNumber("cloud-samples", options.cloud_samples,
                 "also fill each map again and again until the times of N clouds are known: "
                 "quantiles of all of them",
                 {0, 10000000});
  line.addNumber("query-time", options.query_time_s, "least CPU time for each kind of query [s]",
                 {0.001, 60.0});
  Choices choices{"all", "none"};
  for (const Peer& peer : allPeers()) choices.push_back(peer.name);
  line.addList("peers", raw.peers,
               "maps to compare with; default: octomap, and openvdb if built with it; all: every "
               "map of this build: " +
                   namesOfBuilt(),
               choices);
  line.addText("json", options.json_file, "write all figures to this file");
  line.addVersion(describeMachine().commit);
}

/// @param names  As given to --peers.
std::vector<Peer> choosePeers(const std::vector<std::string>& names) {
  const auto has = [&names](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  if ((has("none") || has("all")) && names.size() > 1) {
    throw std::runtime_error("--peers: none and all cannot be combined with others");
  }
  std::vector<Peer> chosen;
  for (const Peer& peer : allPeers()) {
    if (has(peer.name) && peer.make == nullptr) {
      throw std::runtime_error("--peers " + peer.name +
                               ": this program was built without it; install " + peer.needs +
                               " and build it again");
    }
    const bool is_default = peer.name == "octomap" || peer.name == "openvdb";
    const bool is_wanted = has("all") || has(peer.name) || (names.empty() && is_default);
    if (is_wanted && peer.make != nullptr) chosen.push_back(peer);
  }
  return chosen;
}

}  // namespace

std::optional<int> parseOptions(int argc, char** argv, Options& options) {
  RawOptions raw;
  options.insertion.max_range_m = std::numeric_limits<double>::infinity();
  options.insertion.map.resolution_m = 0.2;
  CommandLine line("compare_maps",
                   "Compares the speed, memory and content of cuboid_mapping, OctoMap, OpenVDB and "
                   "others on the same clouds.");
  addInputOptions(line, options);
  addMapOptions(line, options, raw);
  addRunOptions(line, options, raw);
  if (const auto status = line.parse(argc, argv)) return status;
  options.peers = choosePeers(raw.peers);
  if (raw.environment == toString(Environment::kStatic)) {
    options.insertion.map.environment = Environment::kStatic;
  }
  options.insertion.map.fusion = *parseFusionKind(raw.fusion);
  RTreeConfig& rtree = options.insertion.map.rtree;
  rtree.min_branches = std::max(2, rtree.max_branches * 3 / 8);
  return std::nullopt;
}

}  // namespace cuboid_mapping::bench
