// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/sensor_conversions.h"

#include "cuboid_mapping/io/text.h"

#include <laser_geometry/laser_geometry.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using sensor_msgs::LaserScan;

CloudError makeError(DropReason defect, const LaserScan& scan, const std::string& what) {
  return describeError(defect, "scan", scan.header, what);
}

/// A range rounded to millimetres.
std::string toMillimetres(float range_m) {
  return cuboid_mapping::toText(std::round(1e3 * static_cast<double>(range_m)) / 1e3);
}

/// Readings that take part in a scan.
struct LaserBeams {
  LaserScan scan;             ///< Ranges: without return the beam's length, ignored ones NaN.
  std::vector<bool> returns;  ///< Whether a beam was reflected.
  std::size_t num_invalid = 0;
};

LaserBeams chooseBeams(const LaserScan& scan, const CloudOptions& options) {
  LaserBeams beams;
  beams.scan = scan;
  beams.scan.intensities.clear();
  beams.scan.range_min = std::numeric_limits<float>::lowest();
  beams.scan.range_max = std::numeric_limits<float>::max();
  const float range_max = rangeMaxOf(scan);
  beams.returns.resize(scan.ranges.size());
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    float& range = beams.scan.ranges[i];
    NoReturnPoints reading = classifyReading(static_cast<double>(range));
    const bool is_named = contains(options.no_return_ranges_m, static_cast<double>(range));
    if (reading == NoReturnPoints::kNone && range >= range_max) {
      reading = NoReturnPoints::kRangeMax;
    }
    beams.returns[i] = reading == NoReturnPoints::kNone && !is_named && range >= scan.range_min;
    if (beams.returns[i]) continue;
    ++beams.num_invalid;
    const bool is_free = (is_named || contains(options.no_return_points, reading)) &&
                         options.no_return_range_m > 0.0;
    range = is_free ? static_cast<float>(options.no_return_range_m)
                    : std::numeric_limits<float>::quiet_NaN();
  }
  return beams;
}

/// Corrects angles that contradict each other: an increment that is 0 or no number, or by which the scan goes round more
/// than twice. Then the limits count, or if these go round too often, all angles are degrees. Of two angles that are
/// possible, the increment counts, as in laser_geometry. @return The warning; empty if the angles agree, or nothing
/// makes them agree.
std::string correctAngles(LaserScan& scan) {
  const auto is_sane = [](double span) {
    return span != 0.0 && std::abs(span) <= 4.0 * M_PI + 1e-3;  // Not NaN.
  };
  constexpr double kDegree = M_PI / 180.0;
  const double num_steps = static_cast<double>(scan.ranges.size()) - 1.0;
  const double span = static_cast<double>(scan.angle_increment) * num_steps;
  if (num_steps < 1.0) return "";
  const double limits = static_cast<double>(scan.angle_max) - static_cast<double>(scan.angle_min);
  if (is_sane(span)) {
    const double least = 0.1 * std::abs(span) + 3.0 * std::abs(span) / num_steps;
    if (!is_sane(limits) && std::abs(span - kDegree * limits) <= least) {
      scan.angle_min *= static_cast<float>(kDegree);
      return "angle_min and angle_max are taken as degrees, since angle_increment is in radians. "
             "Correct the driver";
    }
    if (!is_sane(limits) || std::abs(span - limits) <= least) return "";
    return "angle_increment does not lead from angle_min to angle_max: the increment counts. "
           "Correct the driver";
  }
  const std::string contradiction =
      "angle_increment is " + cuboid_mapping::toText(static_cast<double>(scan.angle_increment)) +
      ", which cannot be in a scan of " + std::to_string(scan.ranges.size()) + " ranges: ";
  if (is_sane(limits)) {
    scan.angle_increment = static_cast<float>(limits / num_steps);
    return contradiction + "it is taken as " +
           cuboid_mapping::toText(static_cast<double>(scan.angle_increment)) +
           ", from angle_min to angle_max";
  }
  if (!is_sane(kDegree * span)) return "";
  scan.angle_min *= static_cast<float>(kDegree);
  scan.angle_increment *= static_cast<float>(kDegree);
  return contradiction + "the angles are taken as degrees";
}

LaserScan toMetres(LaserScan scan, double unit_m) {
  constexpr float kMostMetres = 1000.0F;
  const auto unit = static_cast<float>(unit_m);
  for (float& range : scan.ranges) range *= unit;
  if (scan.range_max < kMostMetres)
    return scan;  // The limits are in metres, whatever the ranges are in.
  scan.range_min *= unit;
  scan.range_max *= unit;
  return scan;
}

/// Whether the ranges of a scan without a return differ, and are those of a scan in millimetres.
bool areMillimetres(const LaserScan& scan) {
  constexpr float kLeast = 1000.0F;
  constexpr float kMost = 200000.0F;
  std::size_t num_such = 0;
  std::size_t num_positive = 0;
  for (const float range : scan.ranges) {
    if (!(range > 0.0F) || !std::isfinite(range)) continue;
    ++num_positive;
    if (range > kLeast && range < kMost && range != scan.ranges.front()) ++num_such;
  }
  return num_such > 0 && 2 * num_such >= num_positive;
}

