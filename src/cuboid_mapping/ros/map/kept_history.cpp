// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/map/kept_history.h"

#include "cuboid_mapping/ros/middleware/names.h"

#include <ros/console.h>

#include <exception>
#include <stdexcept>

namespace cuboid_mapping_ros {

template <typename WorkT>
void KeptHistory::guard(const WorkT& work) noexcept {
  if (is_lost_) return;
  try {
    work();
  } catch (const std::exception& exception) {
    lose(exception.what());
  }
}

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
  guard([&] { history_.restart(map); });
}

void KeptHistory::add(const KeptObservation& observation) noexcept {
  guard([&] { history_.add(observation.cloud, observation.config); });
}

void KeptHistory::addEdit(const CellBox& box, const CuboidMap& map, const CellBox& whole) noexcept {
  guard([&] { history_.addEdit(box, map, whole); });
}

void KeptHistory::dropEdits(std::uint64_t num_before, std::uint64_t count) noexcept {
  guard([&] { history_.dropEdits(num_before, count); });
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
