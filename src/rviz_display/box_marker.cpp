// SPDX-License-Identifier: BSD-3-Clause
#include "box_marker.h"

#include <OgreQuaternion.h>

#include <algorithm>
#include <cmath>

namespace cuboid_mapping_rviz {
namespace {

using visualization_msgs::InteractiveMarker;
using visualization_msgs::InteractiveMarkerControl;
using visualization_msgs::InteractiveMarkerFeedback;
using visualization_msgs::Marker;

constexpr const char* kBoxName = "box";

std::string nameOfSide(int side) { return std::string(1, "xyz"[side / 2]) + "-+"[side % 2]; }

/// Turns x to an axis.
geometry_msgs::Quaternion towards(int axis) {
  geometry_msgs::Quaternion rotation;
  rotation.w = axis == 0 ? 1.0 : std::sqrt(0.5);
  rotation.z = axis == 1 ? std::sqrt(0.5) : 0.0;
  rotation.y = axis == 2 ? -std::sqrt(0.5) : 0.0;
  return rotation;
}

bool isMove(const InteractiveMarkerFeedback& feedback) {
  return feedback.event_type == InteractiveMarkerFeedback::POSE_UPDATE;
}

}  // namespace

geometry_msgs::Point toPoint(const Ogre::Vector3& vector) {
  geometry_msgs::Point point;
  point.x = vector.x;
  point.y = vector.y;
  point.z = vector.z;
  return point;
}

void BoxMarker::show(const std::string& frame_id) {
  frame_id_ = frame_id;
  insertBox();
  for (int side = 0; side < 6; ++side) insertSide(side);
  server_.applyChanges();
}

void BoxMarker::hide() {
  server_.clear();
  server_.applyChanges();
}

InteractiveMarker BoxMarker::makeMarker(const std::string& name, const Ogre::Vector3& at) const {
  InteractiveMarker marker;
  marker.header.frame_id = frame_id_;
  marker.name = name;
  marker.pose.position = toPoint(at);
  marker.pose.orientation.w = 1.0;
  const Ogre::Vector3 size = max_ - min_;
  marker.scale = std::max({size.x, size.y, size.z}) / 3.0F;
  return marker;
}

void BoxMarker::insertBox() {
  InteractiveMarker marker = makeMarker(kBoxName, 0.5F * (min_ + max_));
  marker.description = "clear or lock";
  Marker cube;
  cube.type = Marker::CUBE;
  const Ogre::Vector3 size = max_ - min_;
  cube.scale.x = size.x;
  cube.scale.y = size.y;
  cube.scale.z = size.z;
  cube.color.r = 1.0F;
  cube.color.g = 0.6F;
  cube.color.a = 0.35F;
  InteractiveMarkerControl control;
  control.name = kBoxName;
  control.interaction_mode = InteractiveMarkerControl::MOVE_PLANE;
  control.orientation = towards(2);  // Moves in a horizontal plane.
  control.always_visible = 1;
  control.markers.push_back(cube);
  marker.controls.push_back(control);
  server_.insert(marker, [this](const Feedback& feedback) { moveBox(feedback); });
}

void BoxMarker::insertSide(int side) {
  InteractiveMarker marker = makeMarker(nameOfSide(side), centerOfSide(side));
  InteractiveMarkerControl control;
  control.name = marker.name;
  control.interaction_mode = InteractiveMarkerControl::MOVE_AXIS;
  control.orientation = towards(side / 2);
  control.always_visible = 1;
  Marker handle;
  handle.type = Marker::SPHERE;
  handle.scale.x = handle.scale.y = handle.scale.z = 0.4 * marker.scale;
  handle.color.r = side / 2 == 0 ? 1.0F : 0.2F;
  handle.color.g = side / 2 == 1 ? 1.0F : 0.2F;
  handle.color.b = side / 2 == 2 ? 1.0F : 0.2F;
  handle.color.a = 1.0F;
  control.markers.push_back(handle);
  marker.controls.push_back(control);
  server_.insert(marker, [this, side](const Feedback& feedback) { moveSide(side, feedback); });
}

Ogre::Vector3 BoxMarker::centerOfSide(int side) const {
  Ogre::Vector3 center = 0.5F * (min_ + max_);
  center[static_cast<std::size_t>(side / 2)] =
      (side % 2 == 0 ? min_ : max_)[static_cast<std::size_t>(side / 2)];
  return center;
}

void BoxMarker::moveBox(const Feedback& feedback) {
  if (!isMove(*feedback)) return;
  const auto& at = feedback->pose.position;
  const Ogre::Vector3 half = 0.5F * (max_ - min_);
  const Ogre::Vector3 center(static_cast<float>(at.x), static_cast<float>(at.y),
                             static_cast<float>(at.z));
  min_ = center - half;
  max_ = center + half;
  placeSides();
  server_.applyChanges();
}

void BoxMarker::moveSide(int side, const Feedback& feedback) {
  if (!isMove(*feedback)) return;
  const auto axis = static_cast<std::size_t>(side / 2);
  const auto& at = feedback->pose.position;
  const auto to = static_cast<float>(axis == 0 ? at.x : (axis == 1 ? at.y : at.z));
  if (side % 2 == 0) {
    min_[axis] = std::min(to, max_[axis] - kLeastEdge_m);
  } else {
    max_[axis] = std::max(to, min_[axis] + kLeastEdge_m);
  }
  insertBox();  // The size has changed.
  placeSides();
  server_.applyChanges();
}

void BoxMarker::placeSides() {
  for (int side = 0; side < 6; ++side) {
    geometry_msgs::Pose pose;
    pose.position = toPoint(centerOfSide(side));
    pose.orientation.w = 1.0;
    server_.setPose(nameOfSide(side), pose);
  }
}

}  // namespace cuboid_mapping_rviz
