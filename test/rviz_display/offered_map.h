// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/map_messages.h"
#include "cuboid_mapping/sharing/map_follower.h"

#include <ros/node_handle.h>

#include <string>

namespace cuboid_mapping_rviz::test {

/// Offers the topic cuboid_map of a namespace, to whoever listens.
inline ros::Publisher offer(ros::NodeHandle& nh, const cuboid_mapping::CuboidMap& map,
                            const std::string& frame_id) {
  cuboid_mapping_ros::ImageMessage message;
  message.image = makeImage(map, 1, cuboid_mapping::MapDetail::kClasses);
  message.image.label.frame_id = frame_id;
  ros::Publisher publisher = nh.advertise<cuboid_mapping::FullCuboidMap>("cuboid_map", 1, true);
  publisher.publish(cuboid_mapping_ros::toMessage(message));
  return publisher;
}

}  // namespace cuboid_mapping_rviz::test
