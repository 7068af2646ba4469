// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/self_filter.h"

#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_file_error.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/clouds/robot_description.h"
#include "cuboid_mapping/ros/clouds/robot_filter.h"

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// Limit of free voxels: each cloud visits all of them.
constexpr double kMaxFreeVoxels = 1e6;

std::string readTextFile(const std::string& file) {
  std::string text;
  try {
    text = cuboid_mapping::readFile(file);
  } catch (const cuboid_mapping::MapFileError&) {
    // An unreadable file counts as one without text.
  }
  if (text.empty()) throw std::runtime_error("self_filter/urdf_file: cannot read " + file);
  return text;
}

/// Text of the robot's description; empty if none is set.
std::string readDescription(const SelfFilterParameters& parameters, const FindText& find_text) {
  if (!parameters.urdf_file.empty()) return readTextFile(parameters.urdf_file);
  if (parameters.robot_description.empty()) return {};
  auto text = find_text(parameters.robot_description);
  if (text && !text->empty()) return *std::move(text);
  throw std::runtime_error("self_filter/robot_description: there is no parameter " +
                           parameters.robot_description + " with a URDF");
}

/// Refuses too many voxels: each cloud visits all of them.
void checkVolume(const RobotParts& parts, const NodeParameters& parameters) {
  const double num_voxels = boundsVolume(parts) / std::pow(parameters.map.resolution_m, 3);
  if (!parameters.self_filter.keep_free || num_voxels <= kMaxFreeVoxels) return;
  std::ostringstream text;
  text << "self_filter/keep_free: the robot has " << num_voxels << " voxels, but may have "
       << kMaxFreeVoxels << ": choose a greater resolution, or set it to false";
  throw std::runtime_error(text.str());
}

}  // namespace

FindText findTextFrom(const ros::NodeHandle& private_nh) {
  return [private_nh](const std::string& name) -> std::optional<std::string> {
    std::string key;
    std::string text;
    if (!private_nh.searchParam(name, key) || !private_nh.getParam(key, text)) return std::nullopt;
    return text;
  };
}

void loadRobotParts(NodeParameters& parameters, const FindText& find_text) {
  SelfFilterParameters& filter = parameters.self_filter;
  RobotParts parts = filter.boxes;
  const std::string urdf = readDescription(filter, find_text);
  if (!urdf.empty()) {
    const auto ignored = cuboid_mapping::wordsOf(filter.ignored_links);
    const RobotParts shapes =
        readRobotDescription(urdf, filter.padding_m, {ignored.begin(), ignored.end()});
    parts.insert(parts.end(), shapes.begin(), shapes.end());
  }
  checkVolume(parts, parameters);
  filter.parts = std::move(parts);
}

}  // namespace cuboid_mapping_ros
