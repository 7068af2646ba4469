// SPDX-License-Identifier: BSD-3-Clause
// The node: runs the nodelet in a process of its own, under the name of the node.
#include "cuboid_mapping/ros/mapping_nodelet.h"
#include "cuboid_mapping/ros/names.h"

#include <nodelet/loader.h>
#include <ros/init.h>
#include <ros/this_node.h>
#include <boost/make_shared.hpp>
#include <boost/shared_ptr.hpp>
#include <boost/weak_ptr.hpp>

#include <cstdlib>
#include <string>
#include <vector>

int main(int argc, char** argv) {
  using cuboid_mapping_ros::MappingNodelet;
  ros::init(argc, argv, cuboid_mapping_ros::kNodeName);
  const std::vector<std::string> arguments(argv + 1, argv + argc);

  // The loader owns the nodelet; this is only to ask whether it accepted its parameters.
  boost::weak_ptr<MappingNodelet> mapping;
  nodelet::Loader loader([&mapping](const std::string& /*type*/) {
    const auto instance = boost::make_shared<MappingNodelet>();
    mapping = instance;
    return boost::shared_ptr<nodelet::Nodelet>(instance);
  });
  // Remappings of the command line hold for the whole process already.
  const bool is_loaded = loader.load(ros::this_node::getName(),
                                     cuboid_mapping_ros::kMappingNodeletType, {}, arguments);
  const auto instance = mapping.lock();
  if (!is_loaded || !instance || !instance->isRunning()) return EXIT_FAILURE;
  ros::spin();
  return EXIT_SUCCESS;
}
