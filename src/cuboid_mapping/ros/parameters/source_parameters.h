// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/occupancy/sensor_model.h"
#include "cuboid_mapping/ros/conversions/ground_filter.h"
#include "cuboid_mapping/ros/conversions/no_return_points.h"
#include "cuboid_mapping/ros/middleware/names.h"

#include <Eigen/Core>

#include <limits>
#include <string>

namespace cuboid_mapping_ros {

/// Message type of a source.
enum class SourceType : unsigned char {
  kPointCloud,  ///< sensor_msgs/PointCloud2
  kLaserScan,   ///< sensor_msgs/LaserScan
  kDepthImage   ///< sensor_msgs/Image with its sensor_msgs/CameraInfo
};

/// The name of the parameter's value, as "laser_scan".
[[nodiscard]] const char* toString(SourceType type);

/// Effect of a source's beams on the map.
enum class SourceUse : unsigned char {
  kBoth,  ///< They mark their end as occupied, and clear the space before it.
  kMark,  ///< Only the former.
  kClear  ///< Only the latter: where a beam of the source ends, it changes nothing.
};

/// Parameters that each source may have of its own.
struct SourceParameters {
  std::string name;                 ///< Name in diagnostics and messages; empty: the topic.
  std::string topic = kCloudTopic;  ///< Before remapping, in the namespace of the node.
  SourceType type = SourceType::kPointCloud;
  std::string camera_info;  ///< Topic, of depth images; empty: beside that of the image.
  SourceUse use = SourceUse::kBoth;
  double max_rate_hz = 0.0;    ///< Messages beyond this rate are ignored; 0: no limit.
  bool deskew = false;         ///< Each point has the pose of its own time; else that of the stamp.
  double depth_unit_m = 1e-3;  ///< Unit of depth images of whole numbers.
  std::string sensor_frame;    ///< Its origin is where beams start; "": the cloud's frame.
  double forget_after_s = 0.0;  ///< See Forgetting; 0: never.
  /// The thresholds are those of the map, the same for all sources.
  cuboid_mapping::SensorModelConfig sensor_model;
  double max_range_m = std::numeric_limits<double>::infinity();  ///< Beams are cut there.
  double end_margin_m = 0.0;       ///< See cuboid_mapping::BeamRanges.
  double min_range_m = 0.0;        ///< Nearer points are left out wholly; 0: none.
  double no_return_range_m = 0.0;  ///< Beams without return free space up to it; 0: are skipped.
  NoReturnPoints no_return_points = NoReturnPoints::kRep117;  ///< Readings that count as no return.
  NoReturnRanges no_return_ranges_m;                          ///< Ranges that are such beams.
  /// Points outside are left out wholly; in the map's frame, with filter_ground in the base's.
  cuboid_mapping::MetricBox crop = {Eigen::Vector3d::Constant(-1e9),
                                    Eigen::Vector3d::Constant(1e9)};
  bool filter_ground = false;  ///< Whether points of the ground free space, and are no obstacles.
  GroundFilterConfig ground_filter;
};

/// The name of a source in diagnostics and messages.
[[nodiscard]] inline const std::string& nameOf(const SourceParameters& source) {
  return source.name.empty() ? source.topic : source.name;
}

}  // namespace cuboid_mapping_ros
