// SPDX-License-Identifier: BSD-3-Clause
// Poses are not interpolated across a gap of tf.
#include "cuboid_mapping/ros/mapping/tf_poses.h"
#include "cuboid_mapping/ros/middleware/static_publishers.h"
#include "cuboid_mapping/ros/middleware/tf_buffer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>

namespace cuboid_mapping_ros {
namespace {

/// map -> odom -> base -> lidar, the last one static; gaps are longer than a second.
class TfGaps : public ::testing::Test {
 protected:
  TfGaps() { set("base", "lidar", 0.0, true); }

  void set(const std::string& parent, const std::string& child, double stamp_s,
           bool is_static = false) {
    geometry_msgs::TransformStamped transform;
    transform.header.frame_id = parent;
    transform.header.stamp = ros::Time(stamp_s);
    transform.child_frame_id = child;
    transform.transform.rotation.w = 1.0;
    tf_.setTransform(transform, "test", is_static);
  }
  /// Sends a transform ten times a second.
  void send(const std::string& parent, const std::string& child, double begin_s, double end_s) {
    for (double time_s = begin_s; time_s < end_s + 0.01; time_s += 0.1) set(parent, child, time_s);
  }

  PoseSearch find(double stamp_s, const std::string& map = "map") {
    NodeParameters parameters;
    parameters.frame_id = map;
    std_msgs::Header header;
    header.frame_id = "lidar";
    header.stamp = ros::Time(stamp_s);
    return findPoses(tf_, PoseFrames(parameters, parameters.source), header, {});
  }

  TfBuffer tf_{ros::Duration(100.0), 1.0};
};

TEST_F(TfGaps, ACloudInAGapHasNoPose) {
  send("map", "odom", 1000.0, 1030.0);
  send("odom", "base", 1000.0, 1009.0);
  send("odom", "base", 1017.0, 1030.0);
  for (const double inside_s : {1009.1, 1012.0, 1016.9}) {
    const PoseSearch search = find(inside_s);
    EXPECT_FALSE(search.poses) << inside_s;
    EXPECT_EQ(search.hopeless, DropReason::kTfGap);
    EXPECT_NE(search.why.find("'base' for 8 s"), std::string::npos) << search.why;
  }
  for (const double outside_s : {1000.05, 1009.0, 1017.0, 1029.95}) {
    EXPECT_TRUE(find(outside_s).poses) << outside_s;
  }
  EXPECT_TRUE(find(1012.0, "base").poses) << "the gap is not on its way";
  EXPECT_FALSE(find(1012.0, "odom").poses);
}

TEST_F(TfGaps, AGapThatIsFilledLaterIsNone) {
  send("map", "odom", 1000.0, 1030.0);
  set("odom", "base", 1000.0);
  set("odom", "base", 1002.5);
  set("odom", "base", 1005.0);
  set("odom", "base", 1001.6);  // Of another publisher, late.
  EXPECT_FALSE(find(1000.5).poses);
  EXPECT_TRUE(find(1002.0).poses) << "0.9 s between two transforms";
  EXPECT_FALSE(find(1003.0).poses);
  set("odom", "base", 1000.8);
  EXPECT_TRUE(find(1000.5).poses);
}

TEST_F(TfGaps, ARecordingThatStartsAgainHasAGapBeforeItsFirstRun) {
  set("map", "odom", 0.0, true);
  send("odom", "base", 1050.0, 1060.0);
  send("odom", "base", 1000.0, 1010.0);
  EXPECT_TRUE(find(1005.0).poses);
  EXPECT_FALSE(find(1030.0).poses);
  EXPECT_TRUE(find(1055.0).poses);
}

TEST_F(TfGaps, AreForgottenWithTheTransforms) {
  send("map", "odom", 1000.0, 1030.0);
  set("odom", "base", 1000.0);
  set("odom", "base", 1008.0);
  ASSERT_FALSE(find(1004.0).poses);
  tf_.clear();
  set("base", "lidar", 0.0, true);
  send("map", "odom", 1000.0, 1030.0);
  send("odom", "base", 1000.0, 1008.0);
  EXPECT_TRUE(find(1004.0).poses);
}

TEST_F(TfGaps, AreNoneBeforeAStaticOrTheNewestTransform) {
  set("map", "odom", 0.0, true);
  set("odom", "base", 1000.0);
  set("odom", "base", 1008.0);
  EXPECT_FALSE(find(1004.0).poses);
  EXPECT_TRUE(find(0.0).poses) << "a cloud without a stamp gets the newest";
}

TEST(TfBuffer, AStampThatLeadsHoldsWhenTheNextOneConfirmsIt) {
  TfBuffer tf{ros::Duration(10.0), 1.0};
  const auto send = [&](double stamp_s) {
    geometry_msgs::TransformStamped transform;
    transform.header.frame_id = "map";
    transform.header.stamp = ros::Time(stamp_s);
    transform.child_frame_id = "base";
    transform.transform.rotation.w = 1.0;
    tf.setTransform(transform, "test");
  };
  const auto knows = [&](double stamp_s) {
    return tf.canTransform("map", "base", ros::Time(stamp_s)) &&
           !tf.findGap("map", "base", ros::Time(stamp_s));
  };
  for (const double stamp_s : {1000.0, 1000.5, 1048.0, 1048.0, 1001.0, 1001.5}) send(stamp_s);
  EXPECT_TRUE(knows(1000.2)) << "one stamp 48 s ahead, sent twice, is a fault";
  EXPECT_TRUE(knows(1001.2));
  EXPECT_FALSE(knows(1048.0));
  for (const double stamp_s : {1030.0, 1030.5}) send(stamp_s);
  EXPECT_TRUE(knows(1030.2)) << "two are a publisher that goes on after a pause";
  EXPECT_FALSE(knows(1015.0));
}

/// Few digits of a rotation, and a slash before a frame, are no difference.
TEST(StaticPublishers, AreReportedIfTheyDiffer) {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = "/base";
  transform.child_frame_id = "laser";
  transform.transform.rotation.z = transform.transform.rotation.w = 0.7071;
  StaticPublishers publishers;
  EXPECT_EQ(publishers.note(transform, "/one"), "");
  transform.header.frame_id = "base";
  transform.transform.rotation.z = transform.transform.rotation.w = std::sqrt(0.5);
  EXPECT_EQ(publishers.note(transform, "/two"), "");
  transform.transform.translation.x = 0.1;
  EXPECT_EQ(publishers.note(transform, "/two"),
            "'laser' has different static transforms from /one and /two: the last one holds. Stop "
            "one of them");
}

TEST(StaticPublishers, OneDoesNotContradictItself) {
  geometry_msgs::TransformStamped without_rotation;
  EXPECT_EQ(StaticPublishers().note(without_rotation, "/one"), "");
}

}  // namespace
}  // namespace cuboid_mapping_ros
