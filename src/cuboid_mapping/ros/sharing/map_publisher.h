// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/FullCuboidMap.h"
#include "cuboid_mapping/GetMap.h"
#include "cuboid_mapping/ros/conversions/map_messages.h"
#include "cuboid_mapping/ros/mapping/map_feature.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "cuboid_mapping/ros/middleware/latched_topic.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/node_handle.h>
#include <ros/service_server.h>
#include <ros/time.h>

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
/// A new connection gets the first part of the map, and asks the service for the others. Keyframes send all
/// parts to all subscribers, one after the other: after changes, a period apart, and for at most 5 % of the
/// time. An image is kept for clients that ask at about the same time, until updates go beyond it, and while a
/// client fetches its parts: at most kKept images, each for kKeptFor_s after the last call.
/// It works in the queue of its handles, for which one thread is right: neither publishing nor queries should
/// wait for an image. The public functions are thread-safe.
class MapImageServer {
 public:
  using Make = std::function<ImageMessage(MapDetail)>;
  using Note = std::function<std::string()>;

  static constexpr std::size_t kKept = 2;
  static constexpr double kKeptFor_s = 60.0;
  static constexpr std::size_t kMaxPartBytes = 250000000;

  struct Options {
    MapDetail topic_detail = MapDetail::kClasses;
    std::size_t max_part_bytes = kMaxPartBytes;  ///< Size of a part before it is deflated.
    double keyframe_period_s = 0.0;              ///< Period of keyframes; 0: none.
  };

  /// @param nh, private_nh  Namespaces of the topic, and of the service. @param make  Makes an image of the
  ///                        current map.
  /// @param note  Returns a note on the map for callers of ~get_map; empty: none.
  MapImageServer(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                 const Options& options, Make make, Note note);
  MapImageServer(const MapImageServer&) = delete;
  MapImageServer& operator=(const MapImageServer&) = delete;

  /// @param revision  Revision of the updates: followers need an image that is no older.
  void noteUpdate(std::uint64_t revision) { updated_revision_ = revision; }
  /// Sends the map to all subscribers soon, since it was replaced.
  void publishSoon() { is_publish_due_ = true; }

 private:
  using Message = FullCuboidMap;
  struct Kept {
    MapDetail detail;
    std::vector<Message> parts;
    ros::SteadyTime used;
    ros::SteadyTime good_until;  ///< Later for an image that took longer to make.
    [[nodiscard]] std::uint64_t revision() const { return parts.front().revision; }
  };

  void onTimer();
  [[nodiscard]] bool isKeyframeDue() const;
  /// An image of this detail that followers can use; made if necessary.
  Kept& current(MapDetail detail);
  [[nodiscard]] std::vector<Message> makeParts(const ImageMessage& whole) const;
  void answer(const GetMap::Request& request, GetMap::Response& response);
  void forgetOld();
  /// Null if it is not kept.
  Kept* find(MapDetail detail, std::uint64_t revision);

  Options options_;
  Make make_;
  Note note_;
  std::deque<Kept> kept_;  ///< Kept images, the newest last.
  std::atomic<std::uint64_t> updated_revision_{0};
  std::atomic<bool> is_publish_due_{false};
  std::deque<Message> outgoing_;         ///< Unsent parts of a keyframe.
  std::uint64_t keyframe_revision_ = 0;  ///< Revision of the last keyframe.
  ros::SteadyTime next_keyframe_;        ///< Earliest time of the next one.
  ros::ServiceServer server_;
  std::optional<LatchedTopic<Message>> topic_;
  Timer timer_;
};

/// The topics cuboid_map and cuboid_map_updates, and the service ~get_map.
///
/// A subscriber of cuboid_map gets the map when it connects, again when the map was
/// replaced as a whole, and as keyframes; see MapImageServer. Updates have the changes since the previous one;
/// see msg/CuboidMapUpdate.msg. Nothing is built without subscribers.
/// Images are made in the queue for slow work.
class MapPublisher : public MapFeature {
 public:
  explicit MapPublisher(const MapHost& host);
  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  [[nodiscard]] std::string name() const override;
  /// Reads the changed bricks.
  void onChanges(const MapChanges& changes) override;
  /// Publishes them; without any, an empty message.
  void publish() override;

 private:
  // makeImage() and describeLeftOut() are called from the thread of the images.
  [[nodiscard]] ImageMessage makeImage(MapDetail detail) const;
  [[nodiscard]] MapLabel label(const ros::Time& stamp) const;
  /// Text about the part of the map that is on disk only; empty: none.
  [[nodiscard]] std::string describeLeftOut() const;

  GuardedMap& map_;
  std::string server_;  ///< Namespace of the services.
  std::string frame_id_;
  MapDetail detail_;  ///< Detail of the topics.
  std::uint64_t published_revision_ = 0;
  DeltaMessage message_;  ///< The next update.
  ros::Publisher delta_publisher_;
  MapImageServer images_;
};

}  // namespace cuboid_mapping_ros
