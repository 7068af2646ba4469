// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/publishers/latched_topic.h"
#include "cuboid_mapping/ros/publishers/marker_cache.h"

#include <ros/duration.h>
#include <ros/node_handle.h>
#include <ros/time.h>
#include <std_msgs/Header.h>

#include <mutex>
#include <optional>
#include <string>

namespace cuboid_mapping_ros {

/// A topic of markers.
struct MarkerTopic {
  std::string name;
  std::string frame_id;    ///< Frame of the map.
  bool is_latched = true;  ///< false: a new listener gets the picture with the next message.
  double keyframe_period_s = 0.0;  ///< 0: no keyframes.
  MarkerStyle style;
};

/// A topic of markers (visualization_msgs/MarkerArray) that carries differences, see MarkerCache.
///
/// A new connection is sent the whole picture, alone. All get it as a keyframe: while differences are sent, a
/// period apart, and once after the last one. So a listener catches up that was more than kQueueSize messages behind, or
/// that has only the message that ROS latches. While nobody listens nothing is built and nothing is kept.
/// The map is held while cuboids are read from it, not while messages are made of them.
/// Thread rule: all calls but setColors(), and the callbacks of the node handle's queue, one after the other.
class MarkerPublisher {
 public:
  /// Each may be as large as the picture, and waits in memory for a listener that has stopped.
  static constexpr std::uint32_t kQueueSize = 4;

  /// @param map  Must outlive this object.
  MarkerPublisher(const ros::NodeHandle& nh, const MarkerTopic& topic, const GuardedMap& map);
  MarkerPublisher(const MarkerPublisher&) = delete;
  MarkerPublisher& operator=(const MarkerPublisher&) = delete;

  /// To be called with every change of the R-tree, some at a time, before publish().
  void noteChanges(const cuboid_mapping::ChangeSet& changes) { cache_.noteChanges(changes); }

  /// Takes other colours, from the next publish() on. Thread-safe.
  void setColors(ColorBy color_by, double color_period_m);

  /// Lets the colours of heights run once over a span; nothing: they repeat. From the next publish()
  /// on.
  void setColorSpan(const std::optional<HeightSpan>& span) { cache_.setColorSpan(span); }

  [[nodiscard]] bool hasListeners() const { return num_listeners_ > 0; }

  /// Publishes what has changed since the last call, if anything has and anybody listens.
  void publish();

 private:
  struct Colors {
    ColorBy color_by;
    double color_period_m;
  };

  void takePendingColors();
  void onConnect(const ros::SingleSubscriberPublisher& listener);
  void onDisconnect();

  void readMap();
  void publishDifference();
  void publishPicture();
  [[nodiscard]] bool isKeyframeDue() const;

  const GuardedMap& map_;
  bool is_latched_;
  MarkerCache cache_;
  std_msgs::Header header_;
  std::mutex pending_mutex_;
  std::optional<Colors> pending_;  ///< To be taken by publish().
  int num_listeners_ = 0;          ///< That onConnect has seen.
  bool is_picture_due_ = false;    ///< In place of the next difference.
  bool owes_keyframe_ = false;     ///< Differences have been sent since the last picture.
  ros::WallDuration keyframe_period_;
  ros::WallTime last_picture_;
  LatchedTopic<visualization_msgs::MarkerArray> topic_;  ///< Last: it calls back.
};

}  // namespace cuboid_mapping_ros
