// SPDX-License-Identifier: BSD-3-Clause
// A lidar at 10 Hz, a planar laser at 20 Hz and a depth camera at 30 Hz, in real time: every message is counted by
// source and outcome.
#include "ros/node_probe.h"
#include "simulation/simulated_sensors.h"

#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <iostream>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

/// Messages of a source.
struct Sent {
  explicit Sent(const std::string& source) : name(source), probe(kNode, "source " + source) {}

  [[nodiscard]] bool isReceived() const {
    return probe.status().number("messages received") == count;
  }

  std::string name;
  DiagnosticsProbe probe;
  long count = 0;
};

/// Publishes the sensors' messages, each at its stamp or as soon as it is made.
class LoadPublisher {
 public:
  LoadPublisher() : drive_(makeConfig()), sensors_(makeConfig()) {}

  [[nodiscard]] bool isConnected() const {
    const auto has_listener = [](const ros::Publisher& publisher) {
      return publisher.getNumSubscribers() > 0;
    };
    return std::all_of(publishers_.begin(), publishers_.end(), has_listener);
  }

  /// @return Delay in seconds of the latest message.
  double run(double duration_s, Sent& lidar, Sent& laser, Sent& camera) {
    const ros::Time start = ros::Time::now() + ros::Duration(0.5);
    publishMounts(start);
    const auto num_ticks = static_cast<std::uint64_t>(duration_s * sensors_.tickRate());
    double late_s = 0.0;
    for (std::uint64_t tick = 0; ros::ok() && tick < num_ticks; ++tick) {
      const ros::Time stamp =
          start + ros::Duration(static_cast<double>(tick) / sensors_.tickRate());
      ros::Time::sleepUntil(stamp);
      late_s = std::max(late_s, (ros::Time::now() - stamp).toSec());
      tf2_msgs::TFMessage pose;
      pose.transforms.push_back(sensors_.toPoseMessage(tick, stamp));
      tf_.publish(pose);
      if (tick % SimulatedSensors::kTicksACloud == 0) {
        clouds_.publish(drive_.toCloudMessage(tick / SimulatedSensors::kTicksACloud, stamp));
        ++lidar.count;
      }
      if (SimulatedSensors::hasScan(tick)) {
        scans_.publish(sensors_.toScanMessage(tick, stamp));
        ++laser.count;
      }
      if (SimulatedSensors::hasImage(tick)) {
        images_.publish(sensors_.toImageMessage(tick, stamp));
        cameras_.publish(sensors_.toCameraMessage(stamp));
        ++camera.count;
      }
      ros::spinOnce();
    }
    return late_s;
  }

 private:
  static DriveConfig makeConfig() {
    DriveConfig config;
    config.lidar.rings = 16;
    return config;
  }

  void publishMounts(const ros::Time& stamp) {
    for (const auto& mount : sensors_.toMountMessages(stamp)) static_tf_.sendTransform(mount);
    static_tf_.sendTransform(drive_.toMountMessage(stamp));
  }

  static constexpr std::uint32_t kQueueSize = 1000;  // None is lost here.
  SimulatedDrive drive_;
  SimulatedSensors sensors_;
  ros::NodeHandle nh_;
  ros::Publisher clouds_ = nh_.advertise<sensor_msgs::PointCloud2>("/cloud", kQueueSize);
  ros::Publisher scans_ = nh_.advertise<sensor_msgs::LaserScan>("/scan", kQueueSize);
  ros::Publisher images_ =
      nh_.advertise<sensor_msgs::Image>("/camera/depth/image_rect_raw", kQueueSize);
  ros::Publisher cameras_ =
      nh_.advertise<sensor_msgs::CameraInfo>("/camera/depth/camera_info", kQueueSize);
  ros::Publisher tf_ = nh_.advertise<tf2_msgs::TFMessage>("/tf", kQueueSize);
  std::vector<ros::Publisher> publishers_{clouds_, scans_, images_, cameras_, tf_};
  tf2_ros::StaticTransformBroadcaster static_tf_;
};

TEST(Load, EveryMessageOfThreeSourcesIsCounted) {
  double duration_s = 12.0;
  ros::param::param("~duration", duration_s, duration_s);
  LoadPublisher publisher;
  DiagnosticsProbe node;
  Sent lidar("lidar");
  Sent laser("laser");
  Sent camera("camera");
  ASSERT_TRUE(waitFor([&] { return publisher.isConnected() && node.numReports() > 0; }));
  const ros::WallTime begin = ros::WallTime::now();
  const double late_s = publisher.run(duration_s, lidar, laser, camera);
  const double took_s = (ros::WallTime::now() - begin).toSec();
  long num_sent = 0;
  for (const Sent* sent : {&lidar, &laser, &camera}) {
    num_sent += sent->count;
    EXPECT_TRUE(waitFor([&] { return sent->isReceived(); }))
        << sent->name << ": " << sent->count << " sent, received "
        << sent->probe.status().number("messages received");
  }
  EXPECT_TRUE(waitFor([&] {
    const NodeStatus& status = node.status();
    return status.number("clouds received") == num_sent && status.number("clouds waiting") == 0;
  })) << node.status().message;
  EXPECT_EQ(lidar.count, static_cast<long>(10 * duration_s));
  EXPECT_EQ(laser.count, static_cast<long>(20 * duration_s));
  EXPECT_EQ(camera.count, static_cast<long>(30 * duration_s));
  long num_of_reasons = 0;
  for (const auto& [key, value] : node.status().values) {
    if (key.rfind("clouds dropped, ", 0) == 0) num_of_reasons += std::stol(value);
  }
  const long num_inserted = node.status().number("clouds inserted");
  const long num_dropped = node.status().number("clouds dropped");
  EXPECT_EQ(num_inserted + num_dropped, num_sent);
  EXPECT_EQ(num_of_reasons, num_dropped) << "each has a reason";
  EXPECT_GT(num_inserted, num_sent / 2);
  std::cout << num_sent << " messages in " << took_s << " s (the latest " << late_s
            << " s late): " << num_inserted << " inserted, " << num_dropped << " dropped; apply "
            << node.status().values.at("apply time mean [ms]") << " ms on average, "
            << node.status().values.at("apply time max [ms]") << " ms at most" << std::endl;
  for (const Sent* sent : {&lidar, &laser, &camera}) {
    const NodeStatus& status = sent->probe.status();
    std::cout << sent->name << ": " << sent->count << " sent, "
              << status.number("messages received") << " received, "
              << status.number("messages inserted") << " inserted" << std::endl;
    EXPECT_EQ(status.number("messages inserted") + status.number("messages dropped"), sent->count);
  }
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
