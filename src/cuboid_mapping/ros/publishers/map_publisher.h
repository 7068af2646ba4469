// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/map_messages.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/ros/publishers/map_image_server.h"

#include <string>

namespace cuboid_mapping_ros {

/// The topics cuboid_map and cuboid_map_updates, and the service ~get_map.
///
/// A subscriber of cuboid_map gets the map when it connects, again when the map was
/// replaced as a whole, and as keyframes; see MapImageServer. Updates have the changes since the previous one; see
/// msg/CuboidMapUpdate.msg. Nothing is built without subscribers.
/// Thread rule: all calls one after the other. Images have a thread of their own.
class MapPublisher {
 public:
  /// @param map  Must outlive this object.
  MapPublisher(ros::NodeHandle nh, const ros::NodeHandle& private_nh,
               const NodeParameters& parameters, GuardedMap& map);
  MapPublisher(const MapPublisher&) = delete;
  MapPublisher& operator=(const MapPublisher&) = delete;

  /// Puts waiting cuboids into the R-tree, and publishes the changes since the last call; without any, an
  /// empty message.
  /// @return The changes, for other publishers. If it throws, the next call tells the subscribers to
  /// fetch the map again.
  ChangeSet publish();

 private:
  // Called from the thread of the images.
  [[nodiscard]] ImageMessage makeImage(MapDetail detail) const;
  /// Text about the part of the map that is on disk only; empty: none.
  [[nodiscard]] std::string describeLeftOut() const;

  GuardedMap& map_;
  std::string server_;  ///< Namespace of the services.
  std::string frame_id_;
  MapDetail detail_;  ///< Detail of the topics.
  std::uint64_t instance_;
  std::uint64_t published_revision_ = 0;
  ros::Publisher delta_publisher_;
  MapImageServer images_;
};

}  // namespace cuboid_mapping_ros
