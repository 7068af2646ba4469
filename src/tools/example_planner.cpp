// SPDX-License-Identifier: BSD-3-Clause
// An example of a planner, made from installed parts of the package: follows the map of the mapping node, and
// searches a corridor from the robot to the goal clicked in rviz, again after each change of the map.
#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/ros/cuboid_map_client.h"

#include <geometry_msgs/PoseStamped.h>
#include <nav_msgs/Path.h>
#include <ros/ros.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/transform_listener.h>
#include <visualization_msgs/MarkerArray.h>

#include <atomic>
#include <iostream>
#include <optional>
#include <string>

namespace {

using cuboid_mapping::Answer;
using cuboid_mapping::AnswerStatus;
using cuboid_mapping::Blocked;
using cuboid_mapping::Budget;
using cuboid_mapping::CellBox;
using cuboid_mapping::Corridor;
using cuboid_mapping::CorridorTask;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::Grid;
using cuboid_mapping::MetricBox;
using cuboid_mapping::QueryLimits;
using cuboid_mapping::UnknownPolicy;
using visualization_msgs::Marker;
using visualization_msgs::MarkerArray;

constexpr const char* kUsage =
    "Usage: example_planner [_PARAMETER:=VALUE]...\n\n"
    "Keeps a corridor from the robot to the goal clicked in rviz while the map changes; see "
    "planner.launch.\n\n"
    "  _size_x, _size_y, _size_z   edges of the robot's box in metres (default 0.5)\n"
    "  _height                     height of its centre in the map in metres (default 0.6)\n"
    "  _time_limit                 time limit of a search in seconds (default 0.5)\n"
    "  _unknown_passes             true: unknown space is free (default false)\n"
    "  _robot_frame                frame of the robot (default base_link)\n"
    "  _server                     name of the mapping node (default cuboid_mapping)\n";

/// Meaning of the result of a search, with advice.
const char* explain(const Answer<Corridor>& corridor) {
  switch (corridor.status) {
    case AnswerStatus::kFound: return "FOUND: there is a way to the goal";
    case AnswerStatus::kInvalid:
      return "INVALID: the robot's size or the goal is invalid; check size_x, size_y, size_z and "
             "the goal";
    case AnswerStatus::kBudgetSpent:
      return "TIME_LIMIT: the search took too long; there may be a way, so raise time_limit";
    case AnswerStatus::kNotFound: break;
  }
  switch (corridor.value.blocked) {
    case Blocked::kStart:
      return "START_BLOCKED: the robot's box touches an obstacle or unknown space where it stands; "
             "the planner waits until the map is free there";
    case Blocked::kGoal:
      return "GOAL_BLOCKED: there is an obstacle or unknown space at the goal; choose another "
             "goal, or drive to a place from which the robot can see it";
    case Blocked::kBetween: break;
  }
  return "NO_WAY: there is no way through free space at the moment; the planner waits until the "
         "map "
         "changes";
}

/// A translucent box, or the ball in it.
Marker makeMarker(const std::string& ns, int type, const Eigen::Vector3d& center,
                  const Eigen::Vector3d& size_m, const std_msgs::ColorRGBA& color) {
  Marker marker;
  marker.ns = ns;
  marker.type = type;
  marker.pose.position = tf2::toMsg(center);
  marker.pose.orientation.w = 1.0;
  tf2::toMsg(size_m, marker.scale);
  marker.color = color;
  return marker;
}

std_msgs::ColorRGBA makeColor(float r, float g, float b, float a) {
  std_msgs::ColorRGBA color;
  color.r = r;
  color.g = g;
  color.b = b;
  color.a = a;
  return color;
}

class ExamplePlanner {
 public:
  ExamplePlanner()
      : size_m_(private_nh_.param("size_x", 0.5), private_nh_.param("size_y", 0.5),
                private_nh_.param("size_z", 0.5)),
        height_m_(private_nh_.param("height", 0.6)),
        time_limit_s_(private_nh_.param("time_limit", 0.5)),
        policy_(private_nh_.param("unknown_passes", false) ? UnknownPolicy::kFree
                                                           : UnknownPolicy::kObstacle),
        robot_frame_(private_nh_.param<std::string>("robot_frame", "base_link")),
        client_(nh_, private_nh_.param<std::string>("server", "cuboid_mapping"),
                [this](const cuboid_mapping::ChangeSet& /*changes*/) { is_map_new_ = true; }) {
    path_publisher_ = nh_.advertise<nav_msgs::Path>("path", 1, true);
    corridor_publisher_ = nh_.advertise<MarkerArray>("corridor", 1, true);
    goal_subscriber_ = nh_.subscribe("move_base_simple/goal", 1, &ExamplePlanner::onGoal, this);
    timer_ = nh_.createWallTimer(ros::WallDuration(0.1), &ExamplePlanner::onTimer, this);
  }

 private:
  void onGoal(const geometry_msgs::PoseStamped& goal) {
    Eigen::Vector3d position;
    tf2::fromMsg(goal.pose.position, position);
    if (!position.allFinite()) {
      ROS_ERROR("goal ignored: its position is not finite; the previous goal stays");
      return;
    }
    clicked_goal_ = goal;
    is_map_new_ = true;
  }

  void onTimer(const ros::WallTimerEvent& /*event*/) {
    if (!clicked_goal_ || !client_.hasMap() || !is_map_new_.exchange(false)) return;
    const auto T_map_robot = lookup(robot_frame_);
    const auto T_map_goal = lookup(clicked_goal_->header.frame_id);
    if (!T_map_robot || !T_map_goal) {
      is_map_new_ = true;  // Tries again at the next call of the timer.
      return;
    }
    Eigen::Vector3d goal;
    tf2::fromMsg(clicked_goal_->pose.position, goal);
    goal = *T_map_goal * goal;
    Eigen::Vector3d start = T_map_robot->translation();
    start.z() = goal.z() = height_m_;
    const auto corridor =
        client_.read([&](const CuboidMap& map) { return plan(map, start, goal); });
    tell(corridor);
    show(corridor.value, corridor.isFound(), start, goal);
  }

