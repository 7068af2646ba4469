// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/history/map_history.h"

#include "cuboid_mapping/history/cloud_replay.h"
#include "cuboid_mapping/history/kept_clouds.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <iomanip>
#include <limits>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

namespace cuboid_mapping {
namespace {

/// A cloud or an edit.
struct Event {
  std::shared_ptr<const ObservationConfig> config;  ///< Null for an edit.
  StampedPose pose;
  std::size_t num_bytes = 0;
  std::size_t num_points = 0;
  // Of an edit:
  CellBox box{};
  std::vector<VoxelBrick> bricks;
  std::vector<CellBox> locked;

  [[nodiscard]] bool isCloud() const { return config != nullptr; }
};

bool isSame(const ObservationConfig& a, const ObservationConfig& b) {
  return !(a.sensor_model != b.sensor_model) && a.ranges.max_range_m == b.ranges.max_range_m &&
         a.ranges.end_margin_m == b.ranges.end_margin_m &&
         a.limits.min_range_m == b.limits.min_range_m &&
         a.limits.crop_map.min_m == b.limits.crop_map.min_m &&
         a.limits.crop_map.max_m == b.limits.crop_map.max_m && a.marks == b.marks &&
         a.clears == b.clears;
}

std::size_t countPoints(const std::vector<Scan>& scans) {
  std::size_t count = 0;
  for (const Scan& scan : scans) {
    count += scan.points.size() + scan.no_returns.size() + scan.open_ends.size() +
             scan.free_points.size();
  }
  return count;
}

CuboidMap copyMap(const CuboidMap& map) {
  CuboidMap copy(map.config());
  restoreSnapshot(takeSnapshot(map, ""), copy);
  return copy;
}

std::string describeTimes(std::int64_t begin_ns, std::int64_t end_ns) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(3) << 1e-9 * static_cast<double>(begin_ns) << " to "
       << 1e-9 * static_cast<double>(end_ns) << " s";
  return text.str();
}

/// The bricks of a map that share a cell with a box.
std::vector<VoxelBrick> bricksOf(const CuboidMap& map, const CellBox& box) {
  std::vector<VoxelBrick> bricks;
  if (box.isEmpty()) return bricks;
  map.voxels().forEachIn(box, [&](const VoxelBrick& brick) { bricks.push_back(brick); });
  return bricks;
}

}  // namespace

struct MapCorrection::Implementation {
  Implementation(PoseTrack new_poses, OutsidePoses outside_poses, CuboidMap base)
      : track(std::move(new_poses)), outside(outside_poses), map(std::move(base)) {}

  [[nodiscard]] Eigen::Isometry3d newPose(const StampedPose& old) const {
    if (track.covers(old.stamp_ns)) return track.at(old.stamp_ns);
    if (outside == OutsidePoses::kStay) return old.T_map_body;
    return (old.stamp_ns < track.begin_ns() ? T_new_first : T_new_last) * old.T_map_body;
  }

  PoseTrack track;
  OutsidePoses outside;
  CuboidMap map;
  /// What moves the clouds before the new poses, and those after them.
  ///@{
  Eigen::Isometry3d T_new_first = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_new_last = Eigen::Isometry3d::Identity();
  ///@}
  std::vector<Eigen::Isometry3d> poses;  ///< New ones of the events so far.
  std::size_t num_clouds = 0;
  std::size_t num_outside = 0;
  double max_shift_m = 0.0;
  std::uint64_t start = 0;     ///< The restart() that it is of.
  std::shared_ptr<void> hold;  ///< While it lives, events stay.
};

