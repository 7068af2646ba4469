// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/map/kept_history.h"

#include "cuboid_mapping/ros/middleware/names.h"

#include <ros/console.h>

#include <stdexcept>

namespace cuboid_mapping_ros {

void KeptHistory::lose(const std::string& why) noexcept {
  is_lost_ = true;
  try {
    const std::lock_guard<std::mutex> lock(error_mutex_);
    error_ = "clouds are no longer kept, and poses cannot be corrected: " + why +
             ". Make space, and begin anew with ~save_map and ~load_map";
    ROS_ERROR_STREAM_NAMED(kNodeName, error_);
  } catch (...) {  // There is no memory for the text.
  }
}

void KeptHistory::restart(const CuboidMap& map) noexcept {
  is_lost_ = false;
  change([&](MapHistory& history) { history.restart(map); });
}

std::string KeptHistory::error() const {
  if (!is_lost_) return {};
  const std::lock_guard<std::mutex> lock(error_mutex_);
  return error_;
}

MapHistory& KeptHistory::whole() {
  if (is_lost_) throw std::runtime_error(error());
  return history_;
}

}  // namespace cuboid_mapping_ros
