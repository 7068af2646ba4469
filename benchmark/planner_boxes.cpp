// SPDX-License-Identifier: BSD-3-Clause
// Boxes for planners, of files of maps: how many joined cuboids there are and what they take, and what covers of
// few boxes add.
#include "ablations/box_counts.h"
#include "command_line.h"
#include "cover_search.h"
#include "cuboid_mapping/boxes/box_cover.h"
#include "cuboid_mapping/boxes/free_boxes.h"
#include "cuboid_mapping/boxes/joined_cuboids.h"
#include "cuboid_mapping/io/map_files.h"

#include <algorithm>
#include <array>
#include <ctime>
#include <iostream>
#include <limits>

namespace cuboid_mapping {
namespace {

struct Options {
  std::vector<std::string> maps;
  int repetitions = 5;
  std::vector<int> boxes{50, 100, 200, 500, 1000};
  double search_s = 0.0;
};

/// The least number of cuboids that the six orders of axes leave, each repeated until none can be joined.
std::size_t countBestOfOrders(const std::vector<Cuboid>& all) {
  std::size_t best = all.size();
  std::array<int, 3> axes{0, 1, 2};
  do {
    best = std::min(best, bench::countJoined(all, axes));
  } while (std::next_permutation(axes.begin(), axes.end()));
  return best;
}

/// CPU time of this thread.
double cpuSeconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

template <typename WorkT>
double leastSeconds(int repetitions, WorkT work) {
  double least_s = std::numeric_limits<double>::infinity();
  for (int i = 0; i < repetitions; ++i) {
    const double begin_s = cpuSeconds();
    work();
    least_s = std::min(least_s, cpuSeconds() - begin_s);
  }
  return least_s;
}

void measureJoined(const CuboidMap& map, const Options& options) {
  std::vector<Cuboid> all;
  visitAll(map, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
    all.push_back(cuboid);
    return Visit::kContinue;
  });
  std::vector<Cuboid> joined;
  const double time_s = leastSeconds(options.repetitions, [&] {
    joined = joinCuboids(map, kAllCells, CuboidFilter::kAll, Budget::unlimited()).value;
  });
  double largest = 0.0;
  for (const Cuboid& cuboid : joined) largest = std::max(largest, cuboid.box.numVoxels());
  const std::size_t best = countBestOfOrders(all);
  const auto count = static_cast<double>(all.size());
  std::cout << "  cuboids " << all.size() << ", joined " << joined.size() << " ("
            << 100.0 * (1.0 - static_cast<double>(joined.size()) / count)
            << " % fewer), best of six orders " << best << " (ratio "
            << static_cast<double>(joined.size()) / static_cast<double>(best) << ")\n  largest "
            << largest << " voxels, " << 1e6 * time_s / count << " us a cuboid" << std::endl;
}

/// Boxes against added volume, in cubic metres.
void measureCovers(const CuboidMap& map, const Options& options) {
  const double voxel_m3 = map.grid().voxelVolume();
  std::cout << "  occupied " << map.voxels().numOccupiedVoxels() * voxel_m3
            << " m3; added by covers: boxes, ours, seconds, octree, bisection"
            << (options.search_s > 0.0 ? ", search from ours, search from bisection" : "")
            << "; free boxes: share of the free volume, disjoint and overlapping" << std::endl;
  for (const int count : options.boxes) {
    const auto max_boxes = static_cast<std::size_t>(count);
    CoverTask task;
    task.max_boxes = max_boxes;
    BoxCover cover;
    const double time_s =
        leastSeconds(1, [&] { cover = coverOccupied(map, task, Budget::unlimited()).value; });
    const auto bisection = bench::coverByBisection(map, max_boxes);
    const auto added_m3 = [&](const std::vector<CellBox>& boxes) {
      return bench::countAdded(map, boxes) * voxel_m3;
    };
    std::cout << "  " << count << ", " << cover.added_volume_m3 << ", " << time_s << ", "
              << added_m3(bench::coverByOctree(map, max_boxes)) << ", " << added_m3(bisection);
    if (options.search_s > 0.0) {
      for (const auto& begin : {cover.boxes, bisection}) {
        std::cout << ", " << added_m3(bench::searchCover(map, begin, options.search_s, 1));
      }
    }
    std::cout << ";";
    for (const bool may_overlap : {false, true}) {
      const FreeBoxes free =
          findFreeBoxes(map, {max_boxes, kAllCells, may_overlap}, Budget::unlimited()).value;
      std::cout << " "
                << free.covered_volume_m3 / (free.covered_volume_m3 + free.missing_volume_m3);
    }
    std::cout << std::endl;
  }
}

int run(int argc, char** argv) {
  Options options;
  CommandLine line("planner_boxes",
                   "Counts and times joined cuboids of maps, and covers by few boxes.");
  line.addArgument("maps", options.maps, "maps: .cuboids, .sqlite, .ot or .bt");
  line.addNumber("repetitions", options.repetitions, "number of runs; the shortest time counts",
                 {1, 1000});
  line.addList("boxes", options.boxes, "numbers of boxes of the covers", {1, 1e6});
  line.addNumber("search", options.search_s,
                 "seconds of a random search for better covers, from ours and from another one",
                 {0, 1e6});
  if (const auto status = line.parse(argc, argv)) return *status;
  for (const std::string& file : options.maps) {
    const CuboidMap map = loadMap(file);
    std::cout << file << ", " << map.grid().resolution() << " m" << std::endl;
    measureJoined(map, options);
    measureCovers(map, options);
  }
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("planner_boxes", argc, argv, cuboid_mapping::run);
}
