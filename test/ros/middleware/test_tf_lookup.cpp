// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include "support/random.h"
#include "support/random_shapes.h"

#include <geometry_msgs/TransformStamped.h>
#include <gtest/gtest.h>
#include <tf2_eigen/tf2_eigen.h>

#include <limits>
#include <string>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::MetricBox;
using cuboid_mapping::test::Random;

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
  tf_.clear();  // The state after a jump back in time: tf knows the frames, but no transform.
  EXPECT_EQ(
      why("lidar", 10.0)
          .rfind("tf has no data yet, when looking up transform from frame [lidar] to frame [map]",
                 0),
      0U);
}

TEST_F(TfLookupTest, TheReasonHasNoFullStop) {
  add("map", "odom", 10.0);
  for (const char* source : {"odom", "nowhere"}) {
    const std::string text = why(source, 20.0);
    EXPECT_EQ(text.find_last_not_of(" ."), text.size() - 1) << text;
  }
}

/// A node looks up a transform as soon as it arrives, bag_to_map when all have arrived.
TEST_F(TfLookupTest, IsTheSameWhenALaterTransformHasCome) {
  cuboid_mapping::test::Random random(5);
  const auto pose = [&random] {
    const Eigen::Vector3d axis(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    return Eigen::Isometry3d(Eigen::Translation3d(50.0 * axis) *
                             Eigen::AngleAxisd(random.real(-3, 3), axis.normalized()));
  };
  const auto add_all = [&](double stamp_s) {
    const char* frames[] = {"map", "odom", "base", "lidar"};
    for (int i = 0; i < 3; ++i) {
      geometry_msgs::TransformStamped transform = tf2::eigenToTransform(pose());
      transform.header.frame_id = frames[i];
      transform.child_frame_id = frames[i + 1];
      transform.header.stamp = ros::Time(stamp_s);
      ASSERT_TRUE(tf_.setTransform(transform, "test"));
    }
  };
  int num_changed_by_tf = 0;
  add_all(1.0);
  for (int i = 2; i < 1000; ++i) {
    const ros::Time stamp(i);
    add_all(i);
    const auto of_tf = tf2::transformToEigen(tf_.lookupTransform("map", "lidar", stamp)).matrix();
    const auto lookup = lookupTransform(tf_, "map", "lidar", stamp);
    add_all(i + 0.5);
    const auto later_of_tf =
        tf2::transformToEigen(tf_.lookupTransform("map", "lidar", stamp)).matrix();
    num_changed_by_tf += of_tf == later_of_tf ? 0 : 1;
    const auto later = lookupTransform(tf_, "map", "lidar", stamp);
    ASSERT_TRUE(lookup.T_target_source && later.T_target_source);
    EXPECT_EQ(lookup.T_target_source->matrix(), later.T_target_source->matrix());
    EXPECT_TRUE(lookup.T_target_source->matrix().isApprox(of_tf, 1e-9));
  }
  EXPECT_GT(num_changed_by_tf, 10);
}

TEST(ComputeEnclosingBox, IsTheSmallestOneAroundAllCorners) {
  Random random;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d min_m = cuboid_mapping::test::randomPoint(random, 10.0);
    const MetricBox box{min_m, min_m + cuboid_mapping::test::randomPoint(random, 5.0).cwiseAbs()};
    Eigen::Isometry3d T_map_frame = Eigen::Isometry3d::Identity();
    T_map_frame.translate(cuboid_mapping::test::randomPoint(random, 100.0));
    T_map_frame.rotate(Eigen::AngleAxisd(
        random.real(-3.0, 3.0), cuboid_mapping::test::randomDirection(random).normalized()));
    Eigen::Vector3d least = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
    Eigen::Vector3d greatest = -least;
    for (int corner = 0; corner < 8; ++corner) {
      Eigen::Vector3d point = box.min_m;
      for (int axis = 0; axis < 3; ++axis) {
        if ((corner >> axis & 1) != 0) point[axis] = box.max_m[axis];
      }
      least = least.cwiseMin(T_map_frame * point);
      greatest = greatest.cwiseMax(T_map_frame * point);
    }
    const MetricBox enclosing = computeEnclosingBox(T_map_frame, box);
    ASSERT_NEAR((enclosing.min_m - least).norm(), 0.0, 1e-10);
    ASSERT_NEAR((enclosing.max_m - greatest).norm(), 0.0, 1e-10);
  }
}

}  // namespace
}  // namespace cuboid_mapping_ros
