// SPDX-License-Identifier: BSD-3-Clause
// What a user gets for a byte: memory, file and boxes of each map beside the information that it loses.
#include "command_line.h"
#include "dataset.h"
#include "machine.h"
#include "measurement.h"
#include "peers.h"
#include "result_file.h"

#include "cuboid_mapping/io/native_format.h"
#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/scan/scan_update.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <iostream>
#include <sstream>

namespace cuboid_mapping::bench {
namespace {

using nlohmann::json;
using octomap::OcTree;

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

struct Options : Measurement {
  int coarsest = 8;
};

CuboidMap makeMap(const MapConfig& config, const std::vector<Scan>& scans) {
  CuboidMap map(config);
  ScanUpdater updater(map.grid());
  for (const Scan& scan : scans) {
    throwIfInterrupted();
    map.apply(updater.compute(scan));
  }
  return map;
}

/// The map with the clamping threshold of its class in every voxel, as octomap's toMaxLikelihood().
CuboidMap keepClasses(const CuboidMap& map) {
  std::vector<UniformBox> boxes;
  visitAll(map, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
    boxes.push_back(
        {cuboid.box, cuboid.isOccupied() ? map.sensorModel().max() : map.sensorModel().min()});
    return Visit::kContinue;
  });
  CuboidMap classes(map.config());
  classes.replace(kAllCells, boxes);
  return classes;
}

/// Kullback-Leibler divergence of two Bernoulli distributions, in bits.
double computeDivergence(double p, double q) {
  return p * std::log2(p / q) + (1.0 - p) * std::log2((1.0 - p) / (1.0 - q));
}

/// Mean over the voxels that are known to the finest map; unknown is a probability of 0.5.
/// @param scale  Edge of a voxel of `map` in voxels of the finest.
double lostBits(const CuboidMap& finest, const CuboidMap& map, int scale) {
  double sum = 0.0;
  double count = 0.0;
  const auto divide = [scale](std::int32_t at) {
    return at >= 0 ? at / scale : -((scale - 1 - at) / scale);
  };
  finest.voxels().forEach([&](const VoxelBrick& brick) {
    brick.voxels.forEachValue([&](float log_odds, const BrickMask& voxels) {
      forEachCell(brick.brick, voxels, [&](const Cell& cell) {
        const auto found = map.voxels().logOddsAt({divide(cell.x), divide(cell.y), divide(cell.z)});
        sum += computeDivergence(toProbability(log_odds), toProbability(found.value_or(0.0F)));
        count += 1.0;
      });
    });
  });
  return sum / count;
}

/// A row of the report: one map at one resolution.
struct Row {
  std::string map;
  double resolution_m;
  std::size_t cells;
  std::size_t memory_bytes;
  std::size_t file_bytes;  ///< 0: there is no file.
  double lost_bits;
};

json toJson(const Row& row) {
  return {{"map", row.map},
          {"resolution_m", row.resolution_m},
          {"cells", row.cells},
          {"memory_bytes", row.memory_bytes},
          {"file_bytes", row.file_bytes},
          {"lost_bits", row.lost_bits}};
}

std::size_t nativeBytes(const CuboidMap& map) {
  return toNativeFormat(takeSnapshot(map, "map")).size();
}

void addOctomap(const std::vector<Scan>& scans, const Row& exact, const Row& classes, json& rows) {
  MapConfig config;
  config.resolution_m = exact.resolution_m;
  OcTree tree = makeOctomap(config);
  for (const Scan& scan : scans) {
    throwIfInterrupted();
    insertIntoOctomap(scan, kNoLimit, tree);
  }
  std::ostringstream full;
  tree.writeData(full);
  rows.push_back(toJson({"octomap", exact.resolution_m, tree.getNumLeafNodes(), tree.memoryUsage(),
                         full.str().size(), exact.lost_bits}));
  tree.toMaxLikelihood();
  tree.prune();
  std::ostringstream binary;
  tree.writeBinaryData(binary);
  rows.push_back(toJson({"octomap, classes", exact.resolution_m, tree.getNumLeafNodes(),
                         tree.memoryUsage(), binary.str().size(), classes.lost_bits}));
}

void addOpenvdb(const std::vector<Scan>& scans, const Row& exact, json& rows) {
  MapConfig config;
  config.resolution_m = exact.resolution_m;
  const PeerMaker make = findPeer("openvdb").make;
  if (make == nullptr) return;
  const auto openvdb = make({config, kNoLimit});
  for (const Scan& scan : scans) {
    throwIfInterrupted();
    openvdb->insert(scan);
  }
  openvdb->finish();
  openvdb->dropScratch();
  const MapFigures figures = openvdb->figures();
  rows.push_back(toJson(
      {"openvdb", exact.resolution_m, figures.cells, figures.bytes_own, 0, exact.lost_bits}));
}

json measure(const Options& options) {
  const std::vector<Scan> scans = readScans({options.dataset, "", "", options.max_clouds, 1});
  MapConfig config;
  config.resolution_m = options.resolution_m;
  const CuboidMap finest = makeMap(config, scans);
  json rows = json::array();
  for (int scale = 1; scale <= options.coarsest; scale *= 2) {
    config.resolution_m = options.resolution_m * scale;
    const CuboidMap map = makeMap(config, scans);
    const CuboidMap kept = keepClasses(map);
    const Row exact{"cuboid_mapping", config.resolution_m, countCuboids(map).total(),
                    map.numBytes(),   nativeBytes(map),    lostBits(finest, map, scale)};
    const Row classes{"cuboid_mapping, classes",  config.resolution_m,
                      countCuboids(kept).total(), kept.numBytes(),
                      nativeBytes(kept),          lostBits(finest, kept, scale)};
    rows.push_back(toJson(exact));
    rows.push_back(toJson(classes));
    addOctomap(scans, exact, classes, rows);
    addOpenvdb(scans, exact, rows);
  }
  return {{"finest_m", options.resolution_m},
          {"voxels", finest.voxels().numFreeVoxels() + finest.voxels().numOccupiedVoxels()},
          {"commit", describeMachine().commit},
          {"rows", rows}};
}

int run(int argc, char** argv) {
  Options options;
  CommandLine line("rate_distortion", "Compares the bytes of maps with the information they lose.");
  declareMeasurement(line, options, "edge of the finest voxels, which lose nothing [m]");
  line.addNumber("coarsest", options.coarsest, "edge of the coarsest voxels, in finest ones",
                 {1, 1024});
  if (const auto status = line.parse(argc, argv)) return *status;
  writeOrPrint(options.out, [&options] { return measure(options).dump(1) + '\n'; });
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("rate_distortion", argc, argv, cuboid_mapping::bench::run);
}
