// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <std_msgs/Header.h>

#include <cstddef>
#include <string>

namespace cuboid_mapping_ros {

/// Reasons why a cloud does not enter the map. The first are defects of its message, in the order of the
/// checks.
enum class DropReason : unsigned char {
  kEmptyFrame,     ///< header.frame_id is empty.
  kNoPoints,       ///< width or height is 0, see layoutOf().
  kNoXyzFields,    ///< There is no field x, y or z.
  kWrongDatatype,  ///< x, y or z is neither FLOAT32 nor FLOAT64.
  kBadLayout,      ///< Layout, size, camera or angles make no sense.
  kShortData,      ///< There is less data than width, height and steps say.
  kNoValidPoints,  ///< All points are NaN, infinite or zero, and no beam without return is known.
  kWrongUnit,      ///< In the unit that is usual, it cannot have been measured.
  kNoPointTimes,   ///< With deskew: the cloud has no times of its points.
  kQueueFull,      ///< The node was busy with earlier clouds.
  kNoTransform,    ///< tf did not come within tf_wait.
  kTooOldForTf,    ///< Older than the transforms that tf keeps, on arrival.
  kBeforeTf,       ///< Older than the first transforms.
  kTfGap,          ///< In a gap of tf, see tf_gap.
  kNoCameraInfo,   ///< A depth image has no camera_info.
  kPaused,         ///< The node is paused by ~pause.
  kBeforeJump,     ///< Older than the jump reported to ~move_map.
  kInternalError   ///< An exception, for example without memory.
};

/// Number of defects of messages, and of all reasons.
constexpr std::size_t kNumCloudDefects = 9;
constexpr std::size_t kNumDropReasons = 18;

/// Whether a message that is left out for this reason has nothing to map: that is no fault.
[[nodiscard]] constexpr bool isEmpty(DropReason reason) {
  return reason == DropReason::kNoPoints || reason == DropReason::kNoValidPoints;
}

/// A short name for diagnostics, such as "no x/y/z fields".
[[nodiscard]] const char* toString(DropReason reason);

/// Advice for dropped clouds, as a clause that follows "dropped: ".
[[nodiscard]] const char* toAdvice(DropReason reason);

/// Reason why a cloud is refused.
struct CloudError {
  DropReason defect;
  std::string text;  ///< Text for the log: the numbers, and the cure.
};

/// The error of a message: "cloud in frame 'lidar': it has no points. Check the sensor".
/// @param kind  Such as "cloud". @param cure  Null: toAdvice(). Empty: `what` has it.
[[nodiscard]] CloudError describeError(DropReason defect, const std::string& kind,
                                       const std_msgs::Header& header, const std::string& what,
                                       const char* cure = nullptr);

}  // namespace cuboid_mapping_ros
