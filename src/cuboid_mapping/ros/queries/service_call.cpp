// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/queries/service_call.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/query/value_query.h"
#include "cuboid_mapping/ros/map/map_storage.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <tf2_eigen/tf2_eigen.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::toText;

/// Maximum wait for tf: requests have the current time or the stamp of a sensor, which tf reaches some
/// milliseconds later.
constexpr std::chrono::milliseconds kTfPatience(200);
constexpr std::chrono::milliseconds kLookupPeriod(5);

std::string describeInput(const FieldName& field) {
  return field.element ? std::string(field.name) + '[' + std::to_string(*field.element) + ']'
                       : field.name;
}

std::string describeInput(const MetricBox& box) {
  return "min " + toText(box.min_m) + ", max " + toText(box.max_m);
}

/// Whether tf connects two frames only at earlier times.
bool isAheadOfTf(const tf2::BufferCore& tf, const std::string& target, const std::string& source,
                 const ros::Time& stamp) {
  return !tf.canTransform(target, source, stamp) &&
         tf.lookupTransform(target, source, ros::Time()).header.stamp < stamp;
}

void awaitTransform(const MapInFrame& map, const std::string& source, const ros::Time& stamp) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + kTfPatience;
  const std::string target = withoutSlash(map.frame_id);
  const auto is_stopped = [&] { return map.is_stopped != nullptr && *map.is_stopped; };
  try {
    while (isAheadOfTf(map.tf, target, source, stamp) && Clock::now() < end && !is_stopped()) {
      std::this_thread::sleep_for(kLookupPeriod);
    }
  } catch (const std::exception&) {  // lookupTransform() reports it.
  }
}

/// @pre Called by the work of map.read().
void takeHead(const GuardedMap& map, const CuboidMap& content, const ros::Time& stamp,
              const std::string& frame_id, AnswerInfo& info) {
  info.success = static_cast<std::uint8_t>(true);
  info.header.frame_id = withoutSlash(frame_id);
  info.header.stamp = stamp;
  info.revision = content.revision();
  info.instance = map.instance();
  info.replacements = map.numReplaced();
}

Eigen::Vector3d toFinite(const geometry_msgs::Point& point, const std::string& name) {
  Eigen::Vector3d vector = toVector(point);
  if (!vector.allFinite()) {
    throw Refusal(name + " " + toText(vector) +
                  ": a coordinate is NaN or infinite; all must be numbers in metres");
  }
  return vector;
}

}  // namespace

ServiceCall::ServiceCall(const MapInFrame& map, const std_msgs::Header& header)
    : map_(map), hold_(map.map.hold()) {
  const std::string frame_id = withoutSlash(header.frame_id);
  if (frame_id.empty() || frame_id == withoutSlash(map.frame_id)) return;
  awaitTransform(map, frame_id, header.stamp);
  const TfLookup lookup = lookupTransform(map.tf, map.frame_id, frame_id, header.stamp);
  if (!lookup.T_target_source) {
    throw Refusal("no transform from frame '" + frame_id + "' to '" + map.frame_id +
                  "': " + lookup.error +
                  ". Check the name of the frame; with stamp 0, the latest transform is used");
  }
  to_map_ = *lookup.T_target_source;
  const Eigen::Array33d turn = to_map_.linear().cwiseAbs();
  is_turned_ = ((turn - turn.round()).abs() > 1e-9).any();
}

void ServiceCall::requireFew(std::size_t num_entries, const Entries& entries) const {
  const std::size_t limit = maxEntries(map_.limits, entries.answer_bytes);
  if (num_entries <= limit) return;
  throw Refusal(std::to_string(num_entries) + ' ' + entries.name + " in one request: at most " +
                std::to_string(limit) +
                " are answered, so ask in "
                "parts");
}

Eigen::Vector3d ServiceCall::point(const geometry_msgs::Point& point,
                                   const FieldName& field) const {
  return to_map_ * toFinite(point, describeInput(field));
}

Eigen::Isometry3d ServiceCall::localPose(const geometry_msgs::Pose& pose, const FieldName& field) {
  const Eigen::Vector3d position = toFinite(pose.position, describeInput(field) + ".position");
  Eigen::Quaterniond turn;
  tf2::fromMsg(pose.orientation, turn);
  const double length = turn.norm();
  if (length == 0.0) turn.setIdentity();
  constexpr double kTolerance = 0.01;
  if (!(length == 0.0 || std::abs(length - 1.0) <= kTolerance)) {  // Also refuses NaN.
    throw Refusal(describeInput(field) + ".orientation has length " + toText(length) +
                  ": normalize the quaternion");
  }
  return Eigen::Translation3d(position) * turn.normalized();
}

