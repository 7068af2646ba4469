// SPDX-License-Identifier: BSD-3-Clause
// Maps the clouds of a simulated lidar on its drive through a building: a first map without ROS.
#include "command_line.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/map/mapper.h"
#include "map_content.h"
#include "progress_bar.h"
#include "simulation/lidar.h"
#include "simulation/world.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <string>
#include <vector>

namespace cuboid_mapping {
namespace {

constexpr double kCloudRate_hz = 5.0;

struct Options {
  std::string file;
  double duration_s = 60.0;
  double resolution_m = 0.1;
  std::size_t seed = 1;
};

Scan simulateScan(const World& world, const Lidar& lidar, std::uint64_t number) {
  const double time_s = static_cast<double>(number) / kCloudRate_hz;
  const Eigen::Isometry3d T_map_lidar =
      world.computeRobotPose(time_s) * Eigen::Translation3d(0.1, 0.0, 1.0);
  const LidarCloud cloud = lidar.computeCloud(world.computeSolids(time_s), T_map_lidar, number);
  std::vector<Eigen::Vector3f> points;
  for (const LidarPoint& point : cloud.points) {
    if (std::isfinite(point.x)) points.emplace_back(point.x, point.y, point.z);
  }
  return makeScan(T_map_lidar, T_map_lidar.translation(), points);
}

int map(const Options& options) {
  (void)checkOutput(options.file);
  MapperConfig config;
  config.map.resolution_m = options.resolution_m;
  Mapper mapper(config);
  const World world(options.seed);
  LidarConfig lidar_config;
  lidar_config.columns = 450;
  lidar_config.seed = options.seed;
  const Lidar lidar(lidar_config);
  const auto count = static_cast<std::uint64_t>(std::ceil(options.duration_s * kCloudRate_hz));
  const ProgressListener listener = showProgress("clouds");
  for (std::uint64_t i = 0; i < count; ++i) {
    throwIfInterrupted();
    mapper.integrate(simulateScan(world, lidar, i));
    listener(i + 1, count);
  }
  writeMapFile(options.file, takeSnapshot(mapper.map(), "map"));
  std::cout << options.file << ": " << count << " clouds" << std::endl;
  return 0;
}

int run(int argc, char** argv) {
  Options options;
  CommandLine line(
      "simulated_map",
      "Maps the scans of a simulated lidar that drives through a building; needs no ROS.");
  line.addArgument("map", options.file, "map to write, such as map.cuboids");
  line.addNumber("duration", options.duration_s, "length of the drive in seconds", {0.1, 3600});
  line.addNumber("resolution", options.resolution_m, "edge length of a voxel in metres",
                 {0.02, 10});
  line.addNumber("seed", options.seed, "seed of the building and of the noise");
  if (const auto status = line.parse(argc, argv)) return *status;
  return map(options);
}

}  // namespace
}  // namespace cuboid_mapping

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("simulated_map", argc, argv, cuboid_mapping::run);
}
