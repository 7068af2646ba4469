// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/simulated_lidar_node.h"

#include "simulation/path_follower.h"
#include "simulation/range_check.h"
#include "stamps.h"

#include <nav_msgs/Path.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Clock.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using XmlRpc::XmlRpcValue;

/// Reads private parameters, and collects errors.
class ParameterReader {
 public:
  ParameterReader(const ros::NodeHandle& node, std::vector<std::string>& errors)
      : node_(node), errors_(errors) {}

  void read(const std::string& key, double& value) {
    const auto given = find(key);
    if (given && given->getType() == XmlRpcValue::TypeInt) {
      value = static_cast<int>(*given);
    } else {
      take(key, given, XmlRpcValue::TypeDouble, "a number", value);
    }
  }
  void read(const std::string& key, int& value) {
    take(key, find(key), XmlRpcValue::TypeInt, "a whole number", value);
  }
  void read(const std::string& key, bool& value) {
    take(key, find(key), XmlRpcValue::TypeBoolean, "true or false", value);
  }
  void read(const std::string& key, std::string& value) {
    take(key, find(key), XmlRpcValue::TypeString, "a text", value);
  }

  /// Adds an error for each private parameter that was not read.
  void refuseOthers() {
    std::vector<std::string> names;
    node_.getParamNames(names);
    const std::string prefix = node_.getNamespace() + "/";
    for (const std::string& name : names) {
      if (name.compare(0, prefix.size(), prefix) != 0) continue;
      const std::string key = name.substr(prefix.size());
      if (std::find(known_.begin(), known_.end(), key) == known_.end()) {
        errors_.push_back(key + ": there is no such parameter");
      }
    }
  }

 private:
  std::optional<XmlRpcValue> find(const std::string& key) {
    known_.push_back(key);
    XmlRpcValue value;
    if (!node_.getParam(key, value)) return std::nullopt;
    return value;
  }

  template <typename T>
  void take(const std::string& key, const std::optional<XmlRpcValue>& given, XmlRpcValue::Type type,
            const char* description, T& value) {
    if (!given) return;
    if (given->getType() == type) {
      value = static_cast<T>(*given);
    } else {
      std::ostringstream line;
      line << key << " = " << *given << ": must be " << description;
      errors_.push_back(line.str());
    }
  }

  const ros::NodeHandle& node_;
  std::vector<std::string>& errors_;
  std::vector<std::string> known_;
};

/// Publishes /clock, and advances it.
class ClockSource {
 public:
  ClockSource(ros::NodeHandle& node, double rate)
      : publisher_(node.advertise<rosgraph_msgs::Clock>("/clock", 100)), rate_(rate) {}

  [[nodiscard]] ros::Time now() const { return now_; }

  /// Returns when `time` was reached and published, or ROS shuts down.
  void advanceTo(const ros::Time& time) {
    constexpr double kTick_s = 0.01;
    do {
      const double missing_s = (time - now_).toSec() / rate_;
      ros::WallDuration(std::min(kTick_s, missing_s)).sleep();
      const ros::WallTime wall = ros::WallTime::now();
      const double passed_s = std::max(0.0, (wall - last_wall_).toSec());
      last_wall_ = wall;
      now_ = std::min(time, now_ + ros::Duration(passed_s * rate_));
      publish();
    } while (ros::ok() && now_ < time);
  }

 private:
  void publish() {
    rosgraph_msgs::Clock message;
    message.clock = now_;
    publisher_.publish(message);
  }

  ros::Publisher publisher_;
  double rate_;
  ros::Time now_ = kFirstStamp;
  ros::WallTime last_wall_ = ros::WallTime::now();
};

/// Place of the robot: on its own path, or along the path of a topic.
class Driver {
 public:
  Driver(ros::NodeHandle& node, const SimulatedDrive& drive,
         const SimulatedLidarParameters& parameters)
      : drive_(drive), parameters_(parameters), follower_(drive.computePose(0.0)) {
    if (parameters.follow_path) paths_ = node.subscribe("path", 10, &Driver::onPath, this);
  }

  /// T_map_base at a cloud. Clouds come in order.
  [[nodiscard]] Eigen::Isometry3d advanceTo(std::uint64_t index) {
    const double time_s = drive_.timeOf(index);
    if (!parameters_.follow_path) return drive_.computePose(time_s);
    ros::spinOnce();
    follower_.advance((time_s - last_time_s_) * parameters_.speed);
    last_time_s_ = time_s;
    return follower_.pose();
  }

 private:
  void onPath(const nav_msgs::Path& path) {
    if (path.header.frame_id != "map") {
      ROS_WARN("path ignored: its frame is '%s', but must be 'map'", path.header.frame_id.c_str());
      return;
    }
    std::vector<Eigen::Vector2d> waypoints;
    for (const geometry_msgs::PoseStamped& pose : path.poses) {
      waypoints.emplace_back(pose.pose.position.x, pose.pose.position.y);
      if (waypoints.back().allFinite()) continue;
      ROS_WARN("path ignored: not all of its positions are finite");
      return;
    }
    follower_.setPath(std::move(waypoints));
  }

  const SimulatedDrive& drive_;
  const SimulatedLidarParameters& parameters_;
  cuboid_mapping::PathFollower follower_;
  double last_time_s_ = 0.0;
  ros::Subscriber paths_;
};

/// Publishers, one for each topic.
class DrivePublisher {
 public:
  DrivePublisher(ros::NodeHandle& node, const SimulatedDrive& drive, const ros::Time& start)
      : drive_(drive), clouds_(node.advertise<sensor_msgs::PointCloud2>("cloud", 10)) {
    static_transforms_.sendTransform(drive.toMountMessage(start));
  }

