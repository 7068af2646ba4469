// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/cloud_error.h"

namespace cuboid_mapping_ros {
namespace {

static_assert(static_cast<std::size_t>(DropReason::kQueueFull) == kNumCloudDefects);
static_assert(static_cast<std::size_t>(DropReason::kInternalError) + 1 == kNumDropReasons);

const char* usualCure(DropReason defect) {
  switch (defect) {
    case DropReason::kEmptyFrame: return "Set the frame of the sensor in its driver";
    case DropReason::kNoPoints: return "Check the sensor and any filters before this node";
    case DropReason::kNoXyzFields: return "Name a topic with 3D points";
    case DropReason::kWrongDatatype:
      return "Configure the driver to publish metres as floating-point numbers";
    case DropReason::kShortData: return "Look for a driver or a relay that truncates it";
    case DropReason::kNoValidPoints:
      return "Check that nothing covers the sensor, and check any filters before this node";
    case DropReason::kWrongUnit:
      return "Set length_unit to its unit in metres (millimetres: 0.001, metres: 1), or "
             "sensor_frame, if the points were transformed into another frame";
    case DropReason::kNoPointTimes: return "Have the driver send it, or set deskew to false";
    default: return "Its description is wrong: fix the program that makes it";
  }
}

}  // namespace

const char* toString(DropReason reason) {
  switch (reason) {
    case DropReason::kEmptyFrame: return "empty frame_id";
    case DropReason::kNoPoints: return "no points";
    case DropReason::kNoXyzFields: return "no x/y/z fields";
    case DropReason::kWrongDatatype: return "wrong datatype";
    case DropReason::kBadLayout: return "bad layout";
    case DropReason::kShortData: return "short data";
    case DropReason::kNoValidPoints: return "no valid points";
    case DropReason::kWrongUnit: return "wrong unit";
    case DropReason::kNoPointTimes: return "no point times";
    case DropReason::kQueueFull: return "queue full";
    case DropReason::kNoTransform: return "no transform";
    case DropReason::kTooOldForTf: return "too old for tf";
    case DropReason::kBeforeTf: return "before the first transform";
    case DropReason::kTfGap: return "in a gap of tf";
    case DropReason::kNoCameraInfo: return "no camera_info";
    case DropReason::kPaused: return "paused";
    case DropReason::kBeforeJump: return "before a jump";
    case DropReason::kInternalError: break;
  }
  return "internal error";
}

CloudError describeError(DropReason defect, const std::string& kind, const std_msgs::Header& header,
                         const std::string& what, const char* cure) {
  std::string text = kind + " in frame '" + header.frame_id + "': " + what;
  if (cure == nullptr) cure = usualCure(defect);
  if (*cure != '\0') text.append(". ").append(cure);
  return {defect, text};
}

}  // namespace cuboid_mapping_ros
