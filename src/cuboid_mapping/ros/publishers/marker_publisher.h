// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/publishers/marker_cache.h"

#include <ros/duration.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/single_subscriber_publisher.h>
#include <ros/time.h>
#include <std_msgs/Header.h>

#include <mutex>
#include <optional>
#include <string>

namespace cuboid_mapping_ros {

/// What a listener that comes late gets.
enum class LateListener : unsigned char {
  kGetsPictureAtOnce,  ///< The markers as they are: a latched topic.
  kGetsPictureLater    ///< The whole picture, with the next message on the topic.
};

/// A topic of markers.
struct MarkerTopic {
  std::string name;
  std::string frame_id;  ///< Of the map.
  LateListener late_listener = LateListener::kGetsPictureAtOnce;
  double picture_period_s = 0.0;  ///< See MarkerPublisher; 0: never.
  MarkerStyle style;
};

/// A topic of markers (visualization_msgs/MarkerArray) that carries differences, see MarkerCache.
///
/// The topic is not latched by ROS: it would hand the last difference to a listener that comes
/// late, which is wrong without all those before it. Instead every new listener is sent the whole
/// picture, alone, when it connects; the others notice nothing. While nobody listens nothing is
/// built and nothing is kept.
///
/// A listener that is more than kQueueSize messages behind loses some. All are therefore sent the whole
/// picture again kNumPictures times after the last difference, each a period after the one before.
/// The map is held while cuboids are read from it, not while messages are made of them.
/// Thread rule: all calls but setColors(), and the callbacks of the node handle's queue, one after the other.
class MarkerPublisher {
 public:
  static constexpr std::uint32_t kQueueSize = 50;
  static constexpr int kNumPictures = 3;

  /// @param map  Must outlive this object.
  MarkerPublisher(ros::NodeHandle nh, const MarkerTopic& topic, const GuardedMap& map);
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

  const GuardedMap& map_;
  LateListener late_listener_;
  MarkerCache cache_;
  std_msgs::Header header_;
  std::mutex pending_mutex_;
  std::optional<Colors> pending_;  ///< To be taken by publish().
  int num_listeners_ = 0;          ///< That onConnect has seen.
  bool is_picture_due_ = false;
  ros::WallDuration picture_period_;
  ros::WallTime last_picture_;
  int num_pictures_left_ = 0;  ///< To be sent for those who have lost differences.
  ros::Publisher publisher_;   ///< Last: its callbacks end before the rest goes.
};

}  // namespace cuboid_mapping_ros
