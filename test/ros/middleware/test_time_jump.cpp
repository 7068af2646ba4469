// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/time_jump.h"

#include <gtest/gtest.h>

namespace cuboid_mapping_ros {
namespace {

/// A detector that tolerates 10 s, fed with seconds.
class TimeJumpDetectorTest : public ::testing::Test {
 protected:
  StampOrder judge(double stamp_s) { return detector_.judge(ros::Time(stamp_s)); }

 private:
  TimeJumpDetector detector_{ros::Duration(10.0)};
};

TEST_F(TimeJumpDetectorTest, CloudsOneAfterTheOtherAreInOrder) {
  for (int i = 0; i < 100; ++i) EXPECT_EQ(judge(1000.0 + i), StampOrder::kInOrder);
}

TEST_F(TimeJumpDetectorTest, TheSecondOldCloudInARowIsAJump) {
  EXPECT_EQ(judge(1050.0), StampOrder::kInOrder);
  EXPECT_EQ(judge(1000.0), StampOrder::kLate);
  EXPECT_EQ(judge(1000.1), StampOrder::kJump);
  EXPECT_EQ(judge(1000.2), StampOrder::kInOrder) << "a jump is told once";
  EXPECT_EQ(judge(1000.1), StampOrder::kInOrder);
}

TEST_F(TimeJumpDetectorTest, ALateCloudNowAndThenIsNoJump) {
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(judge(1000.0 + i), StampOrder::kInOrder);
    EXPECT_EQ(judge(980.0 + i), StampOrder::kLate);
  }
}

TEST_F(TimeJumpDetectorTest, CloudsWithinTheToleranceAreInOrder) {
  EXPECT_EQ(judge(1050.0), StampOrder::kInOrder);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(judge(1041.0), StampOrder::kInOrder);
}

TEST_F(TimeJumpDetectorTest, AStampOfZeroIsNoTime) {
  EXPECT_EQ(judge(1050.0), StampOrder::kInOrder);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(judge(0.0), StampOrder::kInOrder);
  EXPECT_EQ(judge(1051.0), StampOrder::kInOrder);
}

TEST_F(TimeJumpDetectorTest, StampsOfAllTimesCanBeCompared) {
  const double stamps[] = {1.0, 2147483646.0, 2147483649.0, 4294967294.9};
  for (const double newest : stamps) {
    for (const double stamp : stamps) {
      EXPECT_EQ(isOlder(ros::Time(stamp), ros::Time(newest), ros::Duration(10.0)),
                newest - stamp > 10.0)
          << stamp << " and " << newest;
      for (const double next : {newest, stamp, stamp}) EXPECT_NO_THROW((void)judge(next));
    }
  }
}

}  // namespace
}  // namespace cuboid_mapping_ros
