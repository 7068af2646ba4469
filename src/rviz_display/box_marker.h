// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <geometry_msgs/Point.h>
#include <interactive_markers/interactive_marker_server.h>
#include <visualization_msgs/InteractiveMarker.h>
#include <visualization_msgs/InteractiveMarkerFeedback.h>

#include <OgreVector3.h>

#include <string>

namespace cuboid_mapping_rviz {

/// Converts a point to a message.
[[nodiscard]] geometry_msgs::Point toPoint(const Ogre::Vector3& vector);

/// A box that the user moves by interactive markers: a ball moves each side, and the box itself moves as a
/// whole. Its markers are on the topic kTopic + "/update".
///
/// Thread rule: that of rviz, all calls and callbacks in its main thread.
class BoxMarker {
 public:
  static constexpr const char* kTopic = "/cuboid_mapping_box";
  static constexpr float kLeastEdge_m = 0.05F;

  BoxMarker() : server_(kTopic) {}

  /// Shows the box. @param frame_id  Frame of its place, in which it stays.
  void show(const std::string& frame_id);
  void hide();

  [[nodiscard]] const std::string& frameId() const { return frame_id_; }
  [[nodiscard]] const Ogre::Vector3& min() const { return min_; }
  [[nodiscard]] const Ogre::Vector3& max() const { return max_; }

 private:
  using Feedback = visualization_msgs::InteractiveMarkerFeedbackConstPtr;

  void insertBox();
  void insertSide(int side);
  [[nodiscard]] visualization_msgs::InteractiveMarker makeMarker(const std::string& name,
                                                                 const Ogre::Vector3& at) const;
  [[nodiscard]] Ogre::Vector3 centerOfSide(int side) const;
  void moveBox(const Feedback& feedback);
  void moveSide(int side, const Feedback& feedback);
  void placeSides();

  std::string frame_id_;
  Ogre::Vector3 min_{-1.0F};
  Ogre::Vector3 max_{1.0F};
  interactive_markers::InteractiveMarkerServer server_;
};

}  // namespace cuboid_mapping_rviz
