// SPDX-License-Identifier: BSD-3-Clause
// Poses of a topic cannot be edited: a bad one, or a second one of a stamp, does not cost the others.
#include "cuboid_mapping/ros/conversions/pose_messages.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

StampedPose makePose(double stamp_s, double x_m, double w = 1.0) {
  geometry_msgs::Pose pose;
  pose.position.x = x_m;
  pose.orientation.w = w;
  return toStampedPose(ros::Time(stamp_s), pose);
}

/// A pose for each second, 1 m apart.
std::vector<StampedPose> makePoses(int count) {
  std::vector<StampedPose> poses;
  for (int i = 1; i <= count; ++i) poses.push_back(makePose(i, i));
  return poses;
}

TEST(TidyPoses, OneBadPoseOfAHundredIsLeftOut) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const StampedPose& bad :
       {makePose(0.5, 0.0, 0.0), makePose(0.5, nan), makePose(0.5, 0, nan), makePose(0.0, 0.0)}) {
    std::vector<StampedPose> poses = makePoses(100);
    poses.insert(poses.begin(), bad);
    const std::vector<StampedPose> tidy = tidyPoses(poses);
    ASSERT_EQ(tidy.size(), 100U);
    EXPECT_EQ(PoseTrack(tidy).at(1500000000).translation().x(), 1.5);
  }
}

TEST(TidyPoses, OfOneStampTheLastCounts) {
  std::vector<StampedPose> poses = makePoses(100);
  std::vector<StampedPose> twice;
  for (const StampedPose& pose : poses) twice.insert(twice.end(), 2, pose);
  EXPECT_EQ(tidyPoses(twice).size(), 100U);
  poses.push_back(makePose(5.0, 5.5));
  EXPECT_EQ(PoseTrack(tidyPoses(poses)).at(5000000000).translation().x(), 5.5);
}

TEST(TidyPoses, ManyBadPosesAreRefused) {
  std::vector<StampedPose> poses = makePoses(10);
  for (int i = 0; i < 5; ++i) poses.push_back(makePose(0.0, i));
  EXPECT_THROW((void)PoseTrack(tidyPoses(poses)), std::invalid_argument);
}

}  // namespace
}  // namespace cuboid_mapping_ros
