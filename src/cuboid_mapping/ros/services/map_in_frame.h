// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/parameters/service_limits.h"

#include <tf2/buffer_core.h>

#include <atomic>
#include <string>

namespace cuboid_mapping_ros {

class GuardedMap;

/// A map with its frame and limits, for services.
struct MapInFrame {
  GuardedMap& map;                                ///< The map and its lock.
  std::string frame_id;                           ///< Frame of the map.
  const tf2::BufferCore& tf;                      ///< Transforms for requests in other frames.
  ServiceLimits limits = {};                      ///< Limits of each call.
  const std::atomic<bool>* is_stopped = nullptr;  ///< Set to end all calls.
};

}  // namespace cuboid_mapping_ros
