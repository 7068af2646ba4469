// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/scan.h"

#include "cuboid_mapping/scan/scan_update.h"
#include "support/random_shapes.h"
#include "support/voxel_map.h"

#include <gtest/gtest.h>

#include <cmath>

namespace cuboid_mapping {
namespace {

Eigen::Isometry3d poseAt(const Eigen::Vector3d& position_map, double yaw_rad = 0.0) {
  Eigen::Isometry3d T_map_cloud = Eigen::Isometry3d::Identity();
  T_map_cloud.translation() = position_map;
  T_map_cloud.rotate(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()));
  return T_map_cloud;
}

TEST(MakeScan, hasNoAnchorNearTheOriginOfTheMap) {
  const Eigen::Vector3d position(511.0, -511.0, 3.0);
  const Scan scan = makeScan(poseAt(position), position, {{1.0F, 2.0F, 3.0F}});
  EXPECT_EQ(scan.anchor_map, Eigen::Vector3d::Zero());
  EXPECT_EQ(scan.origin, Eigen::Vector3f(511.0F, -511.0F, 3.0F));
  ASSERT_EQ(scan.points.size(), 1U);
  EXPECT_EQ(scan.points[0], Eigen::Vector3f(512.0F, -509.0F, 6.0F));
}

TEST(MakeScan, takesTheNearestMultipleOf1024MetresForTheAnchor) {
  const Eigen::Vector3d position(513.0, -1537.0, 1e6);
  const Scan scan = makeScan(poseAt(position), position, {{1.0F, 2.0F, 3.0F}});
  EXPECT_EQ(scan.anchor_map, Eigen::Vector3d(1024.0, -2048.0, 977.0 * 1024.0));
  EXPECT_EQ(scan.origin, Eigen::Vector3f(-511.0F, 511.0F, -448.0F));
  EXPECT_EQ(scan.points[0], Eigen::Vector3f(-510.0F, 513.0F, -445.0F));
}

TEST(MakeScan, startsBeamsWhereTheCallerSaysAndNotInTheFrameOfTheCloud) {
  const Scan scan = makeScan(poseAt({10.0, 0.0, 0.0}), {1.0, 2.0, 3.0}, {{1.0F, 0.0F, 0.0F}});
  EXPECT_EQ(scan.origin, Eigen::Vector3f(1.0F, 2.0F, 3.0F));
  EXPECT_EQ(scan.points[0], Eigen::Vector3f(11.0F, 0.0F, 0.0F));
}

TEST(MakeScan, takesPointsAndNoReturnsFromTheCloudToTheMap) {
  test::Random random(1);
  std::size_t num_cases = 0;
  for (const double distance_m : {0.0, 400.0, 1e4, 1e6, -1e6}) {
    for (int i = 0; i < 500; ++i, ++num_cases) {
      const Eigen::Vector3d position =
          Eigen::Vector3d(distance_m, -distance_m, 0.0) + test::randomPoint(random, 100.0);
      const Eigen::Isometry3d T_map_cloud = poseAt(position, random.real(-3.0, 3.0));
      const Eigen::Vector3f point = test::randomPoint(random, 100.0).cast<float>();
      const Eigen::Vector3f end = test::randomPoint(random, 100.0).cast<float>();
      const Scan scan = makeScan(T_map_cloud, position, {point, point}, {end});
      ASSERT_EQ(scan.points.size(), 2U);
      ASSERT_EQ(scan.no_returns.size(), 1U);
      const auto toMap = [&](const Eigen::Vector3f& p) {
        return Eigen::Vector3d(scan.anchor_map + p.cast<double>());
      };
      ASSERT_LT((toMap(scan.origin) - position).norm(), 1e-4) << test::seedNote(num_cases);
      ASSERT_LT((toMap(scan.points[1]) - T_map_cloud * point.cast<double>()).norm(), 2e-4)
          << test::seedNote(num_cases);
      ASSERT_LT((toMap(scan.no_returns[0]) - T_map_cloud * end.cast<double>()).norm(), 2e-4)
          << test::seedNote(num_cases);
      for (int axis = 0; axis < 3; ++axis) {
        ASSERT_EQ(std::fmod(scan.anchor_map[axis], 1024.0), 0.0);
        ASSERT_LE(std::abs(scan.origin[axis]), 512.0F);
      }
    }
  }
  EXPECT_EQ(num_cases, 2500U);
}

TEST(MakeScan, givesTheSameUpdateAThousandKilometresAwayShifted) {
  test::Random random(2);
  const Grid grid(0.05);
  ScanUpdater near_updater(grid, 12.0);
  ScanUpdater far_updater(grid, 12.0);
  const Eigen::Vector3d offset(977.0 * 1024.0, 976.0 * 1024.0, 0.0);  // About 1e6 m.
  const Cell shift{977 * 20480, 976 * 20480, 0};
  for (std::size_t i = 0; i < 20; ++i) {
    // Multiples of 2^-16 m, so that adding the offset rounds nothing.
    const Eigen::Vector3d position =
        (test::randomPoint(random, 400.0) * 65536.0).array().round().matrix() / 65536.0;
    const double yaw_rad = random.real(-3.0, 3.0);
    std::vector<Eigen::Vector3f> points;
    std::vector<Eigen::Vector3f> ends;
    for (int p = 0; p < 20; ++p) points.push_back(test::randomPoint(random, 10.0).cast<float>());
    for (int p = 0; p < 5; ++p) ends.push_back(test::randomPoint(random, 10.0).cast<float>());

    const Scan near_scan = makeScan(poseAt(position, yaw_rad), position, points, ends);
    const Scan far_scan =
        makeScan(poseAt(position + offset, yaw_rad), position + offset, points, ends);
    ASSERT_EQ(far_scan.anchor_map, offset);
    test::ObservedCells expected;
    for (const auto& [cell, is_hit] : test::toObservedCells(near_updater.compute(near_scan))) {
      expected[cell + shift] = is_hit;
    }
    ASSERT_GT(expected.size(), 500U);
    ASSERT_EQ(test::toObservedCells(far_updater.compute(far_scan)), expected) << test::seedNote(i);
  }
}

}  // namespace
}  // namespace cuboid_mapping
