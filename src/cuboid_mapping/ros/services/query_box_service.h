// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/services/query_box.h"

#include <ros/node_handle.h>
#include <ros/service_server.h>

#include <functional>
#include <string>

namespace cuboid_mapping_ros {

/// Offers ~query_box (cuboid_mapping/QueryBox), and turns its messages into a BoxRequest and back.
/// @param map_frame_id  Of the answers.
/// @param answer  Called for each request, on the queue of the node handle.
[[nodiscard]] ros::ServiceServer advertiseQueryBox(
    ros::NodeHandle& private_handle, const std::string& map_frame_id,
    std::function<BoxAnswer(const BoxRequest&)> answer);

}  // namespace cuboid_mapping_ros
