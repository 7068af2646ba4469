// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/cloud_checks.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

constexpr double kUnlimited_m = std::numeric_limits<double>::infinity();
constexpr RangeLimits kNoLimits{kUnlimited_m, kUnlimited_m};

/// The warnings about one cloud, in one text.
std::string warningsOf(const std::vector<Eigen::Vector3f>& points, bool is_depth,
                       const RangeLimits& limits = kNoLimits) {
  CloudChecks checks(is_depth, limits);
  CloudPoints cloud;
  cloud.points = points;
  checks.note(cloud, Eigen::Vector3d::Zero());
  std::string all;
  for (const std::string& warning : checks.takeWarnings()) all += warning + '\n';
  return all;
}

/// Pixels with a slanted floor from 1 m up to `floor_end_m`, and as many with one depth.
std::vector<Eigen::Vector3f> seeFloorAnd(float depth_m, float floor_end_m) {
  constexpr int kPixels = 200;
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < kPixels; ++i) {
    const float share = static_cast<float>(i) / kPixels;
    points.emplace_back(share, 1.0F, 1.0F + share * (floor_end_m - 1.0F));
    points.emplace_back(share, 0.0F, depth_m);
  }
  return points;
}

bool isOneRangeNamed(const std::string& said) {
  return said.find("have one depth") != std::string::npos ||
         said.find("have one range") != std::string::npos;
}

TEST(CloudChecks, AFarClipOfADepthCameraIsNamedButNoWall) {
  const std::string clip = warningsOf(seeFloorAnd(7.5F, 4.0F), true);
  EXPECT_NE(clip.find("50 % of the points have one depth, 7.5 m"), std::string::npos) << clip;
  EXPECT_FALSE(isOneRangeNamed(warningsOf(seeFloorAnd(4.0F, 4.0F), true))) << "a wall on the floor";
  EXPECT_FALSE(isOneRangeNamed(warningsOf(seeFloorAnd(2.0F, 4.0F), true))) << "a box on the floor";
  EXPECT_FALSE(
      isOneRangeNamed(warningsOf(std::vector<Eigen::Vector3f>(300, {0.0F, 0.0F, 2.0F}), true)))
      << "a wall that fills the view";
}

TEST(CloudChecks, OneRangeOfALidarIsNamedButNoWallAcrossTheView) {
  std::vector<Eigen::Vector3f> wall;
  for (int i = 0; i < 300; ++i) wall.emplace_back(3.0F, 0.02F * static_cast<float>(i), 0.0F);
  EXPECT_FALSE(isOneRangeNamed(warningsOf(wall, false)));
  wall.insert(wall.end(), 50, {0.0F, -2.5F, 0.0F});
  EXPECT_TRUE(isOneRangeNamed(warningsOf(wall, false)));
}

TEST(CloudChecks, PointsTooFarForBeamsAreNamedWithTheCure) {
  const std::vector<Eigen::Vector3f> utm(200, {466880.0F, 5572094.0F, 330.0F});
  for (const double max_range_m : {kUnlimited_m, 50.0}) {
    const std::string said = warningsOf(utm, false, {max_range_m, 6553.5});
    EXPECT_NE(said.find("100 % of the points are more than 6553.5 m"), std::string::npos) << said;
    EXPECT_NE(said.find("sensor_frame"), std::string::npos) << said;
    EXPECT_EQ(said.find("Raise it"), std::string::npos) << said;
    EXPECT_FALSE(isOneRangeNamed(said)) << said;
  }
}

TEST(CloudChecks, AChangeOfParametersRepeatsNoWarningButThatOfAnotherMaxRange) {
  CloudPoints cloud;
  for (int i = 0; i < 300; ++i)
    cloud.points.emplace_back(30.0F + static_cast<float>(i), 0.0F, 0.0F);
  const auto warn = [&](CloudChecks& checks) {
    checks.note(cloud, Eigen::Vector3d::Zero());
    checks.noteFrame("map", "map");
    return checks.takeWarnings().size();
  };
  CloudChecks first(false, {20.0, kUnlimited_m});
  EXPECT_EQ(warn(first), 3U) << "the frame, the unit, max_range";
  CloudChecks same(false, {20.0, kUnlimited_m});
  same.goOnFrom(first);
  EXPECT_EQ(warn(same), 0U);
  CloudChecks other(false, {10.0, kUnlimited_m});
  other.goOnFrom(same);
  EXPECT_EQ(warn(other), 1U);
}

TEST(CloudChecks, CloudsInAFrameThatIsNoSensorsAreNamedOnce) {
  CloudChecks checks(false, kNoLimits);
  checks.noteFrame("lidar", "site");
  EXPECT_TRUE(checks.takeWarnings().empty());
  checks.noteFrame("/site", "site");
  const std::vector<std::string> warnings = checks.takeWarnings();
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("set sensor_frame"), std::string::npos) << warnings[0];
  checks.noteFrame("odom", "site");
  EXPECT_TRUE(checks.takeWarnings().empty());
}

}  // namespace
}  // namespace cuboid_mapping_ros
