// SPDX-License-Identifier: BSD-3-Clause
// Follows the map of the node and asks for a corridor, without a service call.
#include <cuboid_mapping/query/box_query.h>
#include <cuboid_mapping/query/corridor_query.h>
#include <cuboid_mapping/query/path_query.h>
#include <cuboid_mapping/ros/cuboid_map_client.h>
#include <ros/ros.h>

#include <string>

using namespace cuboid_mapping;

namespace {

/// Reason why there is no corridor.
std::string explain(const CuboidMap& map, const CorridorTask& task,
                    const Answer<Corridor>& corridor) {
  if (!corridor.isNotFound()) return corridor.fault;
  const Blocked blocked = corridor.value.blocked;
  if (blocked == Blocked::kBetween) return "known free space does not connect start and goal";
  const bool is_start = blocked == Blocked::kStart;
  const Eigen::Vector3d& place = is_start ? task.start_map : task.goal_map;
  const auto content = queryBox(map, boxAround(place, task.size_m), Budget::unlimited());
  return std::string(is_start ? "start" : "goal") + " is " + toString(content->occupancy());
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "follow_map");
  const cuboid_mapping_ros::CuboidMapClient client;
  if (!client.waitForMap(ros::WallDuration(30.0))) return 1;

  CorridorTask task;
  task.start_map = {0.5, 0.5, 0.5};
  task.goal_map = {3.5, 0.5, 0.5};
  task.size_m = {0.5, 0.5, 0.5};
  return client.read([&](const CuboidMap& map) {
    const auto corridor = findCorridor(map, task, UnknownPolicy::kObstacle, Budget::unlimited());
    for (const auto& point : corridor.value.path_map) ROS_INFO_STREAM(point.transpose());
    if (corridor.isFound()) return 0;
    ROS_WARN_STREAM("no corridor from " << task.start_map.transpose() << " to "
                                        << task.goal_map.transpose() << ": "
                                        << explain(map, task, corridor));
    return 2;
  });
}
