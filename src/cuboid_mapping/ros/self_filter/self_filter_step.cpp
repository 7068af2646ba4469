// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/self_filter/self_filter_step.h"

#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_file_error.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/scan/scan_filter.h"

#include <boost/algorithm/string/predicate.hpp>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// Limit of free voxels: each cloud visits all of them.
constexpr double kMaxFreeVoxels = 1e6;

std::string readTextFile(const std::string& file) {
  std::string text;
  try {
    text = readFile(file);
  } catch (const MapFileError&) {
    // An unreadable file counts as one without text.
  }
  if (text.empty()) throw std::runtime_error("self_filter/robot_description: cannot read " + file);
  return text;
}

/// Text of the robot's description; empty if none is set.
std::string readDescription(const SelfFilterParameters& parameters, const FindText& find_text) {
  const std::string& name = parameters.robot_description;
  if (name.empty()) return {};
  if (boost::algorithm::ends_with(name, ".urdf")) return readTextFile(name);
  auto text = find_text(name);
  if (text && !text->empty()) return *std::move(text);
  throw std::runtime_error("self_filter/robot_description: there is no parameter " + name +
                           " with a URDF");
}

/// Refuses more than kMaxFreeVoxels.
void checkVolume(const RobotParts& parts, const NodeParameters& parameters) {
  double volume_m3 = 0.0;
  for (const RobotPart& part : parts) {
    volume_m3 += (part.exact.bounds.max_m - part.exact.bounds.min_m).prod();
  }
  const double num_voxels = volume_m3 / std::pow(parameters.map.resolution_m, 3);
  if (!parameters.of<SelfFilterParameters>().keep_free || num_voxels <= kMaxFreeVoxels) return;
  std::ostringstream text;
  text << "self_filter/keep_free: the robot has " << num_voxels << " voxels, but may have "
       << kMaxFreeVoxels
       << ": give meshes in millimetres a scale of 0.001 in the URDF; else choose "
       << "a greater resolution, or set it to false";
  throw std::runtime_error(text.str());
}

using Points = std::vector<Eigen::Vector3f>;

bool isIn(const Solid& solid, const Eigen::Vector3d& point) {
  return isInside(solid.bounds, point) && solid.contains(point);
}

/// A ball that bounds a part, in the frame of points.
struct Ball {
  Eigen::Vector3f center = Eigen::Vector3f::Zero();
  float radius_m = 0.0F;

  [[nodiscard]] bool contains(const Eigen::Vector3f& point) const {
    return (point - center).squaredNorm() <= radius_m * radius_m;
  }
};

/// Ball around the padded part. It is a little larger: points near the border are decided in double.
Ball ballAround(const RobotPart& part, const Eigen::Isometry3d& T_part_points) {
  const MetricBox& box = part.padded.bounds;
  const Eigen::Vector3d center = T_part_points.inverse() * (0.5 * (box.min_m + box.max_m));
  const double radius_m = 0.5 * (box.max_m - box.min_m).norm();
  return {center.cast<float>(),
          static_cast<float>(radius_m * 1.0001 + 1e-6 * center.norm() + 1e-4)};
}

Ball ballAround(const std::vector<Ball>& balls) {
  Ball all = balls.front();
  for (const Ball& ball : balls)
    all.center += (ball.center - balls.front().center) / static_cast<float>(balls.size());
  for (const Ball& ball : balls) {
    all.radius_m =
        std::max(all.radius_m, 1.0001F * (ball.center - all.center).norm() + ball.radius_m);
  }
  return all;
}

void addVoxels(const Solid& solid, const Eigen::Isometry3d& T_map_part, const Grid& grid,
               const Eigen::Vector3d& anchor_map, Points& centers) {
  const MetricBox bounds = computeEnclosingBox(T_map_part, solid.bounds);
  const auto first = grid.toCell(bounds.min_m);
  const auto last = grid.toCell(bounds.max_m);
  if (!first || !last) return;  // Out of range.
  const Eigen::Isometry3d T_part_map = T_map_part.inverse();
  for (std::int32_t x = first->x; x <= last->x; ++x) {
    for (std::int32_t y = first->y; y <= last->y; ++y) {
      for (std::int32_t z = first->z; z <= last->z; ++z) {
        const Eigen::Vector3d center = grid.toMetres(Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5));
        if (!isIn(solid, T_part_map * center)) continue;
        centers.push_back((center - anchor_map).cast<float>());
      }
    }
  }
}

}  // namespace

void loadRobotParts(NodeParameters& parameters, const FindText& find_text) {
  SelfFilterParameters& filter = parameters.of<SelfFilterParameters>();
  RobotParts parts = filter.boxes;
  const std::string urdf = readDescription(filter, find_text);
  if (!urdf.empty()) {
    const auto ignored = wordsOf(filter.ignored_links);
    const RobotParts shapes =
        readRobotDescription(urdf, filter.padding_m, {ignored.begin(), ignored.end()});
    parts.insert(parts.end(), shapes.begin(), shapes.end());
  }
  checkVolume(parts, parameters);
  filter.parts = std::move(parts);
}

std::size_t removePointsOnRobot(const RobotParts& parts,
                                const std::vector<Eigen::Isometry3d>& T_part_points,
                                Points& points) {
  assert(T_part_points.size() == parts.size());
  if (parts.empty()) return 0;
  std::vector<Ball> balls;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    balls.push_back(ballAround(parts[i], T_part_points[i]));
  }
  const Ball all = ballAround(balls);
  const auto is_on_robot = [&](const Eigen::Vector3f& point) {
    if (!all.contains(point)) return false;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (!balls[i].contains(point)) continue;
      if (isIn(parts[i].padded, T_part_points[i] * point.cast<double>())) return true;
    }
    return false;
  };
  const auto end = std::remove_if(points.begin(), points.end(), is_on_robot);
  const auto count = static_cast<std::size_t>(std::distance(end, points.end()));
  points.erase(end, points.end());
  return count;
}

