// SPDX-License-Identifier: BSD-3-Clause
// The map, its files, OctoMap, the client and messages in a program of another package.
#include "cuboid_mapping/interop/octomap_parity.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/ros/cuboid_map_client.h"

#include <cuboid_mapping/FindCorridor.h>
#include <cuboid_mapping/QueryBox.h>
#include <octomap/OcTree.h>
#include <ros/ros.h>

#include <iostream>
#include <memory>

namespace {

using namespace cuboid_mapping;

/// Follows the map of a node; not without a master.
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
  MapConfig config;
  config.resolution_m = 0.1;
  CuboidMap map(config);
  map.replace(kAllCells, {{{{0, 0, 0}, {8, 8, 8}}, 1.0F}});
  writeMapFile(argv[1], takeSnapshot(map, "map"));
  const std::unique_ptr<octomap::AbstractOcTree> tree(octomap::AbstractOcTree::read(argv[1]));
  std::cout << (tree ? tree->getTreeType() : "no tree") << std::endl;
  return 0;
}
