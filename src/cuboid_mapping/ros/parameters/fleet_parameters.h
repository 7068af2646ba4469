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
  double observation_max_kb_s = 0.0;  ///< That may be sent to each listener; 0: all.
  ObservationExcess observation_excess = ObservationExcess::kLater;
  int observation_memory_mb = 0;    ///< For those who have missed observations; 0: none is kept.
  std::vector<std::string> robots;  ///< Whose observations make the map; none: clouds make it.
  double merge_delay_s = 3.0;       ///< For observations to arrive, before they go into the map.
};

}  // namespace cuboid_mapping_ros
