// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/history/map_history.h"

#include <string>

namespace cuboid_mapping_ros {

/// Limits of the clouds kept for corrections of poses.
struct KeepParameters {
  int memory_mb = 0;           ///< Limit of packed clouds, in MB; 0: no cloud is kept.
  double max_age_s = 86400.0;  ///< Older clouds become a fixed part of the map.
  std::string body_frame;      ///< Frame of the corrected poses; empty: the frame of the cloud.
  double tolerance_m = 0.05;   ///< A path that moves nothing farther than this changes nothing.

  [[nodiscard]] bool isOn() const { return memory_mb > 0; }
  [[nodiscard]] cuboid_mapping::HistoryLimits limits() const;
};

}  // namespace cuboid_mapping_ros