std::vector<Eigen::Vector3d> ServiceCall::points(const std::vector<geometry_msgs::Point>& points,
                                                 const Entries& entries) const {
  requireFew(points.size(), entries);
  std::vector<Eigen::Vector3d> result;
  result.reserve(points.size());
  for (const geometry_msgs::Point& each : points) {
    result.push_back(point(each, {entries.name, result.size()}));
  }
  return result;
}

Eigen::Vector3d ServiceCall::direction(const geometry_msgs::Vector3& direction,
                                       const FieldName& field) const {
  const Eigen::Vector3d vector(direction.x, direction.y, direction.z);
  if (!vector.allFinite() || vector.isZero(0.0)) {
    throw Refusal(describeInput(field) + " " + toText(vector) + ": must be finite and not zero");
  }
  return to_map_.linear() * vector.stableNormalized();
}

Eigen::Vector3d ServiceCall::edges(const geometry_msgs::Vector3& size, const char* name) {
  Eigen::Vector3d edges(size.x, size.y, size.z);
  if (!edges.allFinite() || !(edges.array() > 0.0).all()) {
    throw Refusal(std::string(name) + ' ' + toText(edges) +
                  ": every edge must be a number > 0, in metres");
  }
  return edges;
}

Eigen::Vector3d ServiceCall::size(const geometry_msgs::Vector3& size, double inflation_m,
                                  const char* name) {
  const Eigen::Vector3d edges = ServiceCall::edges(size, name);
  info_.enclosing = static_cast<std::uint8_t>(is_turned_);
  return (to_map_.linear().cwiseAbs() * edges).array() +
         2.0 * notNegative(inflation_m, "inflation");
}

CellBox ServiceCall::box(const Box& box, double inflation_m, const FieldName& field) {
  const MetricBox asked{toVector(box.min), toVector(box.max)};
  const auto refuse = [&](const char* why) {
    throw Refusal(describeInput(field) + ": " + describeInput(asked) + ": " + why);
  };
  if (!asked.min_m.allFinite() || !asked.max_m.allFinite()) {
    refuse("a coordinate is NaN or infinite; all must be numbers in metres");
  }
  if (!(asked.min_m.array() < asked.max_m.array()).all()) {
    refuse("min must be less than max on every axis");
  }
  const double inflation = notNegative(inflation_m, "inflation");
  MetricBox box_map = computeEnclosingBox(to_map_, asked);
  box_map.min_m.array() -= inflation;
  box_map.max_m.array() += inflation;
  info_.enclosing = static_cast<std::uint8_t>(is_turned_);
  return requireCells(box_map);
}

std::vector<CellBox> ServiceCall::boxes(const std::vector<Box>& boxes, double inflation_m,
                                        const Entries& entries) {
  requireFew(boxes.size(), entries);
  std::vector<CellBox> result;
  result.reserve(boxes.size());
  for (const Box& each : boxes) {
    result.push_back(box(each, inflation_m, {entries.name, result.size()}));
  }
  return result;
}

CellBox ServiceCall::requireCells(const MetricBox& box_map) {
  const auto box = map_.map.grid().toCellBox(box_map);
  if (!box) {
    throw Refusal(describeInput(box_map) + " in frame '" + map_.frame_id +
                  "' reaches beyond the map: keep coordinates within " +
                  toText(Grid::kMaxCell * resolution()) + " m of the origin");
  }
  requireLoaded(*box);
  return *box;
}

void ServiceCall::requireLoaded(const CellBox& box) {
  const std::string error = loadPages(map_, box, num_pages_);
  if (!error.empty()) throw Refusal(error);
}

std::string loadPages(const MapInFrame& map, const CellBox& box, std::size_t& num_pages) {
  const std::size_t num_missing = map.map.countNotLoaded(box);
  if (num_missing == 0) return {};
  num_pages += num_missing;
  const std::string pages =
      "not loaded: " + describePages(num_pages) + ", would have to be read from the disk";
  if (map.limits.outside == QueriesOutside::kRefuse) {
    return pages +
           ". Ask about a place nearer to the robot, or set the parameter window/queries to load";
  }
  constexpr double kPageBricks = 512.0;
  if (kPageBricks * static_cast<double>(num_pages) > map.limits.max_bricks) {
    return pages + ", more than a call may load: ask for less at once";
  }
  try {
    map.map.load(box, map.is_stopped);
  } catch (const MapFileError& error) {
    return std::string("not loaded: ") + error.what();
  }
  return map.map.countNotLoaded(box) == 0 ? "" : "not loaded: the node ends";
}

double ServiceCall::notNegative(double value, const char* name) {
  if (std::isfinite(value) && value >= 0.0) return value;
  throw Refusal(std::string(name) + " is " + toText(value) +
                ": must be a finite number of at least 0");
}

double ServiceCall::positive(double value, const char* name) {
  if (std::isfinite(value) && value > 0.0) return value;
  throw Refusal(std::string(name) + " is " + toText(value) +
                ": must be a finite number greater than 0");
}

