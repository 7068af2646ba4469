// SPDX-License-Identifier: BSD-3-Clause
// The messages FullCuboidMap and CuboidMapUpdate, and the service GetMap, as images and changes of maps.
#pragma once

#include "cuboid_mapping/map/map_image.h"

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/service_server.h>
#include <ros/subscriber.h>
#include <std_msgs/Header.h>

#include <functional>
#include <string>

namespace cuboid_mapping_ros {

/// An image of a map, with the frame of the map and the stamp of the last cloud in it.
struct ImageMessage {
  std_msgs::Header header;
  cuboid_mapping::MapImage image;
};
/// Changes of a map, with the same.
struct DeltaMessage {
  std_msgs::Header header;
  cuboid_mapping::MapDelta delta;
};

/// Offers a topic of cuboid_mapping/FullCuboidMap: each new listener, alone, is sent an image.
[[nodiscard]] ros::Publisher advertiseImage(ros::NodeHandle& nh, const std::string& topic,
                                            std::function<ImageMessage()> make);
/// Publishes an image to all listeners.
void publishImage(const ros::Publisher& publisher, const ImageMessage& message);

/// Offers a topic of cuboid_mapping/CuboidMapUpdate.
[[nodiscard]] ros::Publisher advertiseDelta(ros::NodeHandle& nh, const std::string& topic);
/// @return Bytes of the message.
std::size_t publishDelta(const ros::Publisher& publisher, const DeltaMessage& message);

/// Offers a service of cuboid_mapping/GetMap.
[[nodiscard]] ros::ServiceServer advertiseGetMap(
    ros::NodeHandle& nh, const std::string& name,
    std::function<ImageMessage(cuboid_mapping::MapDetail)> make);

[[nodiscard]] ros::Subscriber subscribeImage(ros::NodeHandle& nh, const std::string& topic,
                                             std::function<void(const ImageMessage&)> take);
[[nodiscard]] ros::Subscriber subscribeDelta(ros::NodeHandle& nh, const std::string& topic,
                                             std::function<void(const DeltaMessage&)> take);
/// Calls the service GetMap. @param error  Why it gave nothing.
/// @return false when there is no answer, or none with a map.
[[nodiscard]] bool callGetMap(ros::NodeHandle& nh, const std::string& name,
                              cuboid_mapping::MapDetail detail, ImageMessage& message,
                              std::string& error);

}  // namespace cuboid_mapping_ros
