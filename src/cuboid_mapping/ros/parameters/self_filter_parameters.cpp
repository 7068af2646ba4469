// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"
#include "cuboid_mapping/ros/parameters/robot_parts.h"

#include <utility>

namespace cuboid_mapping_ros {
namespace {

using P = NodeParameters;
using XmlRpc::XmlRpcValue;

/// Why a text is no box, and nothing else.
struct BadBox {
  std::string why;
};

Eigen::Vector3d readCorner(const XmlRpcValue& group, const std::string& key) {
  const BadBox bad{"needs " + key + ": [x, y, z]"};
  if (!group.hasMember(key)) throw bad;
  XmlRpcValue list = group[key];
  if (list.getType() != XmlRpcValue::TypeArray || list.size() != 3) throw bad;
  Eigen::Vector3d corner;
  for (int axis = 0; axis < 3; ++axis) {
    if (list[axis].getType() == XmlRpcValue::TypeInt) {
      corner[axis] = static_cast<int&>(list[axis]);
    } else if (list[axis].getType() == XmlRpcValue::TypeDouble) {
      corner[axis] = static_cast<double&>(list[axis]);
    } else {
      throw bad;
    }
  }
  return corner;
}

RobotPart readBox(const XmlRpcValue& group) {
  if (group.getType() != XmlRpcValue::TypeStruct) throw BadBox{"is no group of keys"};
  for (const auto& [key, value] : group) {
    if (key != "frame" && key != "min" && key != "max") throw BadBox{"has an unknown key " + key};
  }
  XmlRpcValue frame = group.hasMember("frame") ? group["frame"] : XmlRpcValue();
  if (frame.getType() != XmlRpcValue::TypeString ||
      withoutSlash(static_cast<std::string&>(frame)).empty()) {
    throw BadBox{"needs a frame"};
  }
  const cuboid_mapping::MetricBox box{readCorner(group, "min"), readCorner(group, "max")};
  if (!(box.min_m.array() < box.max_m.array()).all() || !box.min_m.allFinite() ||
      !box.max_m.allFinite()) {
    throw BadBox{"needs a min that is less than its max along each axis"};
  }
  return makeBoxPart(withoutSlash(static_cast<std::string&>(frame)), box);
}

std::string setBoxes(P& p, const XmlRpcValue& list) {
  if (list.getType() != XmlRpcValue::TypeArray) return "begin each box with a dash";
  RobotParts boxes;
  for (int i = 0; i < list.size(); ++i) {
    try {
      boxes.push_back(readBox(list[i]));
    } catch (const BadBox& bad) {
      return "box " + std::to_string(i) + ' ' + bad.why;
    }
  }
  p.self_filter.boxes = std::move(boxes);
  p.self_filter.box_list = list;
  return {};
}

std::string toText(const Eigen::Vector3d& corner) {
  return '[' + formatNumber(corner.x()) + ", " + formatNumber(corner.y()) + ", " +
         formatNumber(corner.z()) + ']';
}

std::string describeBoxes(const P& p) {
  std::string text;
  for (const RobotPart& part : p.self_filter.boxes) {
    text += (text.empty() ? "{frame: " : ", {frame: ") + part.frame_id +
            ", min: " + toText(part.exact.bounds.min_m) +
            ", max: " + toText(part.exact.bounds.max_m) + '}';
  }
  return '[' + text + ']';
}

ListKind boxesKind() {
  return {"a list of groups {frame: base_link, min: [x, y, z], max: [x, y, z]}", setBoxes,
          [](const P& p) { return p.self_filter.box_list; }, describeBoxes};
}

/// A text of any content.
TextKind textKind(const std::string& allowed, bool (*set)(P&, const std::string&),
                  std::string (*get)(const P&)) {
  return {allowed, set, get};
}

}  // namespace

std::vector<ParameterDeclaration> declareSelfFilter() {
  return {
      {"self_filter/boxes", "m", boxesKind(),
       "Boxes that belong to the robot, each fixed in a frame: points in them neither mark nor "
       "clear."},
      {"self_filter/robot_description", "",
       textKind(
           "a parameter, or empty",
           [](P& p, const std::string& text) {
             p.self_filter.robot_description = text;
             return true;
           },
           [](const P& p) { return p.self_filter.robot_description; }),
       "Name of a parameter with a URDF, such as robot_description: points in the collision shapes "
       "of its links "
       "neither mark nor clear. Read at the start. Empty: none."},
      {"self_filter/urdf_file", "",
       FileKind{[](P& p) -> std::string& { return p.self_filter.urdf_file; }},
       "A file with a URDF, in place of robot_description: for bag_to_map, which has no parameter "
       "server."},
      {"self_filter/padding", "m",
       NumberKind{[](P& p) -> double& { return p.self_filter.padding_m; }, 0.0, 1.0},
       "By so much the shapes of the URDF are enlarged; boxes are not."},
      {"self_filter/ignored_links", "",
       textKind(
           "names of links",
           [](P& p, const std::string& text) {
             p.self_filter.ignored_links = text;
             return true;
           },
           [](const P& p) { return p.self_filter.ignored_links; }),
       "Links of the URDF that are not looked at, with spaces in between: such as those that have "
       "no transform."},
      {"self_filter/keep_free", "",
       BooleanKind{[](P& p) -> bool& { return p.self_filter.keep_free; }},
       "true: with each cloud, the voxels whose centre lies in the robot are observed as free, as "
       "by a beam. "
       "Without padding."},
  };
}

}  // namespace cuboid_mapping_ros
