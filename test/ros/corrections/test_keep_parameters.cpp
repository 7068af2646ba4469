// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/corrections/pose_corrections.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

NodeParameters keeping() {
  NodeParameters parameters;
  parameters.keep.memory_mb = 100;
  return parameters;
}

std::vector<ParameterError> check(const NodeParameters& parameters) {
  return PoseCorrections::check({parameters, {}, {}});
}

/// Expects one error, which names the parameter.
void expectRefused(const NodeParameters& parameters, const std::string& key) {
  const auto errors = check(parameters);
  ASSERT_EQ(errors.size(), 1U) << key;
  EXPECT_EQ(errors.front().key, "keep_clouds/memory");
  EXPECT_NE(errors.front().message.find("does not go with " + key), std::string::npos)
      << errors.front().message;
}

TEST(KeepParameters, GoWithAMapThatIsWhatCloudsAndEditsMakeOfIt) {
  EXPECT_TRUE(check(keeping()).empty());
  NodeParameters window = keeping();
  window.window.frame_id = "base";
  EXPECT_TRUE(check(window).empty());
  window.window.config.outside = cuboid_mapping::OutsideWindow::kForget;
  expectRefused(window, "this window/outside");
  window.keep.memory_mb = 0;
  EXPECT_TRUE(check(window).empty());

  NodeParameters forgetting = keeping();
  forgetting.source.forget_after_s = 60.0;
  expectRefused(forgetting, "forget_after");
  NodeParameters moving = keeping();
  moving.moving_points = MovingPoints::kLeaveOut;
  expectRefused(moving, "moving_points: leave_out");
  NodeParameters merging = keeping();
  merging.robots = {"/robot1"};
  expectRefused(merging, "merge/robots");
}

}  // namespace
}  // namespace cuboid_mapping_ros
