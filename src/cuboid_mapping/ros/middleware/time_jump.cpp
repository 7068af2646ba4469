// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/time_jump.h"

#include <cstdint>

namespace cuboid_mapping_ros {

void beginAnew(ros::Time& since, const ros::Time& now) {
  if (now < since || since.isZero()) since = now;
}

bool isOlder(const ros::Time& stamp, const ros::Time& newest, const ros::Duration& tolerance) {
  // Up to 2^32 s each, so that 64 bits hold their nanoseconds and the difference.
  const auto age_ns =
      static_cast<std::int64_t>(newest.toNSec()) - static_cast<std::int64_t>(stamp.toNSec());
  return age_ns > tolerance.toNSec();
}

StampOrder TimeJumpDetector::judge(const ros::Time& stamp) {
  if (stamp.isZero()) return StampOrder::kInOrder;
  const bool is_old = isOlder(stamp, newest_stamp_, tolerance_);
  const bool is_jump = is_old && was_late_;
  was_late_ = is_old && !is_jump;
  if (is_jump || stamp > newest_stamp_) newest_stamp_ = stamp;
  if (is_jump) return StampOrder::kJump;
  return is_old ? StampOrder::kLate : StampOrder::kInOrder;
}

}  // namespace cuboid_mapping_ros
