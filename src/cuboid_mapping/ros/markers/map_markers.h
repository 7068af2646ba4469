// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/mapping/map_feature.h"
#include "cuboid_mapping/ros/markers/marker_cache.h"
#include "cuboid_mapping/ros/middleware/latched_topic.h"

#include <ros/duration.h>
#include <ros/time.h>
#include <std_msgs/Header.h>

#include <optional>
#include <string>

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
class MarkerTopic {
 public:
  /// Queue of messages: each may be as large as the picture, and waits in memory for a subscriber that has
  /// stopped.
  static constexpr std::uint32_t kQueueSize = 4;
  /// Maximum time without changes after messages that took long: a viewer follows the sensor.
  static constexpr double kMaxRest_s = 2.0;

  /// @param filter  kOccupied or kFree. @param map  Must outlive this object.
  MarkerTopic(const ros::NodeHandle& nh, CuboidFilter filter, const NodeParameters& parameters,
              const GuardedMap& map);
  MarkerTopic(const MarkerTopic&) = delete;
  MarkerTopic& operator=(const MarkerTopic&) = delete;

  /// Notes a change; call it for every change of the map, in parts, before publish().
  void noteChanges(const ChangeSet& changes);

  /// Publishes the changes since the last call, if there are any, and subscribers. After messages that took long, later
  /// changes wait for a later call, see endOfRest(); for kMaxRest_s at most.
  void publish();

 private:
  void onConnect(const ros::SingleSubscriberPublisher& listener);
  void onDisconnect();

  void readMap();
  /// Fits the colours of heights to the map if it has grown enough.
  void updateColorSpan();
  void publishDifference();
  void publishPicture();
  [[nodiscard]] bool isKeyframeDue() const;

  const GuardedMap& map_;
  MarkerCache cache_;
  bool has_colors_;
  bool is_span_old_;                       ///< The map has changed since the span was found.
  std::optional<HeightRange> color_span_;  ///< Current span.
  std_msgs::Header header_;
  int num_listeners_ = 0;       ///< Subscribers that onConnect has seen.
  bool owes_keyframe_ = false;  ///< Differences have been sent since the last picture.
  ros::WallDuration keyframe_period_;
  ros::SteadyTime last_picture_;
  ros::SteadyTime next_;                                 ///< Nothing is published before.
  LatchedTopic<visualization_msgs::MarkerArray> topic_;  ///< Last: its callbacks use the others.
};

/// The topics occupied_cuboids and free_cuboids.
class MapMarkers : public MapFeature {
 public:
  explicit MapMarkers(const MapHost& host)
      : occupied_(host.nh, CuboidFilter::kOccupied, host.parameters, host.map),
        free_(host.nh, CuboidFilter::kFree, host.parameters, host.map) {}
  [[nodiscard]] std::string name() const override { return "markers"; }
  void onChanges(const MapChanges& changes) override {
    occupied_.noteChanges(changes.changed);
    free_.noteChanges(changes.changed);
  }
  void publish() override {
    occupied_.publish();
    free_.publish();
  }

 private:
  MarkerTopic occupied_;
  MarkerTopic free_;
};

}  // namespace cuboid_mapping_ros
