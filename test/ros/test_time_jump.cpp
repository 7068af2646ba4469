// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/time_jump.h"

#include <gtest/gtest.h>

namespace cuboid_mapping_ros {
namespace {

/// A detector that tolerates 10 s, fed with seconds.
class Clouds {
 public:
  bool isJump(double stamp_s, double now_s) {
    return detector_.isJump(ros::Time(stamp_s), ros::Time(now_s));
  }

 private:
  TimeJumpDetector detector_{ros::Duration(10.0)};
};

TEST(TimeJumpDetector, CloudsInOrderAreNoJump) {
  Clouds clouds;
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(clouds.isJump(1000.0 + i, 1000.5 + i));
}

TEST(TimeJumpDetector, TheFirstOldCloudIsAJumpWhenTheClockWentBack) {
  Clouds clouds;
  EXPECT_FALSE(clouds.isJump(1050.0, 1050.0));
  EXPECT_FALSE(clouds.isJump(1050.1, 1000.0)) << "the clock is there before the cloud";
  EXPECT_TRUE(clouds.isJump(1000.0, 1000.1));
  EXPECT_FALSE(clouds.isJump(1000.1, 1000.2)) << "a jump is told once";
}

TEST(TimeJumpDetector, AClockThatWentBackLittleDoesNotMakeALaterCloudAJump) {
  Clouds clouds;
  EXPECT_FALSE(clouds.isJump(1050.0, 1050.0));
  EXPECT_FALSE(clouds.isJump(1047.0, 1047.0));
  EXPECT_FALSE(clouds.isJump(1055.0, 1055.0));
  EXPECT_FALSE(clouds.isJump(1040.0, 1056.0)) << "merely late";
}

TEST(TimeJumpDetector, TheSecondOldCloudIsAJumpWithoutAClock) {
  Clouds clouds;
  EXPECT_FALSE(clouds.isJump(1050.0, 9000.0));
  EXPECT_FALSE(clouds.isJump(1000.0, 9000.1));
  EXPECT_TRUE(clouds.isJump(1000.1, 9000.2));
  EXPECT_FALSE(clouds.isJump(1000.2, 9000.3));
}

TEST(TimeJumpDetector, ALateCloudNowAndThenIsNoJump) {
  Clouds clouds;
  for (int i = 0; i < 100; ++i) {
    EXPECT_FALSE(clouds.isJump(1000.0 + i, 1000.0 + i));
    EXPECT_FALSE(clouds.isJump(980.0 + i, 1000.5 + i));
  }
}

TEST(TimeJumpDetector, CloudsWithinTheToleranceAreNoJump) {
  Clouds clouds;
  EXPECT_FALSE(clouds.isJump(1050.0, 1050.0));
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(clouds.isJump(1041.0, 1000.0 - i));
}

TEST(TimeJumpDetector, AStampOfZeroIsNoTime) {
  Clouds clouds;
  EXPECT_FALSE(clouds.isJump(1050.0, 1050.0));
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(clouds.isJump(0.0, 1051.0));
  EXPECT_FALSE(clouds.isJump(1051.0, 1052.0));
}

}  // namespace
}  // namespace cuboid_mapping_ros
