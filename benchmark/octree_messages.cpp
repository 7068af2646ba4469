// SPDX-License-Identifier: BSD-3-Clause
// Times octomap_full and octomap_binary made of a map beside OctoMap's own serialization.
#include "command_line.h"
#include "cuboid_mapping/interop/octree_stream.h"
#include "cuboid_mapping/io/map_files.h"

#include <octomap/OcTree.h>

#include <algorithm>
#include <ctime>
#include <functional>
#include <iostream>
#include <sstream>
#include <vector>

namespace cuboid_mapping::bench {
namespace {

constexpr int kRuns = 15;

/// CPU time in milliseconds: the least of some runs, which other programs disturb least.
double measure_ms(const std::function<void()>& work) {
  std::vector<double> times_ms;
  for (int run = 0; run < kRuns; ++run) {
    throwIfInterrupted();
    const auto start = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
    times_ms.push_back(time.count());
  }
  return *std::min_element(times_ms.begin(), times_ms.end());
}

int compare(const std::string& file) {
  const MapSnapshot snapshot = readMapFile(file).snapshot;
  MapConfig config;
  config.resolution_m = snapshot.resolution_m;
  CuboidMap map(config);
  map.replace(kAllCells, snapshot.cuboids);
  const std::string full = toOctreeStream(snapshot.cuboids, OctreeKind::kFull).bytes;
  octomap::OcTree tree(snapshot.resolution_m);
  std::istringstream in(full);
  tree.readData(in);
  std::ostringstream written;
  tree.writeData(written);
  const bool is_same = written.str() == full;

  const double octomap_ms = measure_ms([&] {
    std::ostringstream out;
    tree.writeData(out);
  });
  const auto measure_here = [&](OctreeKind kind) {
    return measure_ms([&] {
      // With the copy of the cuboids that is taken while the map is held.
      (void)toOctreeStream(takeSnapshot(map, "").cuboids, kind);
    });
  };
  const double full_ms = measure_here(OctreeKind::kFull);
  std::cout << file << ": " << snapshot.cuboids.size() << " cuboids, " << tree.size() << " nodes, "
            << full.size() << " bytes, " << (is_same ? "same bytes" : "DIFFERENT")
            << "\n  octomap::OcTree::writeData " << octomap_ms << " ms, from cuboids " << full_ms
            << " ms: " << full_ms / octomap_ms << " times as long\n  octomap_binary from cuboids "
            << measure_here(OctreeKind::kBinary) << " ms" << std::endl;
  return is_same ? 0 : 1;
}

int run(int argc, char** argv) {
  std::vector<std::string> files;
  CLI::App app("Times octrees made of a map beside OctoMap's own serialization of the same tree.",
               "octree_messages");
  app.add_option("maps", files, "native, OctoMap .ot or .bt")->required();
  if (const auto status = parseCommandLine(app, argc, argv)) return *status;
  int status = 0;
  for (const std::string& file : files) status |= compare(file);
  return status;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  cuboid_mapping::catchInterrupts();
  return cuboid_mapping::runProgram("octree_messages",
                                    [&] { return cuboid_mapping::bench::run(argc, argv); });
}
