// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/self_filter/self_filter_step.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/self_filter/self_filter.h"

#include <optional>
#include <string>
#include <utility>

namespace cuboid_mapping_ros {

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
  p.self_filter.boxes = std::move(boxes);
  p.self_filter.box_list = list;
  return {};
}

ParameterKind boxesKind() {
  ParameterKind kind{"a list of groups {frame: base_link, min: [x, y, z], max: [x, y, z]}"};
  kind.set = setBoxes;
  kind.get = [](const P& p) { return p.self_filter.box_list; };
  return kind;
}

}  // namespace

std::vector<ParameterDeclaration> SelfFilterStep::declare() {
  return {
      {"self_filter/boxes", "m", boxesKind(),
       "Boxes on the robot, each fixed in a frame. Points in them are ignored."},
      {"self_filter/robot_description", "",
       text("a parameter, a .urdf file, or empty", {&P::self_filter, &F::robot_description}),
       "Name of a parameter with a URDF, such as robot_description, or of a .urdf file. Points in "
       "the collision shapes of its links neither mark nor clear. It is read at the start. Empty: "
       "none."},
      {"self_filter/padding", "m", number({&P::self_filter, &F::padding_m}, 0.0, 1.0),
       "Enlarges the URDF shapes by this margin. Boxes keep their size."},
      {"self_filter/ignored_links", "",
       text("names of links", {&P::self_filter, &F::ignored_links}),
       "Names of URDF links to ignore, separated by spaces, such as links without a transform."},
      {"self_filter/keep_free", "", boolean({&P::self_filter, &F::keep_free}),
       "true: each cloud, from the first one on, also frees the voxels whose centre lies in the "
       "robot, as a passing beam does, even if they were marked before. Here the shapes have no "
       "padding."},
  };
}

}  // namespace cuboid_mapping_ros
