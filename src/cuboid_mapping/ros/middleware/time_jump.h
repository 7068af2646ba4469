// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/time.h>

namespace cuboid_mapping_ros {

/// Whether a stamp is older than another one by more than a tolerance. For all stamps: the difference
/// of two ros::Time throws where it is beyond 2^31 s.
[[nodiscard]] bool isOlder(const ros::Time& stamp, const ros::Time& newest,
                           const ros::Duration& tolerance);

/// Waiting begins anew when time has jumped back, or simulated time has come: it is 0 before the first /clock.
void beginAnew(ros::Time& since, const ros::Time& now);

/// How the stamp of a cloud follows those before it.
enum class StampOrder : unsigned char {
  kInOrder,  ///< Not much older than the newest.
  kLate,     ///< Much older than the newest; the one before it was not.
  kJump      ///< Much older, as the one before it: a recording has started again.
};

/// Tells a recording that starts again from clouds that are late.
class TimeJumpDetector {
 public:
  /// @param tolerance  How much older than the newest a cloud may be, > 0.
  explicit TimeJumpDetector(const ros::Duration& tolerance) : tolerance_(tolerance) {}

  /// To be called for every cloud. After a jump the cloud counts as the newest. A stamp of 0 means
  /// "the latest transform" to tf, and is in order.
  StampOrder judge(const ros::Time& stamp);

 private:
  ros::Duration tolerance_;
  ros::Time newest_stamp_;
  bool was_late_ = false;
};

}  // namespace cuboid_mapping_ros