Points findRobotVoxels(const RobotParts& parts, const std::vector<Eigen::Isometry3d>& T_map_part,
                       const Grid& grid, const Eigen::Vector3d& anchor_map) {
  assert(T_map_part.size() == parts.size());
  Points centers;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    addVoxels(parts[i].exact, T_map_part[i], grid, anchor_map, centers);
  }
  return centers;
}

void SelfFilterStep::readReferences(NodeParameters& parameters, const FindText& find_text) {
  loadRobotParts(parameters, find_text);
}

std::vector<StepFrame> SelfFilterStep::frames() const {
  std::vector<StepFrame> frames;
  for (const RobotPart& part : parameters_.parts) {
    frames.push_back({part.frame_id, "a frame of self_filter; see self_filter/ignored_links"});
  }
  return frames;
}

void SelfFilterStep::apply(SensorPart& part, const StepPoses& poses, CloudFigures& figures) const {
  const Eigen::Isometry3d T_map_points =
      part.T_map_cloud * Eigen::Translation3d(part.points.anchor_cloud);
  std::vector<Eigen::Isometry3d> T_part_points;
  for (const Eigen::Isometry3d& T_map_part : poses) {
    T_part_points.push_back(T_map_part.inverse() * T_map_points);
  }
  figures.num_on_robot += removePointsOnRobot(parameters_.parts, T_part_points, part.points.points);
}

std::vector<Eigen::Vector3f> SelfFilterStep::findFreePoints(
    const StepPoses& poses, const Eigen::Vector3d& anchor_map) const {
  if (!parameters_.keep_free) return {};
  return findRobotVoxels(parameters_.parts, poses, grid_, anchor_map);
}

namespace {

using P = NodeParameters;

using F = SelfFilterParameters;
using XmlRpc::XmlRpcValue;

/// Three numbers; nothing for another value.
std::optional<Eigen::Vector3d> readCorner(XmlRpcValue list) {
  if (list.getType() != XmlRpcValue::TypeArray || list.size() != 3) return std::nullopt;
  Eigen::Vector3d corner;
  for (int axis = 0; axis < 3; ++axis) {
    const auto number = numberOf(list[axis]);
    if (!number) return std::nullopt;
    corner[axis] = *number;
  }
  return corner;
}

/// Adds a box. @return Reason of refusal; empty if it is added.
std::string addBox(const XmlRpcValue& group, RobotParts& boxes) {
  if (group.getType() != XmlRpcValue::TypeStruct) return "is no group of keys";
  for (const auto& [key, value] : group) {
    if (key != "frame" && key != "min" && key != "max") return "has an unknown key " + key;
  }
  const std::string frame =
      withoutSlash(textOf(findValue(group, "frame").value_or("")).value_or(""));
  if (frame.empty()) return "needs a frame";
  const auto min_m = readCorner(findValue(group, "min").value_or(XmlRpcValue()));
  if (!min_m) return "needs min: [x, y, z]";
  const auto max_m = readCorner(findValue(group, "max").value_or(XmlRpcValue()));
  if (!max_m) return "needs max: [x, y, z]";
  if (!(min_m->array() < max_m->array()).all() || !min_m->allFinite() || !max_m->allFinite()) {
    return "needs a min that is less than its max along each axis";
  }
  boxes.push_back(makeBoxPart(frame, {*min_m, *max_m}));
  return {};
}

std::string setBoxes(P& p, const XmlRpcValue& list) {
  if (!list.valid()) return {};  // No list is given.
  if (list.getType() != XmlRpcValue::TypeArray) return "begin each box with a dash";
  RobotParts boxes;
  for (int i = 0; i < list.size(); ++i) {
    const std::string refusal = addBox(list[i], boxes);
    if (!refusal.empty()) return "box " + std::to_string(i) + ' ' + refusal;
  }
  p.of<F>().boxes = std::move(boxes);
  p.of<F>().box_list = list;
  return {};
}

ParameterKind boxesKind() {
  ParameterKind kind{"a list of groups {frame: base_link, min: [x, y, z], max: [x, y, z]}"};
  kind.set = setBoxes;
  kind.get = [](const P& p) { return p.of<F>().box_list; };
  return kind;
}

}  // namespace

std::vector<ParameterDeclaration> SelfFilterStep::declare() {
  return {
      {"self_filter/boxes", "m", boxesKind(),
       "Boxes on the robot, each fixed in a frame. Points in them are ignored."},
      {"self_filter/robot_description", "",
       text("a parameter, a .urdf file, or empty", &F::robot_description),
       "Name of a parameter with a URDF, such as robot_description, or of a .urdf file. Points in "
       "the collision shapes of its links neither mark nor clear. It is read at the start. Empty: "
       "none."},
      {"self_filter/padding", "m", number(&F::padding_m, 0.0, 1.0),
       "Enlarges the URDF shapes by this margin. Boxes keep their size."},
      {"self_filter/ignored_links", "", text("names of links", &F::ignored_links),
       "Names of URDF links to ignore, separated by spaces, such as links without a transform."},
      {"self_filter/keep_free", "", boolean(&F::keep_free),
       "true: each cloud, from the first one on, also frees the voxels whose centre lies in the "
       "robot, as a passing beam does, even if they were marked before. Here the shapes have no "
       "padding."},
  };
}

}  // namespace cuboid_mapping_ros
