// SPDX-License-Identifier: BSD-3-Clause
// Follows the map of the node and asks for a corridor, without a service call.
#include <cuboid_mapping/query/corridor_query.h>
#include <cuboid_mapping/ros/cuboid_map_client.h>
#include <ros/ros.h>

using namespace cuboid_mapping;

int main(int argc, char** argv) {
  ros::init(argc, argv, "follow_map");
  const cuboid_mapping_ros::CuboidMapClient client;
  if (!client.waitForMap(ros::WallDuration(30.0))) return 1;

  CorridorTask task;
  task.start_map = {0.5, 0.5, 0.5};
  task.goal_map = {3.5, 0.5, 0.5};
  task.size_m = {0.5, 0.5, 0.5};
  const Corridor corridor =
      client.read([&](const CuboidMap& map) { return findCorridor(map, task); });
  for (const Eigen::Vector3d& point : corridor.path_map) ROS_INFO_STREAM(point.transpose());
  const bool is_found = corridor.end == CorridorEnd::kFound;
  if (!is_found)
    ROS_WARN_STREAM("no corridor in known free space from " << task.start_map.transpose() << " to "
                                                            << task.goal_map.transpose());
  return is_found ? 0 : 2;
}
