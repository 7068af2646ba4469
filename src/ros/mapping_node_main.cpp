// SPDX-License-Identifier: BSD-3-Clause
// The node: runs the nodelet in a process of its own, under the name of the node.
#include "cuboid_mapping/ros/mapping_nodelet.h"
#include "cuboid_mapping/ros/names.h"

#include <nodelet/loader.h>
#include <ros/init.h>
#include <ros/node_handle.h>
#include <ros/this_node.h>
#include <boost/make_shared.hpp>
#include <boost/shared_ptr.hpp>
#include <boost/weak_ptr.hpp>

#include <cstdlib>
#include <string>

int main(int argc, char** argv) {
  using cuboid_mapping_ros::MappingNodelet;
  ros::init(argc, argv, cuboid_mapping_ros::kNodeName);
  // As octomap_server_node: the map to start from may be named on the command line.
  if (argc == 2) ros::NodeHandle("~").setParam("map_file", std::string(argv[1]));

  // The loader owns the nodelet; this is only to ask whether it accepted its parameters.
  boost::weak_ptr<MappingNodelet> mapping;
  nodelet::Loader loader([&mapping](const std::string& /*type*/) {
    const auto instance = boost::make_shared<MappingNodelet>();
    mapping = instance;
    return boost::shared_ptr<nodelet::Nodelet>(instance);
  });
  // Remappings of the command line hold for the whole process already.
  const bool is_loaded =
      loader.load(ros::this_node::getName(), cuboid_mapping_ros::kMappingNodeletType, {}, {});
  const auto instance = mapping.lock();
  if (!is_loaded || !instance || !instance->isRunning()) return EXIT_FAILURE;
  ros::spin();
  return EXIT_SUCCESS;
}
