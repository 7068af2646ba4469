// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/history/map_history.h"

#include "cuboid_mapping/history/kept_clouds.h"
#include "cuboid_mapping/io/scan_dataset.h"
#include "cuboid_mapping/map/mapper.h"
#include "support/random.h"
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

using test::Random;
using test::voxelsOf;

constexpr std::int64_t kPeriodNs = 100000000;

Eigen::Isometry3d randomPose(Random& random, double size_m) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(random.real(-size_m, size_m), random.real(-size_m, size_m),
                                       random.real(-0.5, 0.5));
  pose.linear() = (Eigen::AngleAxisd(random.real(-3.0, 3.0), Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(random.real(-0.1, 0.1), Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  return pose;
}

/// A cloud or an edit, as the test remembers it.
struct Step {
  KeptCloud cloud;
  ObservationConfig config;
  bool is_edit = false;
  CellBox box{};
  bool locks = false;
};

/// A map that clouds and edits have made, and its history.
class Drive {
 public:
  Drive(std::uint64_t seed, int threads, const HistoryLimits& limits = {})
      : random_(seed),
        config_(makeConfig(threads)),
        map_(config_),
        history_(config_, 0.02, limits) {
    configs_[1].sensor_model.hit = 0.65;
    configs_[1].ranges.max_range_m = 4.0;
    configs_[1].limits.min_range_m = 0.5;
    configs_[1].limits.crop_map = {Eigen::Vector3d(-20, -20, -1), Eigen::Vector3d(20, 20, 1.5)};
    configs_[2].marks = false;
    configs_[3].clears = false;
  }

  static MapConfig makeConfig(int threads) {
    MapConfig config;
    config.resolution_m = 0.2;
    config.threads = threads;
    return config;
  }

  /// A cloud of the next stamp, or now and then an edit.
  void go() {
    Step step;
    step.is_edit = random_.chance(0.15);
    if (step.is_edit) {
      const Cell least{random_.integer(-30, 20), random_.integer(-30, 20), random_.integer(-8, 4)};
      step.box = {least, least + Cell{random_.integer(1, 12), random_.integer(1, 12), 6}};
      step.locks = random_.chance(0.5);
    } else {
      step.cloud = makeCloud();
      step.config = configs_[random_.index(4)];
    }
    put(step, step.cloud.T_map_body, map_);
    if (step.is_edit) {
      history_.addEdit(step.box, map_);
    } else {
      history_.add(step.cloud, step.config);
    }
    steps_.push_back(step);
  }

  /// The map from scratch. @param new_pose  Of a cloud, or nothing to keep its own.
  [[nodiscard]] MapSnapshot make(
      const std::function<Eigen::Isometry3d(const KeptCloud&)>& new_pose) const {
    CuboidMap map(makeConfig(1));
    for (const Step& step : steps_) put(step, new_pose(step.cloud), map);
    return takeSnapshot(map, "");
  }

  /// As the test understands what happens to a map.
  static void put(const Step& step, const Eigen::Isometry3d& T_map_body, CuboidMap& map) {
    if (step.is_edit) {
      if (step.locks) {
        map.lock(step.box);
      } else {
        map.unlock(step.box);
      }
      map.replace(step.box, std::vector<UniformBox>{{step.box, step.locks ? 1.0F : -1.0F}});
      return;
    }
    MapperConfig config;
    config.map = makeConfig(1);
    config.max_range_m = step.config.ranges.max_range_m;
    Mapper mapper(config);
    Scan scan = placeScan(T_map_body, step.cloud.scans_body.front());
    filterScan(scan, step.config.limits);
    ScanUpdate update = mapper.walk(scan);
    for (BrickUpdate& brick : update.bricks) {
      if (!step.config.clears) brick.misses = {};
      if (!step.config.marks) {
        brick.misses = brick.misses.without(brick.hits);
        brick.hits = {};
      }
    }
    map.apply(update, SensorModel(step.config.sensor_model, Environment::kDynamic));
  }

  /// Poses of every second cloud, moved at random. @param count  Of the clouds, from the first on.
  [[nodiscard]] std::vector<StampedPose> randomPoses(std::int64_t first, std::int64_t count) {
    std::vector<StampedPose> poses;
    const Eigen::Isometry3d drift = randomPose(random_, 2.0);
    for (std::int64_t i = first; i < first + count; i += random_.integer(1, 3)) {
      poses.push_back({stampOf(i) + random_.integer(-20, 20) * 1000000, drift * wayAt(i)});
    }
    const std::int64_t last = first + count;
    poses.push_back({stampOf(last) + 30000000, drift * wayAt(last)});
    return poses;
  }

  static std::int64_t stampOf(std::int64_t number) {
    return 1600000000000000000 + kPeriodNs * number;
  }
  static Eigen::Isometry3d wayAt(std::int64_t number) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Eigen::Vector3d(0.6 * number, 0.2 * number, 0.0);
    pose.linear() = Eigen::AngleAxisd(0.2 * number, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    return PoseTrack({{0, pose}}).at(0);
  }

  [[nodiscard]] std::int64_t numClouds() const { return num_clouds_; }
  MapHistory& history() { return history_; }
  CuboidMap& map() { return map_; }
  Random& random() { return random_; }

 private:
  KeptCloud makeCloud() {
    KeptCloud cloud;
    cloud.stamp_ns = stampOf(num_clouds_);
    cloud.T_map_body = wayAt(num_clouds_++);
    Scan& scan = cloud.scans_body.emplace_back();
    scan.origin = {0.1F, 0.0F, 0.5F};
    for (int i = 0; i < 60; ++i) {
      const auto coordinate = [&](double size) {
        return static_cast<float>(random_.real(-size, size));
      };
      scan.points.emplace_back(coordinate(6.0), coordinate(6.0), coordinate(1.5));
      if (i % 8 == 0) scan.no_returns.emplace_back(coordinate(6.0), coordinate(6.0), 1.0F);
    }
    roundScan(scan, 0.02);
    return cloud;
  }

  Random random_;
  MapConfig config_;
  CuboidMap map_;
  MapHistory history_;
  ObservationConfig configs_[4];
  std::vector<Step> steps_;
  std::int64_t num_clouds_ = 0;
};

/// Whether all voxels are equal.
bool isSame(const CuboidMap& a, const CuboidMap& b) {
  const std::vector<VoxelBrick> bricks_a = takeSnapshot(a, "").bricks;
  const std::vector<VoxelBrick> bricks_b = takeSnapshot(b, "").bricks;
  return std::equal(bricks_a.begin(), bricks_a.end(), bricks_b.begin(), bricks_b.end(),
                    [](const VoxelBrick& brick, const VoxelBrick& other) {
                      return brick.brick == other.brick && brick.voxels == other.voxels;
                    });
}

/// Clouds of a data set, each moved: a map of several threads against one from scratch.
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

/// Where a cloud is with new poses, by the words of OutsidePoses.
std::function<Eigen::Isometry3d(const KeptCloud&)> newPoses(const PoseTrack& track,
                                                            OutsidePoses outside,
                                                            std::int64_t num_clouds) {
  std::vector<StampedPose> old;
  for (std::int64_t i = 0; i < num_clouds; ++i) old.push_back({Drive::stampOf(i), Drive::wayAt(i)});
  return [=](const KeptCloud& cloud) -> Eigen::Isometry3d {
    const std::int64_t nearest =
        std::min(std::max(cloud.stamp_ns, track.begin_ns()), track.end_ns());
    if (nearest == cloud.stamp_ns) return track.at(nearest);
    if (outside == OutsidePoses::kStay) return cloud.T_map_body;
    return track.at(nearest) * PoseTrack(old).at(nearest).inverse() * cloud.T_map_body;
  };
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

/// 200 corrections of a few clouds each: bricks that these do not touch are taken over.
TEST(MapHistory, makesTheSameMapWhereOnlyAPartMoves) {
  int num_corrections = 0;
  int num_local = 0;
  for (std::uint64_t seed = 50; num_corrections < 200; ++seed) {
    Drive drive(seed, 1 + static_cast<int>(seed % 3));
    for (int i = 0; i < 35; ++i) drive.go();
    for (int i = 0; i < 8; ++i, ++num_corrections) {
      const std::int64_t first = drive.random().integer(0, static_cast<int>(drive.numClouds()) - 6);
      const PoseTrack track(drive.randomPoses(first, drive.random().integer(1, 5)));
      const auto outside = drive.random().chance(0.9) ? OutsidePoses::kStay : OutsidePoses::kFollow;
      MapCorrection correction = drive.history().begin(track, {outside}, &drive.map());
      if (i % 2 == 1) drive.go();  // Comes meanwhile.
      drive.history().catchUp(correction);
      num_local += correction.numStayed() > 0 ? 1 : 0;
      const MapSnapshot made = takeSnapshot(correction.map(), "");
      const MapSnapshot expected = drive.make(newPoses(track, outside, drive.numClouds()));
      ASSERT_EQ(voxelsOf(made.bricks), voxelsOf(expected.bricks))
          << test::seedNote(static_cast<std::size_t>(num_corrections));
      ASSERT_EQ(made.locked, expected.locked);
    }
  }
  EXPECT_GT(num_local, 100);
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

/// What came while the map was made, and a second correction after the first.
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

/// Old clouds become fixed, and stay where they are; younger ones are moved.
TEST(MapHistory, fixesWhatItCannotKeep) {
  HistoryLimits limits;
  limits.max_age_s = 0.95;
  Drive drive(13, 1, limits);
  for (int i = 0; i < 40; ++i) drive.go();
  const HistoryFigures figures = drive.history().figures();
  EXPECT_EQ(figures.num_clouds, 10U);
  EXPECT_EQ(figures.num_fixed + figures.num_clouds, static_cast<std::size_t>(drive.numClouds()));
  const std::int64_t first = drive.numClouds() - 10;
  const PoseTrack track(drive.randomPoses(first - 3, 14));
  MapCorrection correction = drive.history().correct(track, {OutsidePoses::kStay});
  const auto all = newPoses(track, OutsidePoses::kStay, drive.numClouds());
  const MapSnapshot expected = drive.make([&](const KeptCloud& cloud) {
    return cloud.stamp_ns < Drive::stampOf(first) ? cloud.T_map_body : all(cloud);
  });
  EXPECT_EQ(voxelsOf(takeSnapshot(correction.map(), "").bricks), voxelsOf(expected.bricks));
  HistoryLimits few_bytes;
  few_bytes.max_bytes = 3000;
  Drive small(14, 1, few_bytes);
  for (int i = 0; i < 40; ++i) small.go();
  EXPECT_LE(small.history().figures().num_bytes, 3000U);
  EXPECT_GT(small.history().figures().num_clouds, 2U);
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

/// Clouds are added in one thread while another corrects: nothing is lost.
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
