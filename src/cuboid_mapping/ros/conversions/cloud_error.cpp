// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/cloud_error.h"

#include <array>
#include <cctype>

namespace cuboid_mapping_ros {
namespace {

static_assert(static_cast<std::size_t>(DropReason::kQueueFull) == kNumCloudDefects);
static_assert(static_cast<std::size_t>(DropReason::kInternalError) + 1 == kNumDropReasons);

struct ReasonText {
  const char* name;
  const char* advice;
};

/// In the order of DropReason.
constexpr std::array<ReasonText, kNumDropReasons> kTexts{{
    {"empty frame_id", "set the frame of the sensor in its driver"},
    {"no points", "check the sensor and any filters before this node"},
    {"no x/y/z fields", "name a topic with 3D points"},
    {"wrong datatype", "configure the driver to publish metres as floating-point numbers"},
    {"bad layout", "fix the program that makes these messages"},
    {"short data", "look for a driver or a relay that truncates the messages"},
    {"no valid points",
     "check that nothing covers the sensor, and check any filters before this node"},
    {"wrong unit",
     "set length_unit to its unit in metres (millimetres: 0.001, metres: 1), or sensor_frame, if "
     "the points were transformed into another frame"},
    {"no point times", "have the driver send the time of each point, or set deskew to false"},
    {"queue full",
     "the node is too slow for them: use a coarser resolution or a smaller sensor_model/max_range, "
     "or send fewer clouds"},
    {"no transform",
     "check that tf has a path from the cloud's frame to frame_id at the cloud's stamp (rosrun "
     "tf2_tools echo.py)"},
    {"too old for tf",
     "check the sensor's clock (some drivers stamp with the time since power-on), and that the "
     "clocks of all machines agree; with recorded data set use_sim_time and play bags with "
     "--clock"},
    {"before the first transform",
     "tf began after them, as when sensors start first, or a recording starts again; the clouds "
     "after them are mapped"},
    {"in a gap of tf",
     "their pose would be a guess: check the publisher of the frame, or raise tf_gap if it "
     "publishes so rarely"},
    {"no camera_info", "check the publisher of camera_info, or name its topic in camera_info"},
    {"paused", "call ~pause with data: false to resume"},
    {"before a jump",
     "they are older than the jump that ~move_map was given; call ~reset if a recording has "
     "started again"},
    {"internal error",
     "see the log; a coarser resolution or a smaller sensor_model/max_range needs less memory"},
}};

const ReasonText& textOf(DropReason reason) { return kTexts.at(static_cast<std::size_t>(reason)); }

}  // namespace

const char* toString(DropReason reason) { return textOf(reason).name; }

const char* toAdvice(DropReason reason) { return textOf(reason).advice; }

CloudError describeError(DropReason defect, const std::string& kind, const std_msgs::Header& header,
                         const std::string& what, const char* cure) {
  std::string sentence = cure == nullptr ? toAdvice(defect) : cure;
  std::string text = kind + " in frame '" + header.frame_id + "': " + what;
  if (sentence.empty()) return {defect, text};
  sentence.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(sentence.front())));
  return {defect, text + ". " + sentence};
}

}  // namespace cuboid_mapping_ros
