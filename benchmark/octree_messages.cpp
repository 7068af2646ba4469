// SPDX-License-Identifier: BSD-3-Clause
// Times octomap_full and octomap_binary made of a map beside OctoMap's own serialization.
#include "command_line.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/io/octree_stream.h"

#include <octomap/OcTree.h>

#include <algorithm>
#include <ctime>
#include <functional>
#include <iostream>
#include <limits>
#include <sstream>
#include <vector>

namespace cuboid_mapping::bench {
namespace {

constexpr int kRuns = 15;

using Work = std::function<void()>;

/// CPU time of one run in milliseconds.
double measure_ms(const Work& work) {
  throwIfInterrupted();
  const std::clock_t start = std::clock();
  work();
  return 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

/// The least time of each piece of work, which other programs disturb least. In turn, so that all
/// of them meet the same machine.
std::vector<double> measureInTurn_ms(const std::vector<Work>& pieces) {
  std::vector<double> times_ms(pieces.size(), std::numeric_limits<double>::infinity());
  for (int run = 0; run < kRuns; ++run) {
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      times_ms[i] = std::min(times_ms[i], measure_ms(pieces[i]));
    }
  }
  return times_ms;
}

int compare(const std::string& file) {
  const MapSnapshot snapshot = readMapFile(file).snapshot;
  MapConfig config;
  config.resolution_m = snapshot.resolution_m;
  CuboidMap map(config);
  map.replace(kAllCells, snapshot.bricks);
  const std::string full = toOctreeStream(snapshot.bricks, OctreeKind::kFull).bytes;
  octomap::OcTree tree(snapshot.resolution_m);
  std::istringstream in(full);
  tree.readData(in);
  std::ostringstream written;
  tree.writeData(written);
  const bool is_same = written.str() == full;

  const auto write_octomap = [&] {
    std::ostringstream out;
    tree.writeData(out);
  };
  // With the copy of the cuboids that is taken while the map is held.
  const auto write_full = [&] {
    (void)toOctreeStream(takeSnapshot(map, "").bricks, OctreeKind::kFull);
  };
  const auto write_binary = [&] {
    (void)toOctreeStream(takeSnapshot(map, "").bricks, OctreeKind::kBinary);
  };
  const std::vector<double> times_ms = measureInTurn_ms({write_octomap, write_full, write_binary});
  std::cout << file << ": " << snapshot.bricks.size() << " bricks, " << tree.size() << " nodes, "
            << full.size() << " bytes, " << (is_same ? "same bytes" : "DIFFERENT")
            << "\n  octomap::OcTree::writeData " << times_ms[0] << " ms, from cuboids "
            << times_ms[1] << " ms: " << times_ms[1] / times_ms[0]
            << " times as long\n  octomap_binary from cuboids " << times_ms[2] << " ms"
            << std::endl;
  return is_same ? 0 : 1;
}

int run(int argc, char** argv) {
  std::vector<std::string> files;
  CommandLine line(
      "octree_messages",
      "Compares the time to serialize a map as an octree with OctoMap's own serialization.");
  line.addArgument("maps", files, "map: .cuboids, .sqlite, .ot or .bt");
  if (const auto status = line.parse(argc, argv)) return *status;
  int status = 0;
  for (const std::string& file : files) status |= compare(file);
  return status;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("octree_messages", argc, argv, cuboid_mapping::bench::run);
}
