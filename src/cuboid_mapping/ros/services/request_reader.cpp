// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/services/request_reader.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/parameters/service_limits.h"
#include "cuboid_mapping/ros/parameters/window_parameters.h"

#include <tf2_eigen/tf2_eigen.h>

#include <cmath>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::CellBox;
using cuboid_mapping::MetricBox;
using cuboid_mapping::toText;
using cuboid_mapping::UnknownPolicy;

std::string describe(const FieldName& field) {
  return field.element ? field.name + '[' + std::to_string(*field.element) + ']' : field.name;
}

std::string describe(const MetricBox& box) {
  return "min " + toText(box.min_m) + ", max " + toText(box.max_m);
}

}  // namespace

RequestReader::RequestReader(const MapInFrame& map, const std_msgs::Header& header)
    : map_(map), hold_(map.map.hold()) {
  const std::string frame_id = withoutSlash(header.frame_id);
  if (frame_id.empty() || frame_id == withoutSlash(map.frame_id)) return;
  const TfLookup lookup = lookupTransform(map.tf, map.frame_id, frame_id, header.stamp);
  if (lookup.T_target_source) {
    to_map_ = *lookup.T_target_source;
  } else {
    require(false, "no transform from frame '" + frame_id + "' to '" + map.frame_id +
                       "': " + lookup.error +
                       ". Check the name of the frame; with stamp 0, the latest transform is used");
  }
}

void RequestReader::require(bool condition, const std::string& text) {
  if (!condition && error_.empty()) error_ = text;
}

void RequestReader::requireFew(std::size_t num_entries, const std::string& name,
                               std::size_t entry_bytes) {
  const std::size_t limit = maxEntries(map_.limits, entry_bytes);
  require(num_entries <= limit,
          std::to_string(num_entries) + ' ' + name + " in one request: at most " +
              std::to_string(limit) +
              " are answered (parameters query/max_entries and query/max_answer), so ask in parts");
}

Eigen::Vector3d RequestReader::point(const geometry_msgs::Point& point, const FieldName& field) {
  const Eigen::Vector3d vector = toVector(point);
  require(vector.allFinite(), [&] {
    return describe(field) + " " + toText(vector) +
           ": a coordinate is NaN or infinite; all must be numbers in metres";
  });
  return to_map_ * vector;
}

std::vector<Eigen::Vector3d> RequestReader::points(const std::vector<geometry_msgs::Point>& points,
                                                   const std::string& name) {
  std::vector<Eigen::Vector3d> result;
  result.reserve(points.size());
  for (const geometry_msgs::Point& each : points) {
    if (!isGood()) break;
    result.push_back(point(each, {name, result.size()}));
  }
  return result;
}

Eigen::Vector3d RequestReader::direction(const geometry_msgs::Vector3& direction,
                                         const FieldName& field) {
  const Eigen::Vector3d vector(direction.x, direction.y, direction.z);
  require(vector.allFinite() && !vector.isZero(0.0),
          [&] { return describe(field) + " " + toText(vector) + ": must be finite and not zero"; });
  return to_map_.linear() * vector;
}

Eigen::Vector3d RequestReader::size(const geometry_msgs::Vector3& size, double inflation_m) {
  const Eigen::Vector3d edges(size.x, size.y, size.z);
  require(edges.allFinite() && (edges.array() > 0.0).all(),
          "size " + toText(edges) + ": every edge must be a number > 0, in metres");
  return (to_map_.linear().cwiseAbs() * edges).array() +
         2.0 * notNegative(inflation_m, "inflation");
}

CellBox RequestReader::box(const geometry_msgs::Point& min, const geometry_msgs::Point& max,
                           double inflation_m) {
  const MetricBox box{toVector(min), toVector(max)};
  require(box.min_m.allFinite() && box.max_m.allFinite(), [&] {
    return describe(box) + ": a coordinate is NaN or infinite; all must be numbers in metres";
  });
  require((box.min_m.array() < box.max_m.array()).all(),
          [&] { return describe(box) + ": min must be less than max on every axis"; });
  const double inflation = notNegative(inflation_m, "inflation");
  if (!isGood()) return {};
  MetricBox box_map = computeEnclosingBox(to_map_, box);
  box_map.min_m.array() -= inflation;
  box_map.max_m.array() += inflation;
  return cells(box_map);
}

std::vector<CellBox> RequestReader::boxes(const std::vector<geometry_msgs::Point>& min,
                                          const std::vector<geometry_msgs::Point>& max,
                                          double inflation_m) {
  require(min.size() == max.size(), "min has " + std::to_string(min.size()) + " points, max " +
                                        std::to_string(max.size()) +
                                        ": give one of each for every box");
  std::vector<CellBox> boxes;
  boxes.reserve(min.size());
  for (std::size_t i = 0; isGood() && i < min.size(); ++i) {
    boxes.push_back(box(min[i], max[i], inflation_m));
    if (!isGood()) error_ = "box " + std::to_string(i) + ": " + error_;
  }
  return boxes;
}

CellBox RequestReader::cells(const MetricBox& box_map) {
  if (!isGood()) return {};
  const auto box = map_.map.grid().toCellBox(box_map);
  require(box.has_value(), [&] {
    const double limit_m = cuboid_mapping::Grid::kMaxCell * map_.map.grid().resolution();
    return describe(box_map) + " in frame '" + map_.frame_id +
           "' reaches beyond the map: keep coordinates within " + toText(limit_m) +
           " m of the origin";
  });
  if (!box) return {};
  requireLoaded(*box);
  return *box;
}

void RequestReader::requireLoaded(const CellBox& box) {
  if (!isGood()) return;
  const std::string error = loadPages(map_.map, box, map_.limits, num_pages_);
  require(error.empty(), error);
}

std::string loadPages(GuardedMap& map, const CellBox& box, const ServiceLimits& limits,
                      std::size_t& num_pages) {
  const std::size_t num_missing = map.countNotLoaded(box);
  if (num_missing == 0) return {};
  num_pages += num_missing;
  const std::string pages =
      "not loaded: " + describePages(num_pages) + ", would have to be read from the disk";
  if (limits.outside == QueriesOutside::kRefuse) {
    return pages +
           ". Ask about a place nearer to the robot, or set the parameter window/queries to load";
  }
  constexpr double kPageBricks = 512.0;
  if (kPageBricks * static_cast<double>(num_pages) > limits.max_bricks) {
    return pages + ", which is more than query/max_bricks allows: ask for less at once";
  }
  try {
    map.load(box);
  } catch (const cuboid_mapping::MapFileError& error) {
    return std::string("not loaded: ") + error.what();
  }
  return {};
}

double RequestReader::notNegative(double value, const std::string& name) {
  require(std::isfinite(value) && value >= 0.0,
          [&] { return name + " is " + toText(value) + ": must be a number of at least 0"; });
  return value;
}

UnknownPolicy RequestReader::policy(std::uint8_t unknown) {
  require(unknown <= 1, "unknown is " + std::to_string(unknown) +
                            ": use UNKNOWN_BLOCKS (0) or UNKNOWN_PASSES (1)");
  return unknown == 0 ? UnknownPolicy::kStop : UnknownPolicy::kPass;
}

Eigen::Isometry3d toIsometry(geometry_msgs::Transform transform) {
  Eigen::Quaterniond turn;
  tf2::fromMsg(transform.rotation, turn);
  if (turn.norm() == 0.0) turn.setIdentity();
  if (std::abs(turn.norm() - 1.0) < 0.01) turn.normalize();
  transform.rotation = tf2::toMsg(turn);
  return tf2::transformToEigen(transform);
}

}  // namespace cuboid_mapping_ros
