// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/time_jump.h"

namespace cuboid_mapping_ros {

bool TimeJumpDetector::isJump(const ros::Time& stamp, const ros::Time& now) {
  has_clock_jumped_ = has_clock_jumped_ || now < last_now_;
  last_now_ = now;
  if (stamp.isZero()) return false;
  const bool is_old = stamp < newest_stamp_ && newest_stamp_ - stamp > tolerance_;
  const bool is_jump = is_old && (has_clock_jumped_ || was_old_);
  was_old_ = is_old && !is_jump;
  // Not by a cloud of the time before the jump, which may come after the clock has gone back.
  if (stamp <= now) has_clock_jumped_ = false;
  if (is_jump || stamp > newest_stamp_) newest_stamp_ = stamp;
  return is_jump;
}

}  // namespace cuboid_mapping_ros