  /// The latest pose of a frame in the map; identity if it has no name.
  std::optional<Eigen::Isometry3d> lookup(const std::string& frame_id) const {
    const std::string map_frame = client_.frameId();
    if (frame_id.empty() || frame_id == map_frame) return Eigen::Isometry3d::Identity();
    try {
      return tf2::transformToEigen(tf_buffer_.lookupTransform(map_frame, frame_id, ros::Time()));
    } catch (const tf2::TransformException& exception) {
      ROS_WARN_THROTTLE(5.0, "no transform '%s' -> '%s': %s", frame_id.c_str(), map_frame.c_str(),
                        exception.what());
      return std::nullopt;
    }
  }

  /// Plans out of obstacles that the robot touches, and to the reachable place nearest to the goal.
  Answer<Corridor> plan(const CuboidMap& map, const Eigen::Vector3d& start,
                        const Eigen::Vector3d& goal) const {
    Budget budget(QueryLimits{time_limit_s_});
    CorridorTask task;
    task.start_map = start;
    task.goal_map = goal;
    task.size_m = size_m_;
    task.clearance_m = 0.5 * size_m_.x();
    task.start_tolerance_m = task.goal_tolerance_m = 1.0;
    task.region = floorAround(map, task);
    return findCorridor(map, task, policy_, budget);
  }

  /// The map at the height of start and goal: the robot does not fly.
  std::optional<CellBox> floorAround(const CuboidMap& map, const CorridorTask& task) const {
    MetricBox region = map.grid().toMetricBox(map.bounds().value_or(CellBox::ofCell({})));
    for (const Eigen::Vector3d& place : {task.start_map, task.goal_map}) {
      region.min_m = region.min_m.cwiseMin(place - size_m_);
      region.max_m = region.max_m.cwiseMax(place + size_m_);
    }
    region.min_m.z() = std::min(task.start_map.z(), task.goal_map.z()) - size_m_.z();
    region.max_m.z() = std::max(task.start_map.z(), task.goal_map.z()) + size_m_.z();
    return map.grid().toCellBox(region);
  }

  /// Logs the result, if it is new.
  void tell(const Answer<Corridor>& corridor) {
    const char* text = explain(corridor);
    if (text == last_text_) return;
    last_text_ = text;
    if (corridor.isFound()) {
      ROS_INFO("%s, %.1f m through %zu boxes", text, corridor->length_m, corridor->boxes.size());
    } else {
      ROS_WARN("%s", text);
    }
  }

  void show(const Corridor& corridor, bool is_found, const Eigen::Vector3d& start,
            const Eigen::Vector3d& goal) {
    std_msgs::Header header;
    header.frame_id = client_.frameId();
    header.stamp = ros::Time::now();
    nav_msgs::Path path;
    path.header = header;
    for (const Eigen::Vector3d& point : corridor.path_map) {
      path.poses.emplace_back();
      path.poses.back().header = header;
      path.poses.back().pose.position = tf2::toMsg(point);
      path.poses.back().pose.orientation.w = 1.0;
    }
    path_publisher_.publish(path);

    const Grid grid(client_.read([](const CuboidMap& map) { return map.grid().resolution(); }));
    MarkerArray array;
    array.markers.emplace_back();
    array.markers.back().action = Marker::DELETEALL;
    for (const CellBox& box : corridor.boxes) {
      const MetricBox box_map = grid.toMetricBox(box);
      array.markers.push_back(makeMarker("corridor", Marker::CUBE, grid.centerOf(box),
                                         box_map.max_m - box_map.min_m,
                                         makeColor(0.0F, 0.8F, 1.0F, 0.4F)));
    }
    array.markers.push_back(
        makeMarker("robot", Marker::CUBE, start, size_m_, makeColor(1.0F, 0.85F, 0.1F, 0.9F)));
    array.markers.push_back(makeMarker(
        "goal", Marker::SPHERE, goal, size_m_,
        is_found ? makeColor(0.2F, 0.9F, 0.2F, 0.9F) : makeColor(0.9F, 0.1F, 0.1F, 0.9F)));
    for (std::size_t i = 0; i < array.markers.size(); ++i) {
      array.markers[i].header = header;
      array.markers[i].id = static_cast<int>(i);
    }
    corridor_publisher_.publish(array);
  }

  ros::NodeHandle nh_;
  ros::NodeHandle private_nh_{"~"};
  Eigen::Vector3d size_m_;  ///< Edges of the robot's box.
  double height_m_;         ///< Height of its centre.
  double time_limit_s_;
  UnknownPolicy policy_;
  std::string robot_frame_;
  std::optional<geometry_msgs::PoseStamped> clicked_goal_;
  const char* last_text_ = nullptr;  ///< Last result that was logged.
  std::atomic<bool> is_map_new_{false};
  tf2_ros::Buffer tf_buffer_;
  tf2_ros::TransformListener tf_listener_{tf_buffer_};
  ros::Publisher path_publisher_;
  ros::Publisher corridor_publisher_;
  ros::Subscriber goal_subscriber_;
  ros::WallTimer timer_;
  /// Last member: its thread ends before others are destroyed.
  cuboid_mapping_ros::CuboidMapClient client_;
};

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "example_planner");
  if (argc > 1) {
    std::cout << kUsage;
    return argv[1] == std::string("--help") ? 0 : 1;
  }
  const ExamplePlanner planner;
  ros::spin();
  return 0;
}
