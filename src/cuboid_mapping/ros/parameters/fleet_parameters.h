// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Treatment of observations above the rate.
enum class ObservationExcess : unsigned char {
  kLater,  ///< They wait.
  kThin    ///< Clouds are left out of the observations, and counted.
};

/// Parameters for maps of several robots.
struct FleetParameters {
  double observation_max_kb_s = 0.0;  ///< Rate limit for each subscriber; 0: none.
  ObservationExcess observation_excess = ObservationExcess::kLater;
  int observation_memory_mb = 0;    ///< For subscribers that missed observations; 0: none is kept.
  std::vector<std::string> robots;  ///< Robots that observe the map; none: clouds make it.
  double merge_delay_s = 3.0;       ///< Wait for observations before they go into the map.
};

}  // namespace cuboid_mapping_ros
