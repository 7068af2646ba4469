// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Of maps of several robots.
struct FleetParameters {
  int observation_memory_mb = 0;    ///< For those who have missed observations; 0: none is kept.
  std::vector<std::string> robots;  ///< Whose observations make the map; none: clouds make it.
  double merge_delay_s = 3.0;       ///< For observations to arrive, before they go into the map.
};

}  // namespace cuboid_mapping_ros
