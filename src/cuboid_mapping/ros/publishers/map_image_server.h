// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/FullCuboidMap.h"
#include "cuboid_mapping/GetMap.h"
#include "cuboid_mapping/ros/conversions/map_messages.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/publishers/latched_topic.h"

#include <ros/node_handle.h>
#include <ros/service_server.h>
#include <ros/time.h>
#include <ros/wall_timer.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// The topic cuboid_map and the service ~get_map: whole maps, in parts that fit into messages.
///
/// A new connection is sent the first part of the map, and asks the service for the others. Keyframes bring all parts to
/// all listeners, one after the other: after changes, a period apart, and so that they take no more than 5 % of the time.
/// An image is kept for all who ask at about the same time, until updates go beyond it, and while somebody fetches its
/// parts: kKept images at most, each until nobody has asked for kKeptFor_s.
/// Thread rule: it has a thread of its own, so that neither publishing nor queries wait for an image. Calls are thread-safe.
class MapImageServer {
 public:
  using Make = std::function<ImageMessage(cuboid_mapping::MapDetail)>;
  using Note = std::function<std::string()>;

  static constexpr std::size_t kKept = 2;
  static constexpr double kKeptFor_s = 60.0;

  struct Options {
    cuboid_mapping::MapDetail topic_detail = cuboid_mapping::MapDetail::kClasses;
    std::size_t max_part_bytes = 250000000;  ///< Before a part is deflated.
    double keyframe_period_s = 0.0;          ///< 0: no keyframes.
  };

  /// @param nh, private_nh  Of the topic, and of the service. @param make  The whole map as it is now.
  /// @param note  What callers of ~get_map are told of the map, empty for nothing.
  MapImageServer(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh, CallbackGuard& guard,
                 const Options& options, Make make, Note note);
  ~MapImageServer();
  MapImageServer(const MapImageServer&) = delete;
  MapImageServer& operator=(const MapImageServer&) = delete;

  [[nodiscard]] bool hasListeners() const { return topic_->hasListeners(); }
  /// @param revision  That updates have reached: followers need an image that is no older.
  void noteUpdate(std::uint64_t revision) { updated_revision_ = revision; }
  /// Sends the map to all listeners soon: it was replaced.
  void publishSoon() { is_publish_due_ = true; }

 private:
  using Message = cuboid_mapping::FullCuboidMap;
  struct Kept {
    cuboid_mapping::MapDetail detail;
    std::vector<Message> parts;
    ros::WallTime used;
    ros::WallTime good_until;  ///< Longer for one that took longer to make.
    [[nodiscard]] std::uint64_t revision() const { return parts.front().revision; }
  };

  void onTimer();
  [[nodiscard]] bool isKeyframeDue() const;
  /// The image of this detail that followers can use, made if it must be.
  Kept& current(cuboid_mapping::MapDetail detail);
  [[nodiscard]] std::vector<Message> makeParts(const ImageMessage& whole) const;
  void answer(const cuboid_mapping::GetMap::Request& request,
              cuboid_mapping::GetMap::Response& response);
  void forgetOld();
  /// nullptr when it is not kept.
  Kept* find(cuboid_mapping::MapDetail detail, std::uint64_t revision);

  Options options_;
  Make make_;
  Note note_;
  std::deque<Kept> kept_;  ///< The newest last.
  std::atomic<std::uint64_t> updated_revision_{0};
  std::atomic<bool> is_publish_due_{false};
  std::deque<Message> outgoing_;         ///< Parts of a keyframe.
  std::uint64_t keyframe_revision_ = 0;  ///< Revision of the last keyframe.
  ros::WallTime next_keyframe_;          ///< At the earliest.
  GuardedThread thread_;
  ros::ServiceServer server_;
  std::optional<LatchedTopic<Message>> topic_;
  ros::WallTimer timer_;
};

}  // namespace cuboid_mapping_ros
