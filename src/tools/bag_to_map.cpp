// SPDX-License-Identifier: BSD-3-Clause
// Makes a map of the clouds in rosbags, without a roscore, as fast as the machine.
#include "bag_clouds.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/forgetting.h"
#include "cuboid_mapping/ros/moving_filter.h"
#include "map_content.h"
#include "progress_bar.h"

#include <chrono>
#include <iomanip>
#include <iostream>
#include <stdexcept>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::counted;

/// @param frees_passed  Whether what has passed goes out of the map at the end.
int makeMap(const BagOptions& options, bool frees_passed) {
  const auto start = std::chrono::steady_clock::now();
  const cuboid_mapping::MapFormat format = checkOutput(options);
  BagClouds clouds("bag_to_map", options);
  cuboid_mapping::CuboidMap map(makeMapConfig(clouds.parameters()));
  Forgetting forgetting(clouds.parameters().forget_after_s, clouds.parameters().forget_class);
  const MovingPoints what = clouds.parameters().moving_points;
  MovingFilter moving(
      clouds.parameters().map.resolution_m,
      what == MovingPoints::kIgnore && frees_passed ? MovingPoints::kPublish : what);
  clouds.walk(
      {},
      [&](const cuboid_mapping::ScanUpdate* update, const BagClouds::Origin& origin) {
        if (update == nullptr) return;
        map.apply(moving.take(*update), clouds.sensorModel(origin.source));
        forgetting.note(*update, origin.stamp);
        forgetting.forget(map);
      },
      cuboid_mapping::showProgress("clouds"));
  clouds.report(clouds.leftOut());
  if (const auto advice = clouds.advice()) {
    std::cerr << "bag_to_map: a node could not keep up with these clouds: " << *advice << std::endl;
  }
  const NodeStatistics& statistics = clouds.statistics();
  if (statistics.num_inserted == 0) {
    throw std::runtime_error("none of " + counted(statistics.num_received, "cloud") +
                             " could be used: nothing was written");
  }
  const std::size_t num_freed = frees_passed ? freeVoidVoxels(moving.voidSpace(), map) : 0;
  const cuboid_mapping::MapSnapshot snapshot =
      takeSnapshot(map, withoutSlash(clouds.parameters().frame_id));
  cuboid_mapping::throwIfInterrupted();
  const std::size_t num_bytes = cuboid_mapping::writeMapFile(options.output, snapshot);
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
  std::cout << std::fixed << std::setprecision(1) << options.output << ": "
            << statistics.num_inserted << " of " << counted(statistics.num_received, "cloud")
            << ", " << counted(statistics.num_points, "point") << ", "
            << cuboid_mapping::describeContent(snapshot, format) << ", " << num_bytes
            << " bytes, in " << time.count() << " s" << std::endl;
  if (frees_passed) {
    std::cout << counted(num_freed, "occupied voxel") << " of what has passed freed" << std::endl;
  }
  return 0;
}

int run(int argc, char** argv) {
  BagOptions options;
  cuboid_mapping::CommandLine line("bag_to_map",
                                   "Maps the clouds in rosbags, without a roscore. The result is "
                                   "the same as the node's, byte for byte.");
  bool frees_passed = false;
  line.addFlag("free-passed", frees_passed,
               "at the end, free what has passed through places that were empty at some time");
  if (const auto status = parseBagOptions(line, argc, argv, options)) return *status;
  return makeMap(options, frees_passed);
}

}  // namespace
}  // namespace cuboid_mapping_ros

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("bag_to_map", argc, argv, cuboid_mapping_ros::run);
}
