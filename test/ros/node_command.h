// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdlib>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {

/// Starts a node, or a manager with the nodelet; LAUNCH_PREFIX precedes the manager, as in launch files.
inline std::vector<std::string> commandOf(bool is_nodelet) {
  if (!is_nodelet) return {CUBOID_MAPPING_NODE};
  const char* prefix = std::getenv("LAUNCH_PREFIX");
  return {"rosrun",  "--prefix",   prefix == nullptr ? "" : prefix, "nodelet",
          "nodelet", "standalone", "cuboid_mapping/MappingNodelet"};
}

}  // namespace cuboid_mapping_ros::test
