// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/path_follower.h"

#include <gtest/gtest.h>

#include <cmath>

namespace cuboid_mapping {
namespace {

using Eigen::Vector3d;

double headingOf(const PathFollower& follower) {
  const Vector3d forward = follower.pose().linear() * Vector3d::UnitX();
  return std::atan2(forward.y(), forward.x());
}

PathFollower makeFollower() {
  return PathFollower(Eigen::Isometry3d(Eigen::Translation3d(1.0, 2.0, 0.5)));
}

TEST(PathFollower, goesToTheFirstWaypointAndAroundCorners) {
  PathFollower follower = makeFollower();
  follower.setPath({{4.0, 2.0}, {4.0, 6.0}});
  follower.advance(2.0);
  EXPECT_TRUE(follower.pose().translation().isApprox(Vector3d(3.0, 2.0, 0.5)));
  EXPECT_NEAR(headingOf(follower), 0.0, 1e-12);
  follower.advance(2.5);
  EXPECT_TRUE(follower.pose().translation().isApprox(Vector3d(4.0, 3.5, 0.5)));
  EXPECT_NEAR(headingOf(follower), M_PI / 2, 1e-12);
}

TEST(PathFollower, staysAtTheEndWithItsHeading) {
  PathFollower follower = makeFollower();
  follower.setPath({{1.0, 2.0}, {1.0, 1.0}});
  follower.advance(100.0);
  follower.advance(1.0);
  EXPECT_TRUE(follower.pose().translation().isApprox(Vector3d(1.0, 1.0, 0.5)));
  EXPECT_NEAR(headingOf(follower), -M_PI / 2, 1e-12);
}

TEST(PathFollower, leavesItsPathForAnotherOneAndStopsWithoutWaypoints) {
  PathFollower follower = makeFollower();
  follower.advance(1.0);
  EXPECT_TRUE(follower.pose().translation().isApprox(Vector3d(1.0, 2.0, 0.5)));
  follower.setPath({{9.0, 2.0}});
  follower.advance(1.0);
  follower.setPath({{2.0, 9.0}});
  follower.advance(1.0);
  EXPECT_TRUE(follower.pose().translation().isApprox(Vector3d(2.0, 3.0, 0.5)));
  follower.setPath({});
  follower.advance(1.0);
  EXPECT_TRUE(follower.pose().translation().isApprox(Vector3d(2.0, 3.0, 0.5)));
}

}  // namespace
}  // namespace cuboid_mapping
