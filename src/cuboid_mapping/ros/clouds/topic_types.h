// SPDX-License-Identifier: BSD-3-Clause
// Message types of sensor topics.
#pragma once

#include "cuboid_mapping/ros/parameters/parameters.h"

#include <map>
#include <string>

namespace cuboid_mapping_ros {

constexpr char kClouds[] = "sensor_msgs/PointCloud2";
constexpr char kScans[] = "sensor_msgs/LaserScan";
constexpr char kImages[] = "sensor_msgs/Image";
constexpr char kCompressed[] = "sensor_msgs/CompressedImage";

/// Message type that a source expects on a topic, such as "sensor_msgs/LaserScan".
[[nodiscard]] const char* datatypeOf(SourceType type, const std::string& topic);

/// Advice for sensor messages that cannot be mapped directly; empty for all other types.
[[nodiscard]] std::string adviseOn(const std::string& datatype);

/// Error and cure if a topic has another type than its source; else empty.
[[nodiscard]] std::string describeWrongType(const SourceParameters& source,
                                            const std::string& topic, const std::string& datatype);

/// Message types of all topics that are published, by name; empty if the master does not answer.
///
/// Asks the master once, without waiting for it.
[[nodiscard]] std::map<std::string, std::string> publishedTypes();

}  // namespace cuboid_mapping_ros
