// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/occupancy/sensor_model.h"
#include "cuboid_mapping/ros/conversions/ground_filter.h"
#include "cuboid_mapping/ros/conversions/no_return_points.h"
#include "cuboid_mapping/ros/middleware/core_names.h"
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

/// Name of the parameter's value, such as "laser_scan".
[[nodiscard]] const char* toString(SourceType type);

/// Effect of a source's beams on the map.
enum class SourceUse : unsigned char {
  kBoth,  ///< They mark their end as occupied, and clear the space before it.
  kMark,  ///< They only mark.
  kClear  ///< They only clear: the end of a beam changes nothing.
};

/// Parameters that each source may set.
struct SourceParameters {
  std::string name;                 ///< Name in diagnostics and messages; empty: the topic.
  std::string topic = kCloudTopic;  ///< Name before remapping, in the namespace of the node.
  SourceType type = SourceType::kPointCloud;
  std::string camera_info;  ///< Topic, for depth images; empty: beside that of the image.
  SourceUse use = SourceUse::kBoth;
  double max_rate_hz = 0.0;    ///< Messages beyond this rate are ignored; 0: no limit.
  bool deskew = false;         ///< Each point has the pose of its own time; else that of the stamp.
  double depth_unit_m = 1e-3;  ///< Unit of depth images of whole numbers.
  std::string sensor_frame;    ///< Frame whose origin is the start of beams; "": the cloud's frame.
  double forget_after_s = 0.0;  ///< See Forgetting; 0: never.
  /// Probabilities of the source; the thresholds are those of the map.
  SensorModelConfig sensor_model;
  double max_range_m = std::numeric_limits<double>::infinity();  ///< Beams are cut there.
  double end_margin_m = 0.0;                                     ///< See BeamRanges.
  double min_range_m = 0.0;        ///< Nearer points are left out wholly; 0: none.
  double no_return_range_m = 0.0;  ///< Beams without return free space up to it; 0: skipped.
  NoReturnPoints no_return_points = NoReturnPoints::kRep117;  ///< Readings that count as no return.
  NoReturnRanges no_return_ranges_m;                          ///< Ranges that stand for such beams.
  /// Points outside are left out with their beams; in the map's frame, with filter_ground in the base's.
  MetricBox crop = {Eigen::Vector3d::Constant(-1e9), Eigen::Vector3d::Constant(1e9)};
  bool filter_ground = false;  ///< Whether points of the ground are no obstacles and free space.
  GroundFilterConfig ground_filter;
};

/// The name of a source in diagnostics and messages.
[[nodiscard]] inline const std::string& nameOf(const SourceParameters& source) {
  return source.name.empty() ? source.topic : source.name;
}

}  // namespace cuboid_mapping_ros
