// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/services/map_in_frame.h"

#include <ros/node_handle.h>
#include <ros/service_server.h>

#include <vector>

namespace cuboid_mapping_ros {

/// Offers the services for planners: ~query_box, ~check_boxes, ~check_path, ~check_poses, ~cast_rays, ~nearest,
/// ~nearest_free, ~get_cuboids, ~get_free_graph, ~get_distances, ~get_frontiers, ~find_corridor. They are answered from the queue of the node handle.
/// @param map  Must outlive the servers.
[[nodiscard]] std::vector<ros::ServiceServer> advertisePlannerServices(ros::NodeHandle nh,
                                                                       const MapInFrame& map);

}  // namespace cuboid_mapping_ros
