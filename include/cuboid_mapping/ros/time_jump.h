// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/time.h>

namespace cuboid_mapping_ros {

/// Tells a recording that starts again from clouds that are late.
class TimeJumpDetector {
 public:
  /// @param tolerance  How much older than the newest a cloud may be, > 0.
  explicit TimeJumpDetector(const ros::Duration& tolerance) : tolerance_(tolerance) {}

  /// To be called for every cloud.
  /// @param now  ros::Time::now(), for the clock of simulated time.
  /// @return Whether time has jumped back to this cloud:
  ///   - the cloud is older than tolerated, and the clock has gone back since the last call; or
  ///   - it is the second in a row that is (recorded clouds without their clock). One cloud alone
  ///     is merely late.
  ///   A stamp of 0 means "the latest transform" to tf, and is never a jump.
  bool isJump(const ros::Time& stamp, const ros::Time& now);

 private:
  ros::Duration tolerance_;
  ros::Time newest_stamp_;
  ros::Time last_now_;
  bool has_clock_jumped_ = false;
  bool was_old_ = false;
};

}  // namespace cuboid_mapping_ros
