// SPDX-License-Identifier: BSD-3-Clause
// An example of a planner: follows the map of the mapping node, and keeps a corridor from the robot to
// the goal that was clicked in rviz, which is found anew whenever the map has changed.
#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/query/fit_query.h"
#include "cuboid_mapping/ros/cuboid_map_client.h"
#include "cuboid_mapping/ros/request_reader.h"
#include "cuboid_mapping/ros/tf_lookup.h"

#include <geometry_msgs/PoseStamped.h>
#include <nav_msgs/Path.h>
#include <ros/ros.h>
#include <tf2_ros/transform_listener.h>
#include <visualization_msgs/MarkerArray.h>

#include <atomic>
#include <optional>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::Corridor;
using cuboid_mapping::CorridorEnd;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::MetricBox;

class ExamplePlanner {
 public:
  ExamplePlanner()
      : size_m_(private_nh_.param("size_x", 0.5), private_nh_.param("size_y", 0.5),
                private_nh_.param("size_z", 0.5)),
        height_m_(private_nh_.param("height", 0.6)),
        robot_frame_(private_nh_.param<std::string>("robot_frame", "base_link")),
        client_(nh_, private_nh_.param<std::string>("server", "/cuboid_mapping"),
                [this](std::uint64_t /*revision*/) { is_map_new_ = true; }) {
    path_publisher_ = nh_.advertise<nav_msgs::Path>("path", 1, true);
    corridor_publisher_ = nh_.advertise<visualization_msgs::MarkerArray>("corridor", 1, true);
    goal_subscriber_ = nh_.subscribe("/move_base_simple/goal", 1, &ExamplePlanner::onGoal, this);
    timer_ = nh_.createWallTimer(ros::WallDuration(0.1), &ExamplePlanner::onTimer, this);
  }

 private:
  void onGoal(const geometry_msgs::PoseStamped& goal) {
    goal_ = Eigen::Vector3d(goal.pose.position.x, goal.pose.position.y, height_m_);
    is_map_new_ = true;
  }

  void onTimer(const ros::WallTimerEvent& /*event*/) {
    if (!goal_ || !client_.hasMap() || !is_map_new_.exchange(false)) return;
    const TfLookup robot =
        lookupTransform(tf_buffer_, client_.frameId(), robot_frame_, ros::Time());
    if (!robot.T_target_source) {
      ROS_WARN_THROTTLE(5.0, "where is the robot? %s", robot.error.c_str());
      return;
    }
    Eigen::Vector3d start = robot.T_target_source->translation();
    start.z() = height_m_;
    const Corridor corridor =
        client_.read([&](const CuboidMap& map) { return plan(map, start, *goal_); });
    if (corridor.end != CorridorEnd::kFound) ROS_WARN_THROTTLE(1.0, "no way to the goal now");
    show(corridor);
  }

  /// From the places nearest to robot and goal at which the robot's box fits.
  [[nodiscard]] Corridor plan(const CuboidMap& map, const Eigen::Vector3d& start,
                              const Eigen::Vector3d& goal) const {
    constexpr auto kPolicy = cuboid_mapping::UnknownPolicy::kPass;
    cuboid_mapping::CorridorTask task;
    task.start_map = findNearestFit(map, start, size_m_, kPolicy, 1.0).value_or(start);
    task.goal_map = findNearestFit(map, goal, size_m_, kPolicy, 1.0).value_or(goal);
    task.size_m = size_m_;
    task.policy = kPolicy;
    task.time_limit_s = 0.5;
    // On one floor: the robot does not fly.
    MetricBox region =
        map.grid().toMetricBox(map.voxels().bounds().value_or(cuboid_mapping::CellBox::ofCell({})));
    region.min_m =
        region.min_m.cwiseMin(task.start_map - size_m_).cwiseMin(task.goal_map - size_m_);
    region.max_m =
        region.max_m.cwiseMax(task.start_map + size_m_).cwiseMax(task.goal_map + size_m_);
    region.min_m.z() = std::min(task.start_map.z(), task.goal_map.z()) - size_m_.z();
    region.max_m.z() = std::max(task.start_map.z(), task.goal_map.z()) + size_m_.z();
    task.region = map.grid().toCellBox(region);
    return findCorridor(map, task);
  }

  void show(const Corridor& corridor) {
    nav_msgs::Path path;
    path.header.frame_id = client_.frameId();
    path.header.stamp = ros::Time::now();
    for (const Eigen::Vector3d& point : corridor.path_map) {
      path.poses.emplace_back();
      path.poses.back().header = path.header;
      path.poses.back().pose.position = toPoint(point);
      path.poses.back().pose.orientation.w = 1.0;
    }
    path_publisher_.publish(path);

    visualization_msgs::MarkerArray markers;
    markers.markers.resize(1);
    markers.markers[0].action = visualization_msgs::Marker::DELETEALL;
    const double resolution_m =
        client_.read([](const CuboidMap& map) { return map.grid().resolution(); });
    const cuboid_mapping::Grid grid(resolution_m);
    for (const cuboid_mapping::CellBox& box : corridor.boxes) {
      visualization_msgs::Marker marker;
      marker.header = path.header;
      marker.id = static_cast<int>(markers.markers.size());
      marker.type = visualization_msgs::Marker::CUBE;
      const MetricBox box_map = grid.toMetricBox(box);
      marker.pose.position = toPoint(grid.centerOf(box));
      marker.pose.orientation.w = 1.0;
      marker.scale = toVector3(box_map.max_m - box_map.min_m);
      marker.color.g = 0.8F;
      marker.color.b = 1.0F;
      marker.color.a = 0.4F;
      markers.markers.push_back(marker);
    }
    corridor_publisher_.publish(markers);
  }

  ros::NodeHandle nh_;
  ros::NodeHandle private_nh_{"~"};
  Eigen::Vector3d size_m_;  ///< Edges of the robot's box.
  double height_m_;         ///< Of its centre.
  std::string robot_frame_;
  std::optional<Eigen::Vector3d> goal_;
  std::atomic<bool> is_map_new_{false};
  tf2_ros::Buffer tf_buffer_;
  tf2_ros::TransformListener tf_listener_{tf_buffer_};
  ros::Publisher path_publisher_;
  ros::Publisher corridor_publisher_;
  ros::Subscriber goal_subscriber_;
  ros::WallTimer timer_;
  CuboidMapClient client_;  ///< Last: its thread ends before the rest goes.
};

}  // namespace
}  // namespace cuboid_mapping_ros

int main(int argc, char** argv) {
  ros::init(argc, argv, "example_planner");
  const cuboid_mapping_ros::ExamplePlanner planner;
  ros::spin();
  return 0;
}
