// SPDX-License-Identifier: BSD-3-Clause
// Compares two maps voxel by voxel.
#include "command_line.h"
#include "cuboid_mapping/io/map_files.h"
#include "map_comparison.h"
#include "progress_bar.h"

#include <cmath>
#include <iostream>
#include <sstream>

namespace cuboid_mapping {
namespace {

constexpr int kDifferent = 2;

struct Options {
  std::string first;
  std::string second;
  double tolerance = 1e-3;
};

void checkResolutions(const MapFile& first, const MapFile& second) {
  const double a = first.snapshot.resolution_m;
  const double b = second.snapshot.resolution_m;
  if (std::abs(a - b) <= 1e-9 * a) return;
  std::ostringstream text;
  text << "the maps have different resolutions, " << a << " and " << b
       << " m: their voxels cannot be compared";
  throw std::runtime_error(text.str());
}

int compare(const Options& options) {
  const MapFile first = readMapFile(options.first);
  throwIfInterrupted();
  const MapFile second = readMapFile(options.second);
  throwIfInterrupted();
  checkResolutions(first, second);
  const bool is_by_class =
      first.format == MapFormat::kOctomapBinary || second.format == MapFormat::kOctomapBinary;
  const MapAgreement agreement =
      compareMaps(first.snapshot, second.snapshot, showProgress("bricks compared"));
  std::cout.precision(15);
  std::cout << "known to both:     " << agreement.known_to_both << " voxels\n"
            << "only in the first: " << agreement.only_in_first << " voxels\n"
            << "only in the second: " << agreement.only_in_second << " voxels\n"
            << "different class:   " << agreement.class_mismatch << " voxels\n";
  const bool is_same = agreement.isSameByClass() &&
                       (is_by_class || agreement.max_log_odds_difference <= options.tolerance);
  if (!is_by_class) {
    std::cout << "log-odds differ by at most " << agreement.max_log_odds_difference << '\n';
  }
  std::cout << (is_same ? "the maps agree" : "the maps differ") << std::endl;
  return is_same ? 0 : kDifferent;
}

int run(int argc, char** argv) {
  Options options;
  CommandLine line("map_compare",
                   "Compares two maps voxel by voxel; if one is a .bt file, by class only.\n"
                   "Exit status: 0 they agree, 2 they differ, 1 an error.");
  line.addArgument("first", options.first, "map: .cuboids, .sqlite, .ot or .bt");
  line.addArgument("second", options.second, "map: .cuboids, .sqlite, .ot or .bt");
  line.addNumber("tolerance", options.tolerance, "largest accepted difference of log-odds",
                 {0.0, 1e3});
  if (const auto status = line.parse(argc, argv)) return *status;
  return compare(options);
}

}  // namespace
}  // namespace cuboid_mapping

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("map_compare", argc, argv, cuboid_mapping::run);
}
