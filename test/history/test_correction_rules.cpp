// SPDX-License-Identifier: BSD-3-Clause
// Corrections that move only a part of the map, and edits that move.
#include "cuboid_mapping/history/map_history.h"
#include "history/random_drive.h"
#include "support/snapshots.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace cuboid_mapping {
namespace {

using test::cellsOf;
using test::Drive;
using test::newPoses;
using test::voxelsOf;

/// 200 corrections of a few clouds each.
TEST(CorrectionRule, makesTheSameMapWhereOnlyAPartMoves) {
  int num_corrections = 0;
  for (std::uint64_t seed = 50; num_corrections < 200; ++seed) {
    Drive drive(seed, 1 + static_cast<int>(seed % 3));
    for (int i = 0; i < 35; ++i) drive.go();
    for (int i = 0; i < 8; ++i, ++num_corrections) {
      const std::int64_t first = drive.random().integer(0, static_cast<int>(drive.numClouds()) - 6);
      const PoseTrack track(drive.randomPoses(first, drive.random().integer(1, 5)));
      const auto outside = drive.random().chance(0.9) ? OutsidePoses::kStay : OutsidePoses::kFollow;
      MapCorrection correction = drive.history().begin(track, {outside});
      if (i % 2 == 1) drive.go();  // Arrives meanwhile.
      drive.history().catchUp(correction);
      const MapSnapshot made = takeSnapshot(correction.map(), "");
      const MapSnapshot expected = drive.make(newPoses(track, outside, drive.numClouds()));
      ASSERT_EQ(voxelsOf(made.bricks), voxelsOf(expected.bricks))
          << test::seedNote(static_cast<std::size_t>(num_corrections));
      ASSERT_EQ(made.locked, expected.locked);
    }
  }
}

/// A cloud that moves by less than the tolerance keeps its pose.
TEST(CorrectionRule, leavesCloudsWithinTheTolerance) {
  Drive drive(70, 1);
  for (int i = 0; i < 40; ++i) drive.go();
  std::vector<StampedPose> poses;
  for (std::int64_t i = 0; i < drive.numClouds(); ++i) {
    const double shift_m = i < drive.numClouds() - 3 ? 0.01 : 0.5;
    poses.push_back({Drive::stampOf(i), Eigen::Translation3d(shift_m, 0.0, 0.0) * Drive::wayAt(i)});
  }
  const PoseTrack track(poses);
  MapCorrection correction = drive.history().correct(track, {OutsidePoses::kFollow, 0.02});
  const MapSnapshot expected = drive.make([&](const KeptCloud& cloud) {
    const bool stays = cloud.stamp_ns < Drive::stampOf(drive.numClouds() - 3);
    return stays ? cloud.T_map_body : track.at(cloud.stamp_ns);
  });
  EXPECT_EQ(voxelsOf(takeSnapshot(correction.map(), "").bricks), voxelsOf(expected.bricks));
  EXPECT_THROW((void)drive.history().begin(track, {OutsidePoses::kFollow, -1.0}),
               std::invalid_argument);
}

/// Between poses that are far apart in time, clouds move as the body does at these, and stay on their way.
TEST(CorrectionRule, doesNotInterpolatePosesAcrossAGap) {
  constexpr std::int64_t kPeriodNs = 100000000;
  MapHistory history(MapConfig{}, 0.02, HistoryLimits{});
  const Eigen::Isometry3d motion(Eigen::Translation3d(0.0, 0.0, 0.5));
  std::vector<StampedPose> poses;
  for (std::int64_t i = 0; i < 20; ++i) {
    KeptCloud cloud;
    cloud.stamp_ns = kPeriodNs * (i + 1);
    cloud.T_map_body = Eigen::AngleAxisd(0.1 * static_cast<double>(i), Eigen::Vector3d::UnitZ()) *
                       Eigen::Translation3d(5.0, 0.0, 0.0);
    cloud.scans_body = {Scan()};
    history.add(cloud, {});
    if (i < 5 || i >= 15) poses.push_back({cloud.stamp_ns, motion * cloud.T_map_body});
  }
  const PoseTrack track(poses, 0.15);
  EXPECT_NEAR(history.correct(track).maxShift_m(), 0.5, 1e-6);
  EXPECT_NEAR(history.findShift_m(track, kShiftDistance_m).value(), 0.5, 1e-6);
  const PoseTrack ends({{poses.front().stamp_ns - 1, poses.front().T_map_body},
                        {poses.back().stamp_ns + 1, poses.back().T_map_body}},
                       0.15);
  EXPECT_NEAR(history.findShift_m(ends, kShiftDistance_m).value(), 0.5, 1e-6) << "all in one gap";
  const PoseTrack later({{poses.back().stamp_ns + 1, poses.back().T_map_body}});
  EXPECT_FALSE(history.findShift_m(later, kShiftDistance_m));
  EXPECT_GT(history.correct(PoseTrack(poses)).maxShift_m(), 0.7) << "on the chord of the curve";
}

TEST(CorrectionRule, movesALockAloneByTheShiftOfItsOwnCenter) {
  const MapConfig config = Drive::makeConfig(1);
  CuboidMap map(config);
  MapHistory history(config, 0.02, {});
  KeptCloud cloud;
  cloud.stamp_ns = Drive::stampOf(0);
  history.add(cloud, {});
  map.lock({{50, 50, 0}, {52, 52, 2}});
  history.addEdit({}, map);
  Eigen::Isometry3d turned = Eigen::Isometry3d::Identity();
  turned.rotate(Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ()));
  MapCorrection correction =
      history.correct(PoseTrack({{cloud.stamp_ns, turned}}), {OutsidePoses::kFollow, 0.0, true});
  const std::vector<CellBox> expected{{{-52, 50, 0}, {-50, 52, 2}}};
  EXPECT_EQ(correction.map().lockedBoxes(), expected);
}

/// Edits and locks move with the cloud before them; a second correction starts from their new places.
TEST(CorrectionRule, movesEditsAlong) {
  int num_locked = 0;
  for (std::uint64_t seed = 90; seed < 110; ++seed) {
    Drive drive(seed, 1 + static_cast<int>(seed % 2));
    drive.goCloud();
    for (int i = 0; i < 15; ++i) drive.go();
    const PoseTrack track(drive.randomPoses(-1, drive.numClouds() + 6));
    const CorrectionRule rule{OutsidePoses::kFollow, 0.0, true};
    MapCorrection correction = drive.history().begin(track, rule);
    for (int i = 0; i < 3; ++i) drive.go();
    drive.history().finish(correction);
    const MapSnapshot made = takeSnapshot(correction.map(), "");
    const MapSnapshot expected = drive.make(newPoses(track, rule.outside, drive.numClouds()), true);
    ASSERT_EQ(voxelsOf(made.bricks), voxelsOf(expected.bricks)) << test::seedNote(seed);
    ASSERT_EQ(cellsOf(made.locked), cellsOf(expected.locked));
    num_locked += made.locked.empty() ? 0 : 1;
    MapCorrection again = drive.history().correct(track, {OutsidePoses::kStay});
    ASSERT_EQ(voxelsOf(takeSnapshot(again.map(), "").bricks), voxelsOf(made.bricks));
    ASSERT_EQ(cellsOf(again.map().lockedBoxes()), cellsOf(made.locked));
  }
  EXPECT_GT(num_locked, 5);
}

}  // namespace
}  // namespace cuboid_mapping
