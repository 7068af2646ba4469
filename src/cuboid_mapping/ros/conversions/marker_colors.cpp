// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/marker_colors.h"

#include "cuboid_mapping/ros/conversions/points.h"

#include <algorithm>
#include <cmath>

namespace cuboid_mapping_ros {
namespace {

/// Share of a primary colour in a hue, both in sixths of the circle.
double shareAt(double hue, double primary) {
  const double distance = std::abs(hue - primary);
  return std::clamp(2.0 - std::min(distance, 6.0 - distance), 0.0, 1.0);
}

}  // namespace

std_msgs::ColorRGBA makeColor(double r, double g, double b, double a) {
  std_msgs::ColorRGBA color;
  color.r = static_cast<float>(r);
  color.g = static_cast<float>(g);
  color.b = static_cast<float>(b);
  color.a = static_cast<float>(a);
  return color;
}

std_msgs::ColorRGBA toHueColor(double turns) {
  const double hue = 6.0 * (turns - std::floor(turns));
  return makeColor(shareAt(hue, 0.0), shareAt(hue, 2.0), shareAt(hue, 4.0), 1.0);
}

std_msgs::ColorRGBA toSpanColor(double height_m, const HeightRange& span) {
  const double ratio = std::clamp((height_m - span.min_m) / (span.max_m - span.min_m), 0.0, 1.0);
  return toHueColor((1.0 - ratio) * 2.0 / 3.0);
}

bool isOtherSpan(const HeightRange& span, const HeightRange& shown) {
  const double tolerance_m = 0.1 * (shown.max_m - shown.min_m);
  return std::abs(span.min_m - shown.min_m) > tolerance_m ||
         std::abs(span.max_m - shown.max_m) > tolerance_m;
}

std_msgs::ColorRGBA freeColor() { return makeColor(0.2, 0.8, 0.3, 0.1); }

visualization_msgs::Marker makeCubeList(const std_msgs::Header& header,
                                        const std::string& name_space, int id,
                                        const Eigen::Vector3d& size_m) {
  visualization_msgs::Marker marker;
  marker.header = header;
  marker.ns = name_space;
  marker.id = id;
  marker.type = visualization_msgs::Marker::CUBE_LIST;
  marker.pose.orientation.w = 1.0;
  // Otherwise rviz loses it in another fixed frame when tf has forgotten the stamp.
  marker.frame_locked = static_cast<std::uint8_t>(true);
  marker.scale = toVector3(size_m);
  return marker;
}

}  // namespace cuboid_mapping_ros
