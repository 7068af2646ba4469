// SPDX-License-Identifier: BSD-3-Clause
// A guarded map with a frame, and tf, for tests of answers.
#pragma once

#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/queries/answers.h"
#include "cuboid_mapping/ros/queries/service_call.h"

#include <geometry_msgs/TransformStamped.h>
#include <gtest/gtest.h>
#include <tf2/buffer_core.h>
#include <tf2_eigen/tf2_eigen.h>

#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {

template <typename ResponseT>
const cuboid_mapping::AnswerInfo& infoOf(const ResponseT& response) {
  return response.info;
}
inline cuboid_mapping::AnswerInfo infoOf(const cuboid_mapping::QueryBox::Response& response) {
  cuboid_mapping::AnswerInfo info;
  info.success = response.success;
  info.message = response.message;
  info.header = response.header;
  info.revision = response.revision;
  info.truncated = response.truncated;
  return info;
}

/// A map at 0.1 m: a free room from (0, 0, 0) to (2, 1, 1) m with a wall 0.1 m thick in its middle, from
/// x = 1 on, which has a door from y = 0.3 to 0.6; the rest is unknown. The frame "turned" is the map's, rotated by
/// 90 degrees about z, and moved by (5, 0, 0): its (x, y) is the map's (5 - y, x).
class MapInFrameTest : public ::testing::Test {
 protected:
  MapInFrameTest() : map_(makeConfig()) {
    map_.change(ros::Time(7.0), [](cuboid_mapping::CuboidMap& map) {
      return map.replace(cuboid_mapping::kAllCells, {{{{0, 0, 0}, {10, 10, 10}}, -1.0F},
                                                     {{{11, 0, 0}, {20, 10, 10}}, -1.0F},
                                                     {{{10, 0, 0}, {11, 3, 10}}, 1.0F},
                                                     {{{10, 3, 0}, {11, 6, 10}}, -2.0F},
                                                     {{{10, 6, 0}, {11, 10, 10}}, 1.0F}});
    });
    Eigen::Isometry3d T_map_turned = Eigen::Isometry3d::Identity();
    T_map_turned.linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
    T_map_turned.translation() << 5, 0, 0;
    geometry_msgs::TransformStamped transform = tf2::eigenToTransform(T_map_turned);
    transform.header.frame_id = "map";
    transform.header.stamp = ros::Time(7.0);
    transform.child_frame_id = "turned";
    EXPECT_TRUE(tf_.setTransform(transform, "test", true));
  }

  static cuboid_mapping::MapConfig makeConfig() {
    cuboid_mapping::MapConfig config;
    config.resolution_m = 0.1;
    return config;
  }

  static geometry_msgs::Point point(double x, double y, double z) { return toPoint({x, y, z}); }
  static cuboid_mapping::Box box(const Eigen::Vector3d& min, const Eigen::Vector3d& max) {
    cuboid_mapping::Box box;
    box.min = toPoint(min);
    box.max = toPoint(max);
    return box;
  }
  static geometry_msgs::Vector3 vector(double x, double y, double z) {
    return toVector3({x, y, z});
  }

  template <typename ResponseT>
  static void expectHead(const ResponseT& response) {
    const auto info = infoOf(response);
    EXPECT_TRUE(info.success) << info.message;
    EXPECT_EQ(info.header.frame_id, "map");
    EXPECT_EQ(info.header.stamp, ros::Time(7.0));
    EXPECT_EQ(info.revision, 1U);
  }

  /// @param part  Part of the expected text.
  template <typename ResponseT>
  static void expectRefusal(const ResponseT& response, const std::string& part) {
    const auto info = infoOf(response);
    EXPECT_FALSE(info.success);
    EXPECT_NE(info.message.find(part), std::string::npos) << "says: " << info.message;
  }

  static void expectNear(const geometry_msgs::Point& at, double x, double y, double z) {
    EXPECT_NEAR(at.x, x, 1e-5);
    EXPECT_NEAR(at.y, y, 1e-5);
    EXPECT_NEAR(at.z, z, 1e-5);
  }

  GuardedMap map_;
  tf2::BufferCore tf_;
  MapInFrame in_frame_{map_, "map", tf_};
};

}  // namespace cuboid_mapping_ros::test
