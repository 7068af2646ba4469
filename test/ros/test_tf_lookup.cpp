// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/tf_lookup.h"

#include <geometry_msgs/TransformStamped.h>
#include <gtest/gtest.h>

#include <string>

namespace cuboid_mapping_ros {
namespace {

class TfLookupTest : public ::testing::Test {
 protected:
  void add(const std::string& parent, const std::string& child, double stamp_s) {
    geometry_msgs::TransformStamped transform;
    transform.header.frame_id = parent;
    transform.header.stamp = ros::Time(stamp_s);
    transform.child_frame_id = child;
    transform.transform.rotation.w = 1.0;
    ASSERT_TRUE(tf_.setTransform(transform, "test"));
  }
  std::string why(const std::string& source, double stamp_s) {
    const TfLookup lookup = lookupTransform(tf_, "map", source, ros::Time(stamp_s));
    EXPECT_FALSE(lookup.T_target_source);
    return lookup.error;
  }

  tf2::BufferCore tf_;
};

TEST_F(TfLookupTest, SaysWhatTfSays) {
  add("map", "odom", 10.0);
  add("earth", "island", 10.0);
  EXPECT_EQ(why("odom", 5.0).rfind("Lookup would require extrapolation", 0), 0U);
  EXPECT_EQ(why("island", 0.0).rfind("Could not find a connection between 'map' and 'island'", 0),
            0U);
  EXPECT_NE(why("nowhere", 0.0).find("\"nowhere\""), std::string::npos);
}

TEST_F(TfLookupTest, SaysSomethingWhereTfLeavesItOut) {
  add("map", "lidar", 10.0);
  tf_.clear();  // As after a jump back in time: tf knows the frames, and nothing of them.
  EXPECT_EQ(why("lidar", 10.0),
            "tf has no data yet, when looking up transform from frame [lidar] to frame [map]");
}

TEST_F(TfLookupTest, TheReasonHasNoFullStop) {
  add("map", "odom", 10.0);
  for (const char* source : {"odom", "nowhere"}) {
    const std::string text = why(source, 20.0);
    EXPECT_EQ(text.find_last_not_of(" ."), text.size() - 1) << text;
  }
}

}  // namespace
}  // namespace cuboid_mapping_ros