  void publish(const Eigen::Isometry3d& T_map_base, const sensor_msgs::PointCloud2& cloud) {
    transforms_.sendTransform(drive_.toPoseMessage(T_map_base, cloud.header.stamp));
    clouds_.publish(cloud);
  }

 private:
  const SimulatedDrive& drive_;
  ros::Publisher clouds_;
  tf2_ros::TransformBroadcaster transforms_;
  tf2_ros::StaticTransformBroadcaster static_transforms_;
};

/// Delay between the last cloud and the end of the node, so that the cloud is not lost.
constexpr double kLinger_s = 0.5;

void runWithOwnClock(ros::NodeHandle& node, const SimulatedLidarParameters& parameters) {
  const DriveConfig& config = parameters.drive;
  const SimulatedDrive drive(config);
  Driver driver(node, drive, parameters);
  ClockSource clock(node, parameters.rate);
  DrivePublisher publisher(node, drive, kFirstStamp);
  const std::uint64_t count = computeNumClouds(config);
  for (std::uint64_t i = 0; ros::ok() && (count == 0 || i < count); ++i) {
    const ros::Time stamp = computeStamp(kFirstStamp, i, config.cloud_rate_hz);
    const Eigen::Isometry3d T_map_base = driver.advanceTo(i);
    const sensor_msgs::PointCloud2 cloud = drive.toCloudMessage(i, stamp, T_map_base);
    clock.advanceTo(stamp);
    publisher.publish(T_map_base, cloud);
  }
  clock.advanceTo(clock.now() + ros::Duration(kLinger_s * parameters.rate));
}

void runWithRosTime(ros::NodeHandle& node, const SimulatedLidarParameters& parameters) {
  const DriveConfig& config = parameters.drive;
  const SimulatedDrive drive(config);
  Driver driver(node, drive, parameters);
  if (!ros::Time::waitForValid()) return;
  const ros::Time start = ros::Time::now();
  DrivePublisher publisher(node, drive, start);
  const std::uint64_t count = computeNumClouds(config);
  std::uint64_t i = 0;
  while (ros::ok() && (count == 0 || i < count)) {
    const ros::Time stamp = computeStamp(start, i, config.cloud_rate_hz);
    const Eigen::Isometry3d T_map_base = driver.advanceTo(i);
    const sensor_msgs::PointCloud2 cloud = drive.toCloudMessage(i, stamp, T_map_base);
    ros::Time::sleepUntil(stamp);
    publisher.publish(T_map_base, cloud);
    const double periods_late = (ros::Time::now() - stamp).toSec() * config.cloud_rate_hz;
    const auto missed = static_cast<std::uint64_t>(std::max(0.0, std::floor(periods_late)));
    if (missed > 0) ROS_WARN_THROTTLE(10.0, "too slow for this rate: some clouds are skipped");
    i += 1 + missed;
  }
  ros::WallDuration(kLinger_s).sleep();
}

}  // namespace

SimulatedLidarParameters loadParameters(const ros::NodeHandle& private_node,
                                        std::vector<std::string>& errors) {
  SimulatedLidarParameters parameters;
  DriveConfig& drive = parameters.drive;
  ParameterReader reader(private_node, errors);
  int seed = static_cast<int>(drive.seed);
  reader.read("seed", seed);
  reader.read("rings", drive.lidar.rings);
  reader.read("columns", drive.lidar.columns);
  reader.read("min_elevation", drive.lidar.min_elevation_rad);
  reader.read("max_elevation", drive.lidar.max_elevation_rad);
  reader.read("noise", drive.lidar.range_noise_m);
  reader.read("max_range", drive.lidar.max_range_m);
  reader.read("cloud_rate", drive.cloud_rate_hz);
  reader.read("duration", drive.duration_s);
  reader.read("robot", drive.robot);
  reader.read("door", drive.door);
  reader.read("head_start", drive.head_start_m);
  reader.read("publish_clock", parameters.publish_clock);
  reader.read("rate", parameters.rate);
  reader.read("follow_path", parameters.follow_path);
  reader.read("speed", parameters.speed);
  reader.refuseOthers();

  if (seed < 0) errors.push_back("seed = " + std::to_string(seed) + ": must be 0 or more");
  drive.seed = static_cast<std::uint64_t>(seed);
  cuboid_mapping::RangeCheck check;
  check("rate", parameters.rate, 0.01, 1000.0);
  check("speed", parameters.speed, 0.01, 100.0);
  for (const auto& complaints : {checkDriveConfig(drive), check.errors()}) {
    errors.insert(errors.end(), complaints.begin(), complaints.end());
  }
  if (parameters.rate != 1.0 && !parameters.publish_clock) {
    errors.push_back(
        "rate: needs publish_clock, because otherwise this node does not set the ROS time");
  }
  if (parameters.speed != 1.0 && !parameters.follow_path) {
    errors.push_back("speed: needs follow_path: the node's own path has a speed of 1 m/s");
  }
  return parameters;
}

void runSimulatedLidar(ros::NodeHandle& node, const SimulatedLidarParameters& parameters) {
  if (!parameters.publish_clock) return runWithRosTime(node, parameters);
  bool use_sim_time = false;
  node.param("/use_sim_time", use_sim_time, false);
  if (!use_sim_time)
    ROS_WARN("publish_clock: set /use_sim_time, otherwise other nodes ignore this clock");
  runWithOwnClock(node, parameters);
}

}  // namespace cuboid_mapping_ros
