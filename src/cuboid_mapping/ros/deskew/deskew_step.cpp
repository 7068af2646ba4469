// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/deskew/deskew_step.h"

#include "cuboid_mapping/ros/deskew/sweep.h"

#include <string>

namespace cuboid_mapping_ros {
namespace {

/// Minimum stamp: with earlier ones, slices could lie before time begins.
constexpr double kMinStamp_s = 2.0;

}  // namespace

DeskewStep::DeskewStep(const NodeParameters& /*parameters*/, const SourceParameters& source)
    : maps_no_returns_(source.no_return_range_m > 0.0),
      unit_s_(source.of<DeskewParameters>().time_unit_s) {}

std::vector<ParameterDeclaration> DeskewStep::declare() {
  return {{"deskew", "", boolean(&DeskewParameters::is_on),
           "true: tf gives the pose of the sensor at the time of each point. Times come from the "
           "field time, t, offset_time, timestamp, time_stamp or timeStamp of a cloud, or from "
           "time_increment of a scan. false: all points have the time of the stamp."},
          {"time_unit", "s", number(&DeskewParameters::time_unit_s, 0.0, 1.0),
           "Unit of the times of points. 0: whole numbers are nanoseconds, others seconds, unless "
           "only another unit gives the duration of a sweep. Set it if this guess is wrong."}};
}

std::vector<ParameterError> DeskewStep::check(const LoadedParameters& loaded) {
  const SourceParameters& source = loaded.parameters.source;
  const bool is_depth = source.type == SourceType::kDepthImage;
  if (!isOn(loaded.parameters, source) || !(is_depth || source.filter_ground)) return {};
  return {{"deskew", std::string("is true, but does not go with ") +
                         (is_depth ? "type: depth_image" : "filter_ground") +
                         ": switch one of them off"}};
}

bool DeskewStep::isOn(const NodeParameters& /*parameters*/, const SourceParameters& source) {
  return source.of<DeskewParameters>().is_on;
}

std::optional<PointTimes> DeskewStep::readTimes(const SensorMessage& message) const {
  return readPointTimes(message, maps_no_returns_, unit_s_);
}

Slices DeskewStep::findSlices(const SensorMessage& message) const {
  if (message.header().stamp.toSec() < kMinStamp_s) return {};
  const auto times = readTimes(message);
  return times ? cuboid_mapping_ros::findSlices(times->times_s).value_or(Slices()) : Slices();
}

std::optional<CloudError> DeskewStep::refuse(const SensorMessage& message,
                                             const Slices& slices) const {
  if (!slices.empty()) return std::nullopt;
  if (message.header().stamp.toSec() >= kMinStamp_s && readTimes(message)) return std::nullopt;
  return describeError(DropReason::kNoPointTimes, "message", message.header(),
                       "it has no stamp, or no time for each point, as deskew needs: a field time, "
                       "t, offset_time or timestamp, or a time_increment");
}

std::string DeskewStep::findWarning(const SensorMessage& /*message*/, const Slices& slices) const {
  if (slices.empty()) {
    return "deskew: the times of the points are far from the stamp, and are ignored. Correct them "
           "in the driver, or set time_unit";
  }
  return {};
}

std::vector<CloudPoints> DeskewStep::divide(const SensorMessage& message, const CloudPoints& points,
                                            const Slices& slices) const {
  const PointTimes times = readTimes(message).value();
  std::vector<CloudPoints> parts = divideIntoSlices(points, times.times_s, slices);
  if (!times.warning.empty()) parts.front().warnings.push_back(times.warning);
  return parts;
}

}  // namespace cuboid_mapping_ros