struct Converter {
  const CloudOptions& options;

  auto operator()(const sensor_msgs::PointCloud2::ConstPtr& cloud) const {
    return convertCloud(*cloud, options);
  }
  auto operator()(const LaserScan::ConstPtr& scan) const {
    return convertLaserScan(*scan, options);
  }
  auto operator()(const DepthImage& depth) const { return convertDepthImage(depth, options); }
};

struct HeaderOf {
  template <typename MessageT>
  const std_msgs::Header& operator()(const MessageT& message) const {
    return message->header;
  }
  const std_msgs::Header& operator()(const DepthImage& depth) const { return depth.image->header; }
};

struct BytesOf {
  std::size_t operator()(const sensor_msgs::PointCloud2::ConstPtr& cloud) const {
    return sizeof(*cloud) + cloud->data.capacity();
  }
  std::size_t operator()(const sensor_msgs::LaserScan::ConstPtr& scan) const {
    return sizeof(*scan) + (scan->ranges.capacity() + scan->intensities.capacity()) * sizeof(float);
  }
  std::size_t operator()(const DepthImage& depth) const {
    return sizeof(*depth.image) + depth.image->data.capacity() + sizeof(*depth.camera);
  }
};

}  // namespace

float rangeMaxOf(const LaserScan& scan) {
  return scan.range_max > scan.range_min ? scan.range_max : std::numeric_limits<float>::infinity();
}

ConvertedCloud convertLaserScan(const LaserScan& scan, const CloudOptions& options) {
  if (scan.ranges.empty()) return makeError(DropReason::kNoPoints, scan, "it has no ranges");
  if (options.length_unit_m > 0.0 && options.length_unit_m != 1.0) {
    CloudOptions in_metres = options;
    in_metres.length_unit_m = 1.0;
    return convertLaserScan(toMetres(scan, options.length_unit_m), in_metres);
  }
  LaserBeams beams = chooseBeams(scan, options);
  std::string warning = correctAngles(beams.scan);
  const auto num_ranges = static_cast<float>(scan.ranges.size());
  if (!std::isfinite(beams.scan.angle_min + beams.scan.angle_increment * num_ranges)) {
    return makeError(DropReason::kBadLayout, scan, "angle_min or angle_increment is no number");
  }
  sensor_msgs::PointCloud2 projected;
  laser_geometry::LaserProjection().projectLaser(beams.scan, projected, -1.0,
                                                 laser_geometry::channel_option::Index);
  CloudPoints cloud;
  if (!warning.empty()) cloud.warnings.push_back(std::move(warning));
  if (rangeMaxOf(scan) != scan.range_max) {
    cloud.warnings.push_back("range_max, " + toMillimetres(scan.range_max) +
                             " m, is not above range_min: it is taken as unset");
  }
  cloud.points.reserve(projected.width);
  sensor_msgs::PointCloud2ConstIterator<float> point(projected, "x");
  sensor_msgs::PointCloud2ConstIterator<std::int32_t> index(projected, "index");
  for (; point != point.end(); ++point, ++index) {
    const auto number = static_cast<std::uint32_t>(*index);
    const bool is_return = beams.returns.at(number);
    (is_return ? cloud.points : cloud.no_returns).emplace_back(point[0], point[1], point[2]);
    if (!options.wants_numbers) continue;
    (is_return ? cloud.point_numbers : cloud.no_return_numbers).push_back(number);
  }
  if (cloud.points.empty() && options.length_unit_m == 0.0 && areMillimetres(scan)) {
    return makeError(DropReason::kWrongUnit, scan,
                     "most of its ranges are above 1000, and range_max is " +
                         toMillimetres(scan.range_max) + " m");
  }
  if (auto error = checkUnit(cloud, options, scan.header)) return *error;
  cloud.num_invalid = beams.num_invalid;
  cloud.num_skipped = cloud.num_invalid - cloud.no_returns.size();
  if (cloud.points.empty() && cloud.no_returns.empty()) {
    return makeError(DropReason::kNoValidPoints, scan,
                     "none of its " + std::to_string(scan.ranges.size()) +
                         " ranges is a return, from range_min, " + toMillimetres(scan.range_min) +
                         " m, to below range_max, " + toMillimetres(scan.range_max) + " m");
  }
  return cloud;
}

ConvertedCloud convert(const SensorMessage& message, const CloudOptions& options) {
  return std::visit(Converter{options}, message.content);
}

const std_msgs::Header& SensorMessage::header() const { return std::visit(HeaderOf{}, content); }

std::size_t SensorMessage::numBytes() const { return std::visit(BytesOf{}, content); }

}  // namespace cuboid_mapping_ros
