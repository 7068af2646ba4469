// SPDX-License-Identifier: BSD-3-Clause
// Runs the tests of the display that test_rviz_display.py names with --gtest_filter.
#include <gtest/gtest.h>
#include <ros/init.h>
#include <ros/node_handle.h>

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_displays", ros::init_options::AnonymousName);
  const ros::NodeHandle keeps_ros_running;
  const int status = RUN_ALL_TESTS();
  return testing::UnitTest::GetInstance()->test_to_run_count() > 0 ? status : 1;
}
