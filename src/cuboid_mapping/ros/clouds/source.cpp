// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/source.h"

#include <cmath>

namespace cuboid_mapping_ros {

bool RateLimit::lets(const ros::Time& stamp) {
  if (max_rate_hz_ == 0.0 || stamp.isZero()) return true;
  const auto slot = static_cast<std::int64_t>(std::floor(stamp.toSec() * max_rate_hz_));
  const bool is_other = slot != last_slot_;
  last_slot_ = slot;
  return is_other;
}

std::vector<std::unique_ptr<Source>> makeSources(const NodeParameters& parameters) {
  std::vector<std::unique_ptr<Source>> sources;
  for (const NodeParameters& source : sourcesOf(parameters)) {
    sources.push_back(std::make_unique<Source>(source));
  }
  return sources;
}

}  // namespace cuboid_mapping_ros
