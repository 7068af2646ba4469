// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/history/map_history.h"

#include "cuboid_mapping/history/kept_clouds.h"
#include "cuboid_mapping/map/mapper.h"
#include "data_sets/scan_dataset.h"
#include "history/random_drive.h"
#include "support/snapshots.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <functional>
#include <limits>
#include <stdexcept>
#include <thread>

namespace cuboid_mapping {
namespace {

using test::Drive;
using test::newPoses;
using test::voxelsOf;

/// Whether all voxels are equal.
bool isSame(const CuboidMap& a, const CuboidMap& b) {
  const std::vector<VoxelBrick> bricks_a = takeSnapshot(a, "").bricks;
  const std::vector<VoxelBrick> bricks_b = takeSnapshot(b, "").bricks;
  return std::equal(bricks_a.begin(), bricks_a.end(), bricks_b.begin(), bricks_b.end(),
                    [](const VoxelBrick& brick, const VoxelBrick& other) {
                      return brick.brick == other.brick && brick.voxels == other.voxels;
                    });
}

/// Moves each cloud of a data set: compares a map of several threads with one from scratch.
TEST(MapHistory, makesTheMapOfRealCloudsFromScratch) {
  const char* folder = std::getenv("CUBOID_DATA_DIR");
  if (folder == nullptr) GTEST_SKIP() << "CUBOID_DATA_DIR is not set";
  const auto dataset = openScanDataset(std::string(folder) + "/kitti_0005_city");
  MapperConfig config;
  config.map.resolution_m = 0.2;
  config.map.threads = 2;
  Mapper first(config);
  Mapper second(config);
  MapHistory history(config.map, 0.0125, {});
  std::vector<StampedPose> poses;
  ObservationConfig observation;
  observation.sensor_model = config.map.sensor_model;
  Eigen::Isometry3d drift = Eigen::Isometry3d::Identity();
  for (std::size_t i = 0; i < dataset->size(); ++i) {
    const auto item = dataset->read(i);
    KeptCloud cloud{static_cast<std::int64_t>(i), item.T_map_sensor, {Scan()}};
    cloud.scans_body.front().points = item.points_sensor;
    roundScan(cloud.scans_body.front(), history.step_m());
    history.add(cloud, observation);
    first.integrate(placeScan(cloud.T_map_body, cloud.scans_body.front()));
    poses.push_back({cloud.stamp_ns, drift * cloud.T_map_body});
    const Eigen::Isometry3d T_map_body = PoseTrack({poses.back()}).at(cloud.stamp_ns);
    second.integrate(placeScan(T_map_body, cloud.scans_body.front()));
    drift = drift * Eigen::Translation3d(0.02, -0.01, 0.003) *
            Eigen::AngleAxisd(0.002, Eigen::Vector3d::UnitZ());
  }
  MapCorrection correction = history.correct(PoseTrack(poses));
  EXPECT_TRUE(isSame(correction.map(), second.map()));
  EXPECT_FALSE(isSame(correction.map(), first.map()));
  EXPECT_GT(correction.maxShift_m(), 0.1);
}

/// 200 corrections of several drives, with edits, locks, sensors, threads, and clouds outside the poses.
TEST(MapHistory, makesTheMapThatIsMadeFromScratchWithTheNewPoses) {
  int num_corrections = 0;
  for (std::uint64_t seed = 0; num_corrections < 200; ++seed) {
    Drive drive(seed, 1 + static_cast<int>(seed % 3));
    for (int i = 0; i < 12; ++i) drive.go();
    for (int i = 0; i < 8; ++i, ++num_corrections) {
      const std::int64_t first = drive.random().integer(-1, 2);
      const std::int64_t count = drive.random().integer(3, 14);
      const PoseTrack track(drive.randomPoses(first, count));
      const auto outside = drive.random().chance(0.5) ? OutsidePoses::kFollow : OutsidePoses::kStay;
      MapCorrection correction = drive.history().correct(track, {outside});
      const MapSnapshot made = takeSnapshot(correction.map(), "");
      const MapSnapshot expected = drive.make(newPoses(track, outside, drive.numClouds()));
      ASSERT_EQ(voxelsOf(made.bricks), voxelsOf(expected.bricks))
          << test::seedNote(static_cast<std::size_t>(num_corrections));
      ASSERT_EQ(made.locked, expected.locked);
      ASSERT_EQ(correction.numClouds(), static_cast<std::size_t>(drive.numClouds()));
    }
  }
}

TEST(MapHistory, makesTheSameMapWithTheSamePoses) {
  Drive drive(11, 2);
  for (int i = 0; i < 20; ++i) drive.go();
  std::vector<StampedPose> poses;
  for (std::int64_t i = 0; i < drive.numClouds(); ++i) {
    poses.push_back({Drive::stampOf(i), Drive::wayAt(i)});
  }
  MapCorrection correction = drive.history().correct(PoseTrack(poses));
  EXPECT_EQ(correction.maxShift_m(), 0.0);
  EXPECT_EQ(correction.numOutside(), 0U);
  EXPECT_EQ(voxelsOf(takeSnapshot(correction.map(), "").bricks),
            voxelsOf(takeSnapshot(drive.map(), "").bricks));
}

/// Clouds that arrive during a correction, and a second correction after the first.
TEST(MapHistory, takesWhatCameMeanwhileAndGoesOnFromTheNewPoses) {
  Drive drive(12, 2);
  for (int i = 0; i < 15; ++i) drive.go();
  const PoseTrack first(drive.randomPoses(0, drive.numClouds()));
  MapCorrection correction = drive.history().correct(first);
  for (int i = 0; i < 6; ++i) drive.go();
  drive.history().finish(correction);
  const auto made = voxelsOf(takeSnapshot(correction.map(), "").bricks);
  MapCorrection again = drive.history().correct(first, {OutsidePoses::kStay});
  EXPECT_EQ(voxelsOf(takeSnapshot(again.map(), "").bricks), made) << "the poses are taken over";
  EXPECT_LT(again.maxShift_m(), 1e-9);
}

/// Old clouds become fixed and stay; younger ones are moved.
TEST(MapHistory, fixesWhatItCannotKeep) {
  HistoryLimits limits;
  limits.max_bytes = 3000;
  Drive drive(13, 1, limits);
  for (int i = 0; i < 40; ++i) drive.go();
  const HistoryFigures figures = drive.history().figures();
  EXPECT_LE(figures.num_bytes, limits.max_bytes);
  EXPECT_GT(figures.num_clouds, 2U);
  EXPECT_GT(figures.num_fixed, 3U);
  EXPECT_EQ(figures.num_fixed + figures.num_clouds, static_cast<std::size_t>(drive.numClouds()));
  const auto first = static_cast<std::int64_t>(figures.num_fixed);
  const PoseTrack track(drive.randomPoses(first - 3, drive.numClouds() - first + 4));
  MapCorrection correction = drive.history().correct(track, {OutsidePoses::kStay});
  const auto all = newPoses(track, OutsidePoses::kStay, drive.numClouds());
  const MapSnapshot expected = drive.make([&](const KeptCloud& cloud) {
    return cloud.stamp_ns < Drive::stampOf(first) ? cloud.T_map_body : all(cloud);
  });
  EXPECT_EQ(voxelsOf(takeSnapshot(correction.map(), "").bricks), voxelsOf(expected.bricks));
}

TEST(MapHistory, isAsBeforeWhenACorrectionIsGivenUp) {
  Drive drive(13, 2);
  for (int i = 0; i < 15; ++i) drive.go();
  const PoseTrack track(drive.randomPoses(0, drive.numClouds()));
  int num_told = 0;
  const auto give_up = [&num_told](std::uint64_t /*done*/, std::uint64_t /*all*/) {
    if (++num_told == 5) throw std::runtime_error("given up");
  };
  EXPECT_THROW((void)drive.history().correct(track, {}, give_up), std::runtime_error);
  MapCorrection correction = drive.history().correct(track);
  drive.history().finish(correction);
  const MapSnapshot expected =
      drive.make(newPoses(track, OutsidePoses::kFollow, drive.numClouds()));
  EXPECT_EQ(voxelsOf(takeSnapshot(correction.map(), "").bricks), voxelsOf(expected.bricks));
}

TEST(MapHistory, beginsWithAMapThatStays) {
  Drive drive(15, 1);
  for (int i = 0; i < 10; ++i) drive.go();
  const auto before = voxelsOf(takeSnapshot(drive.map(), "").bricks);
  drive.history().restart(drive.map());
  EXPECT_THROW((void)drive.history().correct(PoseTrack({{0, Eigen::Isometry3d::Identity()}})),
               std::invalid_argument);
  KeptCloud cloud;
  cloud.stamp_ns = 5;
  cloud.scans_body.emplace_back();
  drive.history().add(cloud, {});
  MapCorrection correction =
      drive.history().correct(PoseTrack({{5, Eigen::Isometry3d::Identity()}}));
  EXPECT_EQ(voxelsOf(takeSnapshot(correction.map(), "").bricks), before);
  drive.history().restart(drive.map());
  EXPECT_THROW(drive.history().finish(correction), std::runtime_error) << "replaced meanwhile";
}

TEST(MapHistory, refusesPosesOfAnotherTime) {
  Drive drive(16, 1);
  for (int i = 0; i < 5; ++i) drive.go();
  try {
    (void)drive.history().correct(PoseTrack({{1000000000, Eigen::Isometry3d::Identity()}}));
    FAIL() << "taken";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("1.000 to 1.000 s, the clouds of 1600000000.000 to"),
              std::string::npos)
        << error.what();
  }
}

TEST(MapHistory, refusesPosesBeyondAllVoxels) {
  Drive drive(17, 1);
  for (int i = 0; i < 5; ++i) drive.go();
  const Eigen::Isometry3d far(Eigen::Translation3d(1e20, 0.0, 0.0));
  EXPECT_THROW((void)drive.history().begin(PoseTrack({{Drive::stampOf(0), far}})),
               std::invalid_argument);
}

TEST(MapHistory, followsThresholdsThatChangeBetweenTwoClouds) {
  MapConfig growth;
  growth.fusion = FusionKind::kGrowth;
  const CuboidMap start(growth);
  MapHistory history(growth, 0.01, {});
  history.restart(start);
  KeptCloud cloud;
  cloud.scans_body.resize(1);
  cloud.scans_body[0].points = {{1.0F, 0.0F, 0.0F}};
  ObservationConfig config;
  for (const double alpha_max : {0.97, 0.8}) {
    config.sensor_model.alpha_max = alpha_max;
    for (int i = 0; i < 5; ++i, ++cloud.stamp_ns) history.add(cloud, config);
    MapCorrection correction = history.correct(PoseTrack(std::vector<StampedPose>(1)));
    EXPECT_EQ(correction.map().sensorModel().max(), SensorModel(config.sensor_model).max());
    EXPECT_EQ(correction.map().voxels().logOddsAt({20, 0, 0}), correction.map().sensorModel().max())
        << "the map's log-odds are the threshold, so that growth takes the voxel for stable";
  }
}

TEST(MapHistory, refusesNumbersThatAreNone) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double wrong : {nan, 0.0, -1.0, std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(MapHistory({}, wrong, {}), std::invalid_argument);
  }
  MapHistory history({}, 0.01, {});
  EXPECT_THROW((void)history.findShift_m(PoseTrack(std::vector<StampedPose>(1)), nan),
               std::invalid_argument);
  const auto expect_refusal = [&](auto change) {
    ObservationConfig config;
    change(config);
    EXPECT_THROW(history.add({}, config), std::invalid_argument);
  };
  expect_refusal([&](ObservationConfig& config) { config.ranges.max_range_m = nan; });
  expect_refusal([&](ObservationConfig& config) { config.ranges.end_margin_m = nan; });
  expect_refusal([&](ObservationConfig& config) { config.limits.min_range_m = nan; });
  expect_refusal([&](ObservationConfig& config) { config.sensor_model.hit = nan; });
  for (const double wrong : {nan, 2.0}) {
    KeptCloud cloud;
    cloud.T_map_body.linear()(0, 0) = wrong;
    EXPECT_THROW(history.add(cloud, {}), std::invalid_argument);
  }
  EXPECT_EQ(history.numAdded(), 0U);
}

/// One thread adds clouds while another corrects: nothing is lost.
TEST(MapHistory, isCorrectedWhileCloudsGoOn) {
  Drive drive(17, 1);
  for (int i = 0; i < 10; ++i) drive.go();
  const PoseTrack track(drive.randomPoses(0, 10));
  std::atomic<bool> is_done{false};
  std::thread clouds([&] {
    for (int i = 0; i < 50; ++i) drive.go();
    is_done = true;
  });
  MapCorrection correction = drive.history().correct(track, {OutsidePoses::kStay});
  while (!is_done) (void)drive.history().catchUp(correction);
  clouds.join();
  drive.history().finish(correction);
  const auto expected = drive.make(newPoses(track, OutsidePoses::kStay, drive.numClouds()));
  EXPECT_EQ(voxelsOf(takeSnapshot(correction.map(), "").bricks), voxelsOf(expected.bricks));
}

}  // namespace
}  // namespace cuboid_mapping
