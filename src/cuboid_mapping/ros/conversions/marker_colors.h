// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/height_range.h"
#include "cuboid_mapping/ros/middleware/core_names.h"

#include <std_msgs/ColorRGBA.h>
#include <std_msgs/Header.h>
#include <visualization_msgs/Marker.h>

#include <Eigen/Core>

#include <string>

namespace cuboid_mapping_ros {

/// A colour of these shares, from 0 to 1.
[[nodiscard]] std_msgs::ColorRGBA makeColor(double r, double g, double b, double a);

/// Colour of a hue, in turns of the circle: red at 0, green at 1/3, blue at 2/3, and red again at
/// 1; any finite number. Saturation, value and alpha are 1.
[[nodiscard]] std_msgs::ColorRGBA toHueColor(double turns);

/// Colour of a height: blue at the low end of a span and below, then cyan, green and yellow, red at the
/// high end and above, in equal steps of hue. @param span  min_m < max_m.
[[nodiscard]] std_msgs::ColorRGBA toSpanColor(double height_m, const HeightRange& span);

/// Whether a span differs so much from the shown one that all cuboids should be coloured again:
/// an end has moved by more than a tenth of it.
[[nodiscard]] bool isOtherSpan(const HeightRange& span, const HeightRange& shown);

/// The colour of all free cuboids: green, translucent.
[[nodiscard]] std_msgs::ColorRGBA freeColor();

/// A marker of cubes of one size, without cubes.
[[nodiscard]] visualization_msgs::Marker makeCubeList(const std_msgs::Header& header,
                                                      const std::string& name_space, int id,
                                                      const Eigen::Vector3d& size_m);

}  // namespace cuboid_mapping_ros
