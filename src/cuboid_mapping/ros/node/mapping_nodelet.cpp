// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/node/mapping_nodelet.h"

#include "cuboid_mapping/ros/clouds/self_filter.h"
#include "cuboid_mapping/ros/map/map_storage.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/init.h>
#include <pluginlib/class_list_macros.hpp>

#include <csignal>
#include <exception>
#include <string>

namespace cuboid_mapping_ros {
namespace {

void endNode(int /*signal*/) { ros::requestShutdown(); }

/// A process that is told to end saves its map, as roscpp lets it with SIGINT alone.
void endWithRosAt(int signal) {
  struct sigaction action {};
  if (sigaction(signal, nullptr, &action) != 0 || action.sa_handler != SIG_DFL) return;
  action.sa_handler = &endNode;
  sigaction(signal, &action, nullptr);
}

}  // namespace

void MappingNodelet::onInit() {
  for (const int signal : {SIGTERM, SIGHUP}) endWithRosAt(signal);
  try {
    LoadedParameters loaded = loadParameters(getPrivateNodeHandle());
    for (const ParameterError& warning : loaded.warnings) {
      NODELET_WARN_STREAM("parameter ~" << warning.key << ": " << warning.message);
    }
    for (const ParameterError& error : loaded.errors) {
      NODELET_ERROR_STREAM("parameter ~" << error.key << ": " << error.message);
    }
    if (!loaded.errors.empty()) {
      NODELET_FATAL_STREAM("not started: " << loaded.errors.size() << " bad parameter"
                                           << (loaded.errors.size() == 1 ? "" : "s"));
      return;
    }
    // As octomap_server_node: the map to start from may be named on the command line. Not by way of
    // the parameter server, where it would stay, for the next node of this name.
    if (getMyArgv().size() == 1) loaded.parameters.map_file = getMyArgv().front();
    const auto differences = toDifferenceLines(loaded.parameters, {}, "default");
    for (const std::string& line : differences) NODELET_INFO_STREAM(line);
    for (const std::string& line : toSourceLines(loaded.parameters)) NODELET_INFO_STREAM(line);
    if (differences.empty()) NODELET_INFO("all parameters have their default values");
    for (const std::string& line : toLogLines(loaded.parameters)) NODELET_DEBUG_STREAM(line);
    const double resolution_m = loaded.parameters.map.resolution_m;
    const auto start_map = readStartMap(loaded.parameters);
    if (loaded.parameters.is_autosave_read) {
      NODELET_INFO_STREAM("goes on with the map of " << loaded.parameters.autosave_file);
    }
    if (loaded.parameters.map.resolution_m != resolution_m) {
      NODELET_WARN_STREAM("resolution is " << loaded.parameters.map.resolution_m
                                           << " m, that of map_file, not " << resolution_m << " m");
    }
    loadRobotParts(loaded.parameters, findTextFrom(getPrivateNodeHandle()));
    node_ = std::make_unique<MappingNode>(getNodeHandle(), getPrivateNodeHandle(),
                                          loaded.parameters, start_map);
  } catch (const std::exception& exception) {
    NODELET_FATAL_STREAM("not started: " << exception.what());
  } catch (...) {
    NODELET_FATAL("not started: an exception that is not a std::exception");
  }
}

}  // namespace cuboid_mapping_ros

PLUGINLIB_EXPORT_CLASS(cuboid_mapping_ros::MappingNodelet, nodelet::Nodelet)
