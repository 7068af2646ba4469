// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/query_box.h"

#include <ros/node_handle.h>
#include <ros/service_server.h>
#include <ros/time.h>

#include <functional>
#include <string>

namespace cuboid_mapping_ros {

/// Name and time of the map that the service answers for.
struct MapHeader {
  std::string frame_id;
  ros::Time stamp;  ///< Of the last cloud in the map; 0 when there is none.
};

/// Offers ~query_box (cuboid_mapping/QueryBox), and turns its messages into a BoxRequest and back.
///
/// The messages stay in the source file: the message cuboid_mapping/Cuboid has the name of the
/// core's own type, so that no file can include both.
/// @param answer, header  Called for each request, on the queue of the node handle.
[[nodiscard]] ros::ServiceServer advertiseQueryBox(
    ros::NodeHandle& private_handle, std::function<BoxAnswer(const BoxRequest&)> answer,
    std::function<MapHeader()> header);

}  // namespace cuboid_mapping_ros
