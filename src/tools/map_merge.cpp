// SPDX-License-Identifier: BSD-3-Clause
// Merges one finished map into another.
#include "cuboid_mapping/map/map_merge.h"
#include "command_line.h"
#include "cuboid_mapping/io/map_files.h"
#include "map_content.h"
#include "progress_bar.h"

#include <iostream>
#include <stdexcept>

namespace cuboid_mapping {
namespace {

constexpr double kRadiansOfDegree = M_PI / 180.0;

struct Options {
  std::string first;
  std::string second;
  std::string output;
  std::string rule = toString(MergeRule::kSum);
  std::vector<double> turn_deg;
  std::vector<double> shift_m;
};

Eigen::Isometry3d toTransform(const Options& options) {
  Eigen::Isometry3d T_first_second = Eigen::Isometry3d::Identity();
  if (!options.shift_m.empty()) {
    T_first_second.translation() = Eigen::Vector3d(options.shift_m.data());
  }
  if (!options.turn_deg.empty()) {
    const auto about = [&options](std::size_t axis) {
      const auto number = static_cast<Eigen::Index>(axis);
      return Eigen::AngleAxisd(kRadiansOfDegree * options.turn_deg[axis],
                               Eigen::Vector3d::Unit(number));
    };
    T_first_second.linear() = (about(2) * about(1) * about(0)).toRotationMatrix();
  }
  return T_first_second;
}

/// The second map in the frame of the first.
MapSnapshot readSecond(const Options& options, const MapSnapshot& first) {
  MapSnapshot second = readMapFile(options.second, first.sensor_model).snapshot;
  throwIfInterrupted();
  if (!options.turn_deg.empty() || !options.shift_m.empty()) {
    const bool is_exact = moveMap(toTransform(options), second);
    std::cout << options.second << ": " << describeMotion(is_exact) << std::endl;
  } else if (!first.frame_id.empty() && !second.frame_id.empty() &&
             first.frame_id != second.frame_id) {
    throw std::runtime_error("the maps are in the frames '" + first.frame_id + "' and '" +
                             second.frame_id + "': give the transform with --shift and --turn");
  }
  return second;
}

int merge(const Options& options) {
  const MapFormat format = checkOutput(options.output);
  MapSnapshot map = readMapFile(options.first).snapshot;
  throwIfInterrupted();
  const MergeRule rule = *mergeRuleOfName(options.rule);
  const MapOverlap overlap = mergeMaps(map, readSecond(options, map), rule);
  throwIfInterrupted();
  const std::size_t num_bytes = writeMapFile(options.output, map, showProgress("bricks written"));
  std::cout << options.output << ": " << describeContent(map, format) << ", " << num_bytes
            << " bytes; " << describe(overlap, rule) << std::endl;
  return 0;
}

int run(int argc, char** argv) {
  Options options;
  CommandLine line("map_merge",
                   "Merges two maps of the same resolution. The result is not the map of "
                   "all\nclouds together: doc/fleet.md.");
  line.addArgument(
      "first", options.first,
      "map: .cuboids, .sqlite, .ot or .bt; gives the result its frame and sensor model");
  line.addArgument("second", options.second, "map: .cuboids, .sqlite, .ot or .bt");
  line.addText("output,o", options.output, "map to write: " + knownEndings());
  line.addText("rule", options.rule,
               "log-odds of voxels known to both: their sum, the second map's, or the greater ones",
               {"sum", "later", "occupied"});
  line.addPoint(
      "turn", options.turn_deg,
      "rotation of the second map in the frame of the first: about x, then y, then z, in degrees");
  line.addPoint(
      "shift", options.shift_m,
      "translation of the second map in the frame of the first, after the rotation, in metres");
  if (const auto status = line.parse(argc, argv)) return *status;
  if (options.output.empty()) throw std::runtime_error("--output is missing");
  return merge(options);
}

}  // namespace
}  // namespace cuboid_mapping

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("map_merge", argc, argv, cuboid_mapping::run);
}