UnknownPolicy ServiceCall::policy(std::uint8_t unknown) {
  if (unknown <= 1) return static_cast<UnknownPolicy>(unknown);
  throw Refusal("unknown is " + std::to_string(unknown) +
                ": use UNKNOWN_OBSTACLE (0) or UNKNOWN_FREE (1)");
}

CuboidFilter ServiceCall::classes(std::uint8_t classes) {
  switch (classes) {
    case 1: return CuboidFilter::kFree;
    case 2: return CuboidFilter::kOccupied;
    case 3: return CuboidFilter::kAll;
    default:
      throw Refusal("classes is " + std::to_string(classes) +
                    ": use FREE (1), OCCUPIED (2) or ALL (3)");
  }
}

QueryLimits ServiceCall::limits(std::size_t entry_bytes, double max_time_s) const {
  return {std::min(map_.limits.max_time_s, max_time_s),
          static_cast<std::uint64_t>(map_.limits.max_bricks), maxEntries(map_.limits, entry_bytes)};
}

QueryLimits ServiceCall::editLimits() const {
  QueryLimits limits;
  limits.time_s = map_.limits.max_time_s;
  return limits;
}

void ServiceCall::fillInfo(const CuboidMap& content, const ros::Time& stamp) {
  takeHead(map_.map, content, stamp, map_.frame_id, info_);
}

void ServiceCall::noteEnd(const Budget& budget, const std::string& advice) {
  if (!budget.isSpent()) return;
  info_.truncated = static_cast<std::uint8_t>(true);
  const bool is_own_limit =
      budget.whyEnded() == BudgetLimit::kTime && time_limit_s_ < map_.limits.max_time_s;
  info_.message = (is_own_limit ? "ended by its time_limit of " + toText(time_limit_s_) + " s"
                                : explain(budget.whyEnded(), map_.limits)) +
                  "; " + advice;
}

void ServiceCall::noteAnswered(const Entries& entries, std::size_t num_answered,
                               std::size_t num_entries, const Budget& budget) {
  info_.answered = static_cast<std::uint32_t>(num_answered);
  noteEnd(budget,
          std::to_string(num_answered) + " of " + std::to_string(num_entries) + ' ' + entries.name +
              " are answered: " +
              (num_answered == 0 ? "ask for less, such as a smaller box, range or max_distance"
                                 : "ask for the rest in another call"));
}

AnswerInfo makeInfo(const GuardedMap& map, const std::string& frame_id, const std::string& error) {
  AnswerInfo info;
  map.read([&](const CuboidMap& content, const ros::Time& stamp) {
    takeHead(map, content, stamp, frame_id, info);
  });
  info.success = static_cast<std::uint8_t>(error.empty());
  info.message = error;
  return info;
}

Box boxMessage(const Grid& grid, const CellBox& box) {
  const MetricBox box_map = grid.toMetricBox(box);
  Box message;
  message.min = toPoint(box_map.min_m);
  message.max = toPoint(box_map.max_m);
  return message;
}

MapCuboid cuboidMessage(const CuboidMap& map, const Cuboid& cuboid, Budget& budget) {
  const Box box = boxMessage(map.grid(), cuboid.box);
  MapCuboid message;
  message.min = box.min;
  message.max = box.max;
  message.probability = static_cast<float>(meanProbability(map, cuboid.box, budget).valueOr(0.0));
  message.occupancy = static_cast<std::uint8_t>(cuboid.occupancy);
  return message;
}

Eigen::Isometry3d toIsometry(geometry_msgs::Transform transform) {
  Eigen::Quaterniond turn;
  tf2::fromMsg(transform.rotation, turn);
  if (turn.norm() == 0.0) turn.setIdentity();
  if (std::abs(turn.norm() - 1.0) < 0.01) turn.normalize();
  transform.rotation = tf2::toMsg(turn);
  return tf2::transformToEigen(transform);
}

Body readTurningBox(const ServiceCall& call, const geometry_msgs::Vector3& size,
                    double inflation_m) {
  BodyBox box;
  box.size_m = ServiceCall::edges(size);
  box.size_m.array() += 2.0 * ServiceCall::notNegative(inflation_m, "inflation");
  Body body{{}, {box}};
  const std::string fault = findFault(body, call.map().grid());
  if (!fault.empty()) throw Refusal("size, as a body with one box: " + fault);
  return body;
}

Eigen::Isometry3d readHeaded(const ServiceCall& call, const geometry_msgs::Point& point,
                             const FieldName& field, double heading_rad) {
  if (!std::isfinite(heading_rad)) {
    throw Refusal("the heading of " + describeInput(field) +
                  " is NaN or infinite: give an angle in radians");
  }
  geometry_msgs::Pose pose;
  pose.position = point;
  pose.orientation.z = std::sin(0.5 * heading_rad);
  pose.orientation.w = std::cos(0.5 * heading_rad);
  return call.pose(pose, field);
}

}  // namespace cuboid_mapping_ros
