// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/services/map_in_frame.h"

#include <ros/node_handle.h>
#include <ros/service_server.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <atomic>
#include <functional>
#include <vector>

namespace cuboid_mapping_ros {

/// The services that planners ask: ~query_box, ~check_boxes, ~check_path, ~cast_rays, ~nearest, ~nearest_free,
/// ~get_cuboids, ~get_free_graph, ~find_corridor. Served from the queue of the node handle.
class PlannerServices {
 public:
  /// @param map  What it refers to must outlive this object.
  PlannerServices(const ros::NodeHandle& private_nh, const MapInFrame& map);
  PlannerServices(const PlannerServices&) = delete;
  PlannerServices& operator=(const PlannerServices&) = delete;

 private:
  MapInFrame map_;
  std::vector<ros::ServiceServer> servers_;
};

/// The services that change the map: ~set_box, ~pause. Served from the queue of the node
/// handle.
class EditServices {
 public:
  /// @param map  What it refers to must outlive this object.
  /// @param publish  Called after a change; returns at once. Thread-safe.
  EditServices(const ros::NodeHandle& private_nh, const MapInFrame& map,
               std::function<void()> publish);
  EditServices(const EditServices&) = delete;
  EditServices& operator=(const EditServices&) = delete;

  /// Whether clouds are to be left out. Thread-safe.
  [[nodiscard]] bool isPaused() const { return is_paused_; }

 private:
  bool onPause(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);

  MapInFrame map_;
  std::function<void()> publish_;
  std::atomic<bool> is_paused_{false};
  std::vector<ros::ServiceServer> servers_;
};

}  // namespace cuboid_mapping_ros
