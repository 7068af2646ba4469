// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/history/pose_track.h"

#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace cuboid_mapping {
namespace {

StampedPose poseAt(std::int64_t stamp_ns, double x, double yaw) {
  StampedPose pose{stamp_ns, Eigen::Isometry3d::Identity()};
  pose.T_map_body =
      Eigen::Translation3d(x, 0.0, 0.0) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
  return pose;
}

std::string refusalOf(const std::vector<StampedPose>& poses) {
  try {
    const PoseTrack track(poses);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "taken";
}

TEST(PoseTrack, isLinearInPlaceAndAngleBetweenPosesOfAnyOrder) {
  const PoseTrack track({poseAt(3000, 4.0, 3.0), poseAt(1000, 0.0, -3.0), poseAt(4000, 5.0, 0.0)});
  EXPECT_EQ(track.begin_ns(), 1000);
  EXPECT_EQ(track.end_ns(), 4000);
  EXPECT_EQ(track.size(), 3U);
  const double way = 2.0 * (M_PI - 3.0);  // The shorter way, across pi.
  for (const double ratio : {0.0, 0.25, 0.5, 1.0}) {
    const auto pose = track.at(1000 + std::lround(2000 * ratio));
    EXPECT_NEAR(pose.translation().x(), 4.0 * ratio, 1e-12);
    const Eigen::AngleAxisd expected(-3.0 - way * ratio, Eigen::Vector3d::UnitZ());
    EXPECT_TRUE(pose.linear().isApprox(expected.toRotationMatrix(), 1e-9)) << ratio;
  }
  EXPECT_EQ(track.at(0).matrix(), track.at(1000).matrix()) << "the nearest one";
  EXPECT_EQ(track.at(9000).matrix(), track.at(4000).matrix());
  EXPECT_NEAR(PoseTrack({poseAt(7, 1.0, 0.5)}).at(9).translation().x(), 1.0, 0.0);
}

TEST(PoseTrack, refusesPosesThatAreNoneAndSaysWhich) {
  EXPECT_NE(refusalOf({}).find("there are no poses"), std::string::npos);
  EXPECT_NE(refusalOf({poseAt(1, 0, 0), poseAt(2000000000, 0, 0), poseAt(2000000000, 1, 0)})
                .find("2.000000 s is there twice"),
            std::string::npos);
  EXPECT_NE(refusalOf({poseAt(1, std::nan(""), 0)}).find("not finite"), std::string::npos);
  EXPECT_NE(refusalOf({poseAt(1, std::numeric_limits<double>::infinity(), 0)}).find("not finite"),
            std::string::npos);
  StampedPose stretched = poseAt(1, 0, 0);
  stretched.T_map_body.linear() *= 2.0;
  EXPECT_NE(refusalOf({stretched}).find("no rotation"), std::string::npos);
  stretched.T_map_body.linear() = Eigen::Vector3d(1, 1, -1).asDiagonal();
  EXPECT_NE(refusalOf({stretched}).find("no rotation"), std::string::npos) << "a mirror";
}

TEST(PoseTrack, hasGapsWherePosesAreTooFarApart) {
  const auto s = [](double stamp_s) { return static_cast<std::int64_t>(1e9 * stamp_s); };
  const std::vector<StampedPose> poses{poseAt(s(1), 0, 0), poseAt(s(2), 0, 0), poseAt(s(4), 0, 0)};
  const PoseTrack track(poses, 1.0);
  for (const double stamp_s : {0.5, 1.0, 1.5, 2.0, 4.0, 5.0})
    EXPECT_FALSE(track.findGap(s(stamp_s)));
  ASSERT_TRUE(track.findGap(s(3.9)));
  EXPECT_EQ(track.findGap(s(3.9))->begin_ns, s(2));
  EXPECT_EQ(track.findGap(s(3.9))->end_ns, s(4));
  EXPECT_EQ(track.gaps().size(), 1U);
  EXPECT_TRUE(PoseTrack(poses).gaps().empty());
  EXPECT_THROW(PoseTrack(poses, std::nan("")), std::invalid_argument);
}

}  // namespace
}  // namespace cuboid_mapping
