// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/markers/marker_cache.h"
#include "cuboid_mapping/ros/middleware/latched_topic.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/duration.h>
#include <ros/node_handle.h>
#include <ros/time.h>
#include <std_msgs/Header.h>

#include <optional>

namespace cuboid_mapping_ros {

/// The topic occupied_cuboids or free_cuboids (visualization_msgs/MarkerArray), which carries differences, see
/// MarkerCache.
///
/// A new connection gets the whole picture, alone. All subscribers get it as a keyframe: a period apart while
/// differences are sent, and once after the last one. A keyframe repairs the picture of a subscriber that was
/// more than kQueueSize messages behind, or has only the message latched by ROS. Without subscribers nothing is
/// built or kept. Cuboids are read in turns with other users of the map, and messages are made without it: a
/// picture may have changes later than its stamp in some pages, and the next one has them in all.
/// Thread rule: all calls, and the callbacks of the node handle's queue, one after the other.
class MarkerPublisher {
 public:
  /// Queue of messages: each may be as large as the picture, and waits in memory for a subscriber that has
  /// stopped.
  static constexpr std::uint32_t kQueueSize = 4;
  /// Maximum time without changes after messages that took long: a viewer follows the sensor.
  static constexpr double kMaxRest_s = 2.0;

  /// @param filter  kOccupied or kFree. @param map  Must outlive this object.
  MarkerPublisher(const ros::NodeHandle& nh, CuboidFilter filter, const NodeParameters& parameters,
                  const GuardedMap& map);
  MarkerPublisher(const MarkerPublisher&) = delete;
  MarkerPublisher& operator=(const MarkerPublisher&) = delete;

  /// Notes a change; call it for every change of the map, in parts, before publish().
  void noteChanges(const ChangeSet& changes) { cache_.noteChanges(changes); }

  /// Sets other colours for the next publish().
  void setColorSpan(const HeightRange& span) { cache_.setColorSpan(span); }

  [[nodiscard]] bool hasListeners() const { return num_listeners_ > 0; }

  /// Publishes the changes since the last call, if there are any, and subscribers. After messages that took long, later
  /// changes wait for a later call, see endOfRest(); for kMaxRest_s at most.
  void publish();

 private:
  void onConnect(const ros::SingleSubscriberPublisher& listener);
  void onDisconnect();

  void readMap();
  void publishDifference();
  void publishPicture();
  [[nodiscard]] bool isKeyframeDue() const;

  const GuardedMap& map_;
  MarkerCache cache_;
  std_msgs::Header header_;
  int num_listeners_ = 0;       ///< Subscribers that onConnect has seen.
  bool owes_keyframe_ = false;  ///< Differences have been sent since the last picture.
  ros::WallDuration keyframe_period_;
  ros::SteadyTime last_picture_;
  ros::SteadyTime next_;                                 ///< Nothing is published before.
  LatchedTopic<visualization_msgs::MarkerArray> topic_;  ///< Last: its callbacks use the others.
};

}  // namespace cuboid_mapping_ros
