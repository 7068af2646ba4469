// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/time_jump.h"

namespace cuboid_mapping_ros {

StampOrder TimeJumpDetector::judge(const ros::Time& stamp) {
  if (stamp.isZero()) return StampOrder::kInOrder;
  const bool is_old = stamp < newest_stamp_ && newest_stamp_ - stamp > tolerance_;
  const bool is_jump = is_old && was_late_;
  was_late_ = is_old && !is_jump;
  if (is_jump || stamp > newest_stamp_) newest_stamp_ = stamp;
  if (is_jump) return StampOrder::kJump;
  return is_old ? StampOrder::kLate : StampOrder::kInOrder;
}

}  // namespace cuboid_mapping_ros
