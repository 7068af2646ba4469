// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/time.h>

#include <cmath>
#include <cstdint>

namespace cuboid_mapping_ros {

/// Stamp of the first cloud of simulated and converted data. Not near 0, since some programs subtract from
/// stamps.
inline const ros::Time kFirstStamp(1000, 0);

/// Stamp of cloud `index`; cloud 0 has `first_stamp`.
[[nodiscard]] inline ros::Time computeStamp(const ros::Time& first_stamp, std::uint64_t index,
                                            double rate_hz) {
  const double since_first_ns = 1e9 * static_cast<double>(index) / rate_hz;
  return first_stamp + ros::Duration().fromNSec(std::llround(since_first_ns));
}

}  // namespace cuboid_mapping_ros
