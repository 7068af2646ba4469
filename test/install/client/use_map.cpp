// SPDX-License-Identifier: BSD-3-Clause
// The map, its files, OctoMap, the client and messages in a program of another package.
#include "cuboid_mapping/interop/octomap_parity.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/map/mapper.h"
#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/ros/cuboid_map_client.h"

#include <cuboid_mapping/FindCorridor.h>
#include <cuboid_mapping/QueryBox.h>
#include <octomap/OcTree.h>
#include <ros/ros.h>

#include <iostream>
#include <memory>
#include <vector>

namespace {

using namespace cuboid_mapping;

/// Follows the map of a node, if there is a master.
bool isFollowing() {
  const cuboid_mapping_ros::CuboidMapClient client;
  return client.hasMap();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    ros::init(argc, argv, "use_map");
    return isFollowing() ? 0 : 1;
  }
  const Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  const std::vector<Eigen::Vector3f> points_sensor = {{5.0F, 1.0F, 0.5F}, {5.0F, 1.5F, 0.5F}};
  // The example of doc/library.md.
  MapperConfig config;
  config.map.resolution_m = 0.1;
  config.max_range_m = 30.0;
  Mapper mapper(config);
  mapper.integrate(makeScan(T_map_sensor, T_map_sensor.translation(), points_sensor));
  const auto answer = queryBox(mapper.map(), {{0, 0, 0}, {1, 1, 1}}, Budget::unlimited());
  if (!answer.isFound() || answer->occupancy() == Occupancy::kFree) return 1;
  writeMapFile(argv[1], takeSnapshot(mapper.map(), "map"));
  const std::unique_ptr<octomap::AbstractOcTree> tree(octomap::AbstractOcTree::read(argv[1]));
  std::cout << (tree ? tree->getTreeType() : "no tree") << std::endl;
  return 0;
}
