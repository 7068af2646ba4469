// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/no_returns/no_return_step.h"

#include <string>
#include <tuple>

namespace cuboid_mapping_ros {
namespace {

ParameterKind noReturnKind() {
  using P = NodeParameters;
  return parsedText(
      "rep_117, with_nan, with_zero, all, none, or some of \"plus_inf nan zero minus_inf "
      "range_max\"; and ranges in metres, as in \"rep_117 81.91\"",
      true,
      [](P& p, const std::string& text) {
        const auto points = parseNoReturnPoints(text);
        if (points) std::tie(p.source.no_return_points, p.source.no_return_ranges_m) = *points;
        return points.has_value();
      },
      [](const P& p) { return toText(p.source.no_return_points, p.source.no_return_ranges_m); });
}

}  // namespace

std::vector<ParameterDeclaration> NoReturnStep::declare() {
  return {
      {"sensor_model/no_return_range", "m",
       adjustable(number(&SourceParameters::no_return_range_m, 0.0, 1000.0)),
       "Beams without a return (no_return_points) clear the space up to this range. 0: they are "
       "ignored."},
      {"sensor_model/no_return_points", "", adjustable(noReturnKind()),
       "Readings of a scan, a depth image or an organized cloud that mean that a beam met nothing. "
       "Other special readings are ignored. plus_inf: +inf, in any coordinate of a point without "
       "-inf and NaN. nan: NaN. zero: 0, or the point (0, 0, 0). minus_inf: -inf, which REP 117 "
       "uses for objects that are too close. range_max: range_max of a scan, or more. rep_117: "
       "plus_inf. with_nan: plus_inf and nan. with_zero: plus_inf and zero. A number: readings of "
       "this range or depth, such as a far clip; they are never returns."},
  };
}

void NoReturnStep::setOptions(CloudOptions& options) const {
  options.no_return_range_m = range_m_;
  options.no_return_points = points_;
  options.no_return_ranges_m = ranges_m_;
}

}  // namespace cuboid_mapping_ros
