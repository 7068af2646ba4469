// SPDX-License-Identifier: BSD-3-Clause
// A random drive: clouds and edits, the map made from them, and its history.
#pragma once

#include "cuboid_mapping/history/kept_clouds.h"
#include "cuboid_mapping/history/map_history.h"
#include "cuboid_mapping/map/mapper.h"
#include "support/modelled_map.h"
#include "support/random.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <vector>

namespace cuboid_mapping::test {

constexpr std::int64_t kPeriodNs = 100000000;

inline Eigen::Isometry3d randomPose(Random& random, double size_m) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(random.real(-size_m, size_m), random.real(-size_m, size_m),
                                       random.real(-0.5, 0.5));
  pose.linear() = (Eigen::AngleAxisd(random.real(-3.0, 3.0), Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(random.real(-0.1, 0.1), Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  return pose;
}

/// A cloud or an edit in the test's own record.
struct Step {
  KeptCloud cloud;
  ObservationConfig config;
  bool is_edit = false;
  CellBox box{};
  bool locks = false;
  std::set<Cell> locked_before{};
  std::set<Cell> locked_after{};
};

/// The cells of some boxes.
inline std::set<Cell> cellsOf(const std::vector<CellBox>& boxes) {
  std::set<Cell> cells;
  for (const CellBox& box : boxes) {
    visitCells(box, [&](const Cell& cell) { cells.insert(cell); });
  }
  return cells;
}

/// A map made from clouds and edits, and its history.
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
    configs_[1].limits.crop_map = MetricBox{{-20, -20, -1}, {20, 20, 1.5}};
    configs_[2].marks = false;
    configs_[3].clears = false;
  }

  static MapConfig makeConfig(int threads) {
    MapConfig config;
    config.resolution_m = 0.2;
    config.threads = threads;
    return config;
  }

  /// Adds a cloud with the next stamp, or sometimes an edit.
  void go() { go(random_.chance(0.15)); }
  void goCloud() { go(false); }
  void go(bool is_edit) {
    Step step;
    step.is_edit = is_edit;
    if (step.is_edit) {
      const Cell least{random_.integer(-30, 20), random_.integer(-30, 20), random_.integer(-8, 4)};
      step.box = {least, least + Cell{random_.integer(1, 12), random_.integer(1, 12), 6}};
      step.locks = random_.chance(0.5);
    } else {
      step.cloud = makeCloud();
      step.config = configs_[random_.index(4)];
    }
    if (step.is_edit) step.locked_before = cellsOf(map_.lockedBoxes());
    put(step, step.cloud.T_map_body, map_);
    if (step.is_edit) {
      step.locked_after = cellsOf(map_.lockedBoxes());
      history_.addEdit(step.box, map_);
    } else {
      history_.add(step.cloud, step.config);
    }
    steps_.push_back(step);
  }

  /// The map from scratch. @param new_pose  Pose of a cloud. @param edits_move  See CorrectionRule; the first step is a cloud then.
  [[nodiscard]] MapSnapshot make(const std::function<Eigen::Isometry3d(const KeptCloud&)>& new_pose,
                                 bool edits_move = false) const {
    CuboidMap map(makeConfig(1));
    Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
    for (const Step& step : steps_) {
      if (!step.is_edit) motion = new_pose(step.cloud) * step.cloud.T_map_body.inverse();
      if (step.is_edit && edits_move) {
        putMoved(step, motion, map);
      } else {
        put(step, new_pose(step.cloud), map);
      }
    }
    return takeSnapshot(map, "");
  }

  /// Applies an edit that moves with a cloud, and its locks and unlocks.
  static void putMoved(const Step& step, const Eigen::Isometry3d& motion, CuboidMap& map) {
    const Eigen::Vector3d center = map.grid().centerOf(step.box);
    const Eigen::Vector3d shift = (motion * center - center) / map.grid().resolution();
    Cell cells{};
    for (int axis = 0; axis < 3; ++axis) {
      cells[axis] = static_cast<std::int32_t>(std::lround(shift[axis]));
    }
    const auto voxel = [&](const Cell& cell) {
      return CellBox{cell + cells, cell + cells + Cell{1, 1, 1}};
    };
    for (const Cell& cell : step.locked_before) {
      if (step.locked_after.count(cell) == 0) map.unlock(voxel(cell));
    }
    for (const Cell& cell : step.locked_after) {
      if (step.locked_before.count(cell) == 0) map.lock(voxel(cell));
    }
    const CellBox box{step.box.min + cells, step.box.max + cells};
    map.replace(box, std::vector<UniformBox>{{box, step.locks ? 1.0F : -1.0F}});
  }

  /// Applies a step to a map, independently of MapHistory.
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

  /// Poses of every second cloud, moved at random. @param count  Number of clouds, from the first on.
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

/// Pose of a cloud with new poses, by the definition of OutsidePoses.
inline std::function<Eigen::Isometry3d(const KeptCloud&)> newPoses(const PoseTrack& track,
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

}  // namespace cuboid_mapping::test
