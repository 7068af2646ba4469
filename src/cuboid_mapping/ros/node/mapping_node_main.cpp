// SPDX-License-Identifier: BSD-3-Clause
// The node: runs the nodelet in a process of its own, under the name of the node.
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/twin_node.h"
#include "cuboid_mapping/ros/node/mapping_nodelet.h"

#include <nodelet/loader.h>
#include <ros/console.h>
#include <ros/exceptions.h>
#include <ros/init.h>
#include <ros/this_node.h>
#include <boost/function.hpp>
#include <boost/make_shared.hpp>
#include <boost/shared_ptr.hpp>

#include <csignal>
#include <cstdlib>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

namespace {

constexpr const char* kUsage =
    "Usage: cuboid_mapping_node [MAP] [cloud_in:=TOPIC] [_PARAMETER:=VALUE]...\n\n"
    "Builds a 3D occupancy map from point clouds, and answers questions about it.\n\n"
    "  MAP                 map to start with: .cuboids, .sqlite, .ot, .bt or .pcd\n"
    "  cloud_in:=TOPIC     topic of the clouds, sensor_msgs/PointCloud2\n"
    "  _PARAMETER:=VALUE   a parameter, such as _resolution:=0.1\n\n"
    "All parameters: rosrun cuboid_mapping print_parameters --yaml\n";

/// Answers --help and refuses unknown arguments: returns the exit status. Nothing if the node can
/// start.
std::optional<int> checkArguments(const std::vector<std::string>& arguments) {
  for (const std::string& argument : arguments) {
    if (argument == "-h" || argument == "--help") {
      std::cout << kUsage;
      return EXIT_SUCCESS;
    }
  }
  for (const std::string& argument : arguments) {
    if (arguments.size() == 1 && argument.rfind('-', 0) != 0) continue;
    std::cerr << "cuboid_mapping_node: "
              << (arguments.size() > 1 ? "more than one argument" : "unknown option " + argument)
              << "\n\n"
              << kUsage;
    return EXIT_FAILURE;
  }
  return std::nullopt;
}

void endNode(int /*signal*/) { ros::requestShutdown(); }

/// Lets the node save its map before it ends; roscpp does so for SIGINT only.
void endWithRosAt(int signal) {
  struct sigaction action {};
  action.sa_handler = &endNode;
  sigaction(signal, &action, nullptr);
}

}  // namespace

int main(int argc, char** argv) {
  using cuboid_mapping_ros::MappingNodelet;
  try {
    ros::init(argc, argv, cuboid_mapping_ros::kNodeName);
  } catch (const ros::InvalidNameException& error) {  // resolution:=0.1, without its underscore
    std::cerr << "cuboid_mapping_node: " << error.what() << "\n\n" << kUsage;
    return EXIT_FAILURE;
  }
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (const auto status = checkArguments(arguments)) return *status;

  if (const auto twin = cuboid_mapping_ros::findTwin()) {
    ROS_ERROR_STREAM("not started: a node "
                     << ros::this_node::getName() << " runs already, at " << *twin
                     << ". Start this one in a namespace of its own (__ns:=NAME), or end that one: "
                        "rosnode kill "
                     << ros::this_node::getName());
    return EXIT_FAILURE;
  }
  for (const int signal : {SIGTERM, SIGHUP}) endWithRosAt(signal);
  const boost::function<boost::shared_ptr<nodelet::Nodelet>(const std::string&)> make =
      [](const std::string& /*type*/) {
        return boost::make_shared<MappingNodelet>(MappingNodelet::Process::kOwn);
      };
  nodelet::Loader loader(make);
  // Remappings of the command line already hold for the whole process.
  if (!loader.load(ros::this_node::getName(), cuboid_mapping_ros::kMappingNodeletType, {},
                   arguments)) {
    return EXIT_FAILURE;
  }
  ros::spin();
  return EXIT_SUCCESS;
}
