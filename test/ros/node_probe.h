// SPDX-License-Identifier: BSD-3-Clause
// Common parts of the tests of the running node: a lidar in a room, tf, diagnostics.
#pragma once

#include "cuboid_mapping/ros/conversions/points.h"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/TransformStamped.h>
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_srvs/Empty.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>
#include <boost/function.hpp>

#include <Eigen/Geometry>

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros::test {

/// Name under which the launch files of the tests start the node, and its resolution.
constexpr char kNode[] = "/cuboid_mapping";
constexpr double kResolution_m = 0.1;

/// Longest wait: only a failure takes this long.
constexpr double kDeadline_s = 60.0;

/// Serves callbacks until the condition holds. @return false at the deadline.
inline bool waitFor(const std::function<bool()>& condition) {
  const ros::WallTime deadline = ros::WallTime::now() + ros::WallDuration(kDeadline_s);
  while (ros::ok() && ros::WallTime::now() < deadline) {
    ros::spinOnce();
    if (condition()) return true;
    ros::WallDuration(0.01).sleep();
  }
  return false;
}

/// Calls a service that may be called twice. roscpp sometimes loses an answer: it closes the connection
/// before it has read the server's last bytes (ros_comm issue 1976).
template <typename ServiceT>
bool callService(const std::string& name, ServiceT& service) {
  return ros::service::call(name, service) || ros::service::call(name, service);
}

/// Points on the inner faces of a room, two for each edge of a voxel. Seen from inside, every
/// voxel within [-half_size_m, half_size_m) is free, and every voxel in the layer around it
/// that faces the room is occupied.
///
/// @param half_size_m  Multiples of the resolution.
inline std::vector<Eigen::Vector3d> makeRoom(const Eigen::Vector3d& half_size_m) {
  std::vector<Eigen::Vector3d> points;
  const double step_m = 0.5 * kResolution_m;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    for (double a = -half_size_m[u] + 0.5 * step_m; a < half_size_m[u]; a += step_m) {
      for (double b = -half_size_m[v] + 0.5 * step_m; b < half_size_m[v]; b += step_m) {
        for (const double side : {-1.0, 1.0}) {
          Eigen::Vector3d point;
          point[axis] = side * (half_size_m[axis] + 0.5 * kResolution_m);
          point[u] = a;
          point[v] = b;
          points.push_back(point);
        }
      }
    }
  }
  return points;
}

/// A cloud of these points, given in its frame.
inline sensor_msgs::PointCloud2 makeCloud(const std::string& frame_id, const ros::Time& stamp,
                                          const std::vector<Eigen::Vector3d>& points) {
  return toCloud(points, makeHeader(frame_id, stamp));
}

inline geometry_msgs::TransformStamped makeTransform(const std::string& parent,
                                                     const std::string& child,
                                                     const Eigen::Isometry3d& T_parent_child,
                                                     const ros::Time& stamp = ros::Time(1.0)) {
  geometry_msgs::TransformStamped transform = tf2::eigenToTransform(T_parent_child);
  transform.header.frame_id = parent;
  transform.header.stamp = stamp;
  transform.child_frame_id = child;
  return transform;
}

inline Eigen::Isometry3d makeTranslation(double x, double y, double z) {
  return Eigen::Isometry3d(Eigen::Translation3d(x, y, z));
}

inline void publishStaticTf(const geometry_msgs::TransformStamped& transform) {
  // One broadcaster for all tests: the topic is latched, so the last message of a publisher counts.
  static tf2_ros::StaticTransformBroadcaster broadcaster;
  broadcaster.sendTransform(transform);
}

/// Diagnostics of a node at one time.
struct NodeStatus {
  ros::Time stamp;
  int level = -1;
  std::string message;
  std::map<std::string, std::string> values;

  /// The whole number of a key. Counts of what has not occurred have no key: 0; -1 before the first report.
  [[nodiscard]] long number(const std::string& key) const {
    const auto value = values.find(key);
    if (value == values.end()) return values.empty() ? -1 : 0;
    return std::stol(value->second);
  }
};

/// Listens to the diagnostics of a node.
class DiagnosticsProbe {
 public:
  explicit DiagnosticsProbe(const std::string& node = kNode, const std::string& part = "mapping")
      : name_(node.substr(1) + ": " + part) {
    const boost::function<void(const diagnostic_msgs::DiagnosticArray::ConstPtr&)> callback =
        [this](const diagnostic_msgs::DiagnosticArray::ConstPtr& array) { onArray(*array); };
    subscriber_ = nh_.subscribe("/diagnostics", 100, callback);
  }

  [[nodiscard]] const NodeStatus& status() const { return status_; }
  [[nodiscard]] int numReports() const { return num_reports_; }

  /// Waits for a report made after this call, not one that is already on its way.
  bool waitForNextReport() {
    const int num_seen = num_reports_;
    return waitFor([&] { return num_reports_ >= num_seen + 2; });
  }

 private:
  void onArray(const diagnostic_msgs::DiagnosticArray& array) {
    for (const auto& status : array.status) {
      if (status.name != name_ || status.values.empty()) continue;
      status_ = {array.header.stamp, status.level, status.message, {}};
      for (const auto& value : status.values) status_.values[value.key] = value.value;
      ++num_reports_;
    }
  }

  std::string name_;
  NodeStatus status_;
  int num_reports_ = 0;
  ros::NodeHandle nh_;
  ros::Subscriber subscriber_;
};

/// A test with a running node: an empty map, a cloud topic, tf and diagnostics.
class NodeTest : public ::testing::Test {
 protected:
  void SetUp() override {
    cloud_publisher_ = nh_.advertise<sensor_msgs::PointCloud2>("/cloud_in", 200);
    ASSERT_TRUE(waitFor([this] { return cloud_publisher_.getNumSubscribers() > 0; }));
    ASSERT_TRUE(waitFor([this] { return diagnostics_.numReports() > 0; }));
    reset();
    startCounting();
  }

  void reset() const {
    std_srvs::Empty empty;
    const std::string service = std::string(kNode) + "/reset";
    ASSERT_TRUE(ros::service::waitForService(service, ros::Duration(kDeadline_s)));
    ASSERT_TRUE(callService(service, empty));
  }

  /// Publishes a room of 4 x 4 x 2 m around the origin of the cloud's frame.
  void publishRoom(const std::string& frame_id, const ros::Time& stamp = ros::Time(100.0)) const {
    cloud_publisher_.publish(makeCloud(frame_id, stamp, makeRoom({2.0, 2.0, 1.0})));
  }

  /// Waits until this many more clouds are in the map than at the start of the test.
  bool waitForInserted(long count) {
    return waitFor([&] { return countNew("clouds inserted") >= count; });
  }

  /// Resets countNew().
  void startCounting() {
    ASSERT_TRUE(diagnostics_.waitForNextReport());
    start_ = diagnostics_.status();
  }

  /// Increase of a number of the diagnostics in this test.
  [[nodiscard]] long countNew(const std::string& key) const {
    return diagnostics_.status().number(key) - start_.number(key);
  }

  void publishTf(const geometry_msgs::TransformStamped& transform) {
    broadcaster_.sendTransform(transform);
  }
  ros::NodeHandle nh_;
  DiagnosticsProbe diagnostics_;
  ros::Publisher cloud_publisher_;

 private:
  NodeStatus start_;
  tf2_ros::TransformBroadcaster broadcaster_;
};

}  // namespace cuboid_mapping_ros::test