MapCorrection::MapCorrection(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
MapCorrection::MapCorrection(MapCorrection&&) noexcept = default;
MapCorrection::~MapCorrection() = default;
CuboidMap& MapCorrection::map() { return implementation_->map; }
std::size_t MapCorrection::numClouds() const { return implementation_->num_clouds; }
std::size_t MapCorrection::numOutside() const { return implementation_->num_outside; }
double MapCorrection::maxShift_m() const { return implementation_->max_shift_m; }

struct MapHistory::Implementation {
  Implementation(const MapConfig& config, double step_m, const HistoryLimits& history_limits)
      : limits(history_limits), base(config), clouds(step_m) {}

  void append(Event event) {
    num_bytes += event.num_bytes;
    num_points += event.num_points;
    num_clouds += event.isCloud() ? 1 : 0;
    events.push_back(std::move(event));
  }

  std::shared_ptr<const ObservationConfig> share(const ObservationConfig& config) {
    for (const auto& known : configs) {
      if (isSame(*known, config)) return known;
    }
    configs.push_back(std::make_shared<const ObservationConfig>(config));
    return configs.back();
  }

  [[nodiscard]] bool isOverLimits() const {
    if (num_bytes > limits.max_bytes) return true;
    const auto oldest =
        std::find_if(events.begin(), events.end(), [](const Event& e) { return e.isCloud(); });
    if (oldest == events.end()) return false;
    return 1e-9 * static_cast<double>(newest_ns - oldest->pose.stamp_ns) > limits.max_age_s;
  }

  /// The oldest event becomes a part of the map that is begun with.
  void fixOldest() {
    const Event& event = events.front();
    if (event.isCloud()) {
      fixing.put(unpackScans(clouds.read(first), clouds.step_m()), event.pose.T_map_body,
                 *event.config);
      fixing.settle();
      clouds.remove(first);
      ++num_fixed;
      --num_clouds;
    } else {
      base.setLocked(event.locked);
      base.replace(event.box, event.bricks);
    }
    num_bytes -= event.num_bytes;
    num_points -= event.num_points;
    events.pop_front();
    ++first;
  }

  /// Old poses of the body, where a cloud was.
  [[nodiscard]] PoseTrack oldTrack() const {
    std::vector<StampedPose> poses;
    for (const Event& event : events) {
      if (event.isCloud()) poses.push_back(event.pose);
    }
    if (poses.empty()) {
      throw std::invalid_argument("no cloud is kept: there is nothing that poses could move");
    }
    const auto is_before = [](const auto& a, const auto& b) { return a.stamp_ns < b.stamp_ns; };
    const auto is_same = [](const auto& a, const auto& b) { return a.stamp_ns == b.stamp_ns; };
    std::stable_sort(poses.begin(), poses.end(), is_before);
    poses.erase(std::unique(poses.begin(), poses.end(), is_same), poses.end());
    return PoseTrack(std::move(poses));
  }

  /// Takes the next event that a correction has not. @return Whether there is one.
  bool takeNext(const MapCorrection::Implementation& correction, Event& event,
                std::string& packed) const {
    const std::lock_guard<std::mutex> lock(mutex);
    return takeNextLocked(correction, event, packed);
  }
  bool takeNextLocked(const MapCorrection::Implementation& correction, Event& event,
                      std::string& packed) const {
    if (correction.start != start) {
      throw std::runtime_error("the whole map was replaced meanwhile, by another call: call again");
    }
    const std::size_t i = correction.poses.size();
    if (i == events.size()) return false;
    event = events[i];
    if (event.isCloud()) packed = clouds.read(first + i);
    return true;
  }

  [[nodiscard]] std::size_t countEvents() const {
    const std::lock_guard<std::mutex> lock(mutex);
    return events.size();
  }

  void put(MapCorrection::Implementation& correction, const Event& event, const std::string& packed,
           CloudReplay& replay) const {
    if (!event.isCloud()) {
      replay.settle();
      correction.map.setLocked(event.locked);
      correction.map.replace(event.box, event.bricks);
      return correction.poses.push_back(Eigen::Isometry3d::Identity());
    }
    const Eigen::Isometry3d T_map_body = correction.newPose(event.pose);
    replay.put(unpackScans(packed, clouds.step_m()), T_map_body, *event.config);
    correction.poses.push_back(T_map_body);
    ++correction.num_clouds;
    correction.num_outside += correction.track.covers(event.pose.stamp_ns) ? 0 : 1;
    const double shift_m = (T_map_body.translation() - event.pose.T_map_body.translation()).norm();
    correction.max_shift_m = std::max(correction.max_shift_m, shift_m);
  }

  mutable std::mutex mutex;
  HistoryLimits limits;
  CuboidMap base;  ///< What the map has begun with, and what is fixed.
  KeptClouds clouds;
  std::deque<Event> events;
  std::uint64_t first = 0;  ///< Number of the first event.
  std::vector<std::shared_ptr<const ObservationConfig>> configs;
  CloudReplay fixing{base};
  std::uint64_t start = 0;  ///< Calls of restart().
  std::int64_t newest_ns = std::numeric_limits<std::int64_t>::min();
  std::size_t num_clouds = 0;
  std::uint64_t num_bytes = 0;
  std::uint64_t num_points = 0;
  std::uint64_t num_fixed = 0;
  std::shared_ptr<int> hold = std::make_shared<int>();  ///< Others have it as long as events stay.
};

MapHistory::MapHistory(const MapConfig& config, double step_m, const HistoryLimits& limits)
    : implementation_(std::make_unique<Implementation>(config, step_m, limits)) {}

MapHistory::~MapHistory() = default;

double MapHistory::step_m() const { return implementation_->clouds.step_m(); }

void MapHistory::restart(const CuboidMap& map) {
  Implementation& own = *implementation_;
  CuboidMap base = copyMap(map);
  const std::lock_guard<std::mutex> lock(own.mutex);
  own.clouds.clear();
  own.num_fixed += own.num_clouds;
  own.first += own.events.size();
  own.events.clear();
  own.num_clouds = 0;
  own.num_bytes = 0;
  own.num_points = 0;
  own.newest_ns = std::numeric_limits<std::int64_t>::min();
  own.base = std::move(base);
  ++own.start;
}

void MapHistory::add(const KeptCloud& cloud, const ObservationConfig& config) {
  Implementation& own = *implementation_;
  const std::lock_guard<std::mutex> lock(own.mutex);
  Event event;
  event.config = own.share(config);
  event.pose = {cloud.stamp_ns, cloud.T_map_body};
  event.num_points = countPoints(cloud.scans_body);
  event.num_bytes = own.clouds.add(own.first + own.events.size(), cloud.scans_body);
  own.append(std::move(event));
  own.newest_ns = std::max(own.newest_ns, cloud.stamp_ns);
  while (own.hold.use_count() == 1 && !own.events.empty() && own.isOverLimits()) own.fixOldest();
}

void MapHistory::addEdit(const CellBox& box, const CuboidMap& map) {
  Event event;
  event.box = box;
  event.bricks = bricksOf(map, box);
  event.locked = map.lockedBoxes();
  const std::lock_guard<std::mutex> lock(implementation_->mutex);
  implementation_->append(std::move(event));
}

HistoryFigures MapHistory::figures() const {
  const Implementation& own = *implementation_;
  const std::lock_guard<std::mutex> lock(own.mutex);
  return {own.num_clouds, own.num_bytes, own.num_points, own.num_fixed};
}

double MapHistory::findShift_m(const PoseTrack& poses, double distance_m) const {
  const std::lock_guard<std::mutex> lock(implementation_->mutex);
  double shift_m = 0.0;
  for (const Event& event : implementation_->events) {
    const StampedPose& old = event.pose;
    if (!event.isCloud() || !poses.covers(old.stamp_ns)) continue;
    const Eigen::Isometry3d T_map_body = poses.at(old.stamp_ns);
    const Eigen::AngleAxisd turn(
        Eigen::Matrix3d(T_map_body.linear() * old.T_map_body.linear().transpose()));
    shift_m = std::max(shift_m, (T_map_body.translation() - old.T_map_body.translation()).norm() +
                                    2.0 * distance_m * std::sin(0.5 * std::abs(turn.angle())));
  }
  return shift_m;
}

MapCorrection MapHistory::correct(const PoseTrack& poses, OutsidePoses outside,
                                  const ProgressListener& listener) {
  Implementation& own = *implementation_;
  std::unique_ptr<MapCorrection::Implementation> correction;
  {
    const std::lock_guard<std::mutex> lock(own.mutex);
    const PoseTrack old = own.oldTrack();
    const bool is_any_inside =
        std::any_of(own.events.begin(), own.events.end(),
                    [&](const Event& e) { return e.isCloud() && poses.covers(e.pose.stamp_ns); });
    if (!is_any_inside) {
      throw std::invalid_argument(
          "no cloud that is kept was taken within the new poses: they are of " +
          describeTimes(poses.begin_ns(), poses.end_ns()) + ", the clouds of " +
          describeTimes(old.begin_ns(), old.end_ns()) +
          ". Give poses with the stamps of the clouds, or keep more");
    }
    correction = std::make_unique<MapCorrection::Implementation>(poses, outside, copyMap(own.base));
    correction->T_new_first = poses.at(poses.begin_ns()) * old.at(poses.begin_ns()).inverse();
    correction->T_new_last = poses.at(poses.end_ns()) * old.at(poses.end_ns()).inverse();
    correction->start = own.start;
    correction->hold = own.hold;
  }
  MapCorrection made(std::move(correction));
  catchUp(made, listener);
  return made;
}

std::size_t MapHistory::catchUp(MapCorrection& correction, const ProgressListener& listener) {
  MapCorrection::Implementation& made = *correction.implementation_;
  CloudReplay replay(made.map);
  Event event;
  std::string packed;
  std::size_t count = 0;
  for (; implementation_->takeNext(made, event, packed); ++count) {
    implementation_->put(made, event, packed, replay);
    if (listener) listener(made.poses.size(), implementation_->countEvents());
  }
  replay.settle();
  return count;
}

void MapHistory::finish(MapCorrection& correction) {
  Implementation& own = *implementation_;
  catchUp(correction);
  MapCorrection::Implementation& made = *correction.implementation_;
  const std::lock_guard<std::mutex> lock(own.mutex);
  Event event;
  std::string packed;
  CloudReplay replay(made.map);
  while (own.takeNextLocked(made, event, packed)) own.put(made, event, packed, replay);
  replay.settle();
  for (std::size_t i = 0; i < own.events.size(); ++i) {
    if (own.events[i].isCloud()) own.events[i].pose.T_map_body = made.poses[i];
  }
}

}  // namespace cuboid_mapping
