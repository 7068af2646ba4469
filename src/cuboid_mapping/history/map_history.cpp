// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/history/map_history.h"

#include "cuboid_mapping/history/cloud_replay.h"
#include "cuboid_mapping/history/kept_clouds.h"
#include "cuboid_mapping/history/map_correction.h"
#include "cuboid_mapping/map/locked_boxes.h"
#include "cuboid_mapping/map/mapper.h"

#include <algorithm>
#include <deque>
#include <iomanip>
#include <map>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

namespace cuboid_mapping {
namespace {

bool isSame(const std::optional<MetricBox>& a, const std::optional<MetricBox>& b) {
  if (!a || !b) return a.has_value() == b.has_value();
  return a->min_m == b->min_m && a->max_m == b->max_m;
}

bool isSame(const ObservationConfig& a, const ObservationConfig& b) {
  return !(a.sensor_model != b.sensor_model) && a.ranges.max_range_m == b.ranges.max_range_m &&
         a.ranges.end_margin_m == b.ranges.end_margin_m &&
         a.ranges.keep_surfaces == b.ranges.keep_surfaces &&
         a.limits.min_range_m == b.limits.min_range_m &&
         isSame(a.limits.crop_map, b.limits.crop_map) && a.marks == b.marks && a.clears == b.clears;
}

/// @throws std::invalid_argument  with all errors.
void check(const ObservationConfig& config) {
  MapperConfig of_mapper;
  of_mapper.map.sensor_model = config.sensor_model;
  of_mapper.max_range_m = config.ranges.max_range_m;
  of_mapper.end_margin_m = config.ranges.end_margin_m;
  throwIfAny(checkConfig(of_mapper));
  Scan nothing;
  (void)filterScan(nothing, config.limits);
}

/// Motion of a body at a time; exactly the identity if the poses are equal.
Eigen::Isometry3d findMotion(const PoseTrack& old, const PoseTrack& poses, std::int64_t stamp_ns) {
  const Eigen::Isometry3d T_map_old = old.at(stamp_ns);
  const Eigen::Isometry3d T_map_new = poses.at(stamp_ns);
  if (T_map_new.matrix() == T_map_old.matrix()) return Eigen::Isometry3d::Identity();
  return T_map_new * T_map_old.inverse();
}

/// Motions at both ends of each gap of the new poses; nothing without gaps.
std::optional<PoseTrack> findGapMotions(const PoseTrack& old, const PoseTrack& poses) {
  std::map<std::int64_t, Eigen::Isometry3d> motions;
  for (const PoseTrack::Gap& gap : poses.gaps()) {
    for (const std::int64_t stamp_ns : {gap.begin_ns, gap.end_ns}) {
      motions[stamp_ns] = findMotion(old, poses, stamp_ns);
    }
  }
  if (motions.empty()) return std::nullopt;
  std::vector<StampedPose> stamped;
  stamped.reserve(motions.size());
  for (const auto& [stamp_ns, motion] : motions) stamped.push_back({stamp_ns, motion});
  return PoseTrack(std::move(stamped));
}

std::string describeTimes(std::int64_t begin_ns, std::int64_t end_ns) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(3) << 1e-9 * static_cast<double>(begin_ns) << " to "
       << 1e-9 * static_cast<double>(end_ns) << " s";
  return text.str();
}

/// The cells of `boxes` that lie in none of the others.
std::vector<CellBox> subtract(const std::vector<CellBox>& boxes,
                              const std::vector<CellBox>& others) {
  LockedBoxes left;
  for (const CellBox& box : boxes) left.add(box);
  for (const CellBox& box : others) left.remove(box);
  return left.boxes();
}

}  // namespace

struct MapHistory::Implementation {
  Implementation(const MapConfig& config, double step_m, const HistoryLimits& history_limits)
      : limits(history_limits), base(config), clouds(step_m) {}

  /// Counts an event in the figures, or takes it out again.
  void count(const HistoryEvent& event, bool is_added) {
    const auto change = [is_added](auto& sum, auto part) { is_added ? sum += part : sum -= part; };
    change(num_bytes, event.num_bytes);
    change(num_points, event.num_points);
    change(num_clouds, std::size_t{event.isCloud() ? 1U : 0U});
  }
  void append(HistoryEvent event) {
    events.push_back(std::move(event));
    count(events.back(), true);
  }

  /// Adds a cloud and its scans, then keeps to the limits. Where it throws, the cloud is not there.
  void addCloud(HistoryEvent event, const std::vector<Scan>& scans_body) {
    clouds.removeBefore(first);  // Those that became fixed.
    event.num_bytes = clouds.add(first + events.size(), scans_body);
    append(std::move(event));
    try {
      while (hold.use_count() == 1 && !events.empty() && num_bytes > limits.max_bytes) fixOldest();
    } catch (...) {
      count(events.back(), false);
      events.pop_back();
      throw;
    }
  }

  /// Adds an edit with the boxes that it has locked and unlocked.
  void addEdit(HistoryEvent edit) {
    std::vector<CellBox> locked_after = edit.locked;
    edit.newly_locked = subtract(edit.locked, locked);
    edit.newly_unlocked = subtract(locked, edit.locked);
    if (edit.whole.isEmpty()) {
      for (const auto* boxes : {&edit.newly_locked, &edit.newly_unlocked}) {
        for (const CellBox& box : *boxes) {
          edit.whole = edit.whole.isEmpty() ? box : unite(edit.whole, box);
        }
      }
    }
    append(std::move(edit));
    locked = std::move(locked_after);
  }

  std::shared_ptr<const ObservationConfig> share(const ObservationConfig& config) {
    for (const auto& known : configs) {
      if (isSame(*known, config)) return known;
    }
    configs.push_back(std::make_shared<const ObservationConfig>(config));
    return configs.back();
  }

  [[nodiscard]] std::deque<HistoryEvent>::const_iterator findFirstCloud() const {
    return std::find_if(events.begin(), events.end(),
                        [](const HistoryEvent& event) { return event.isCloud(); });
  }

  /// Puts the oldest event into the initial map. Where it throws, the event is not in it.
  void fixOldest() {
    const HistoryEvent& event = events.front();
    if (event.isCloud()) {
      fixing.put(unpackScans(clouds.read(first), clouds.step_m()), event.pose.T_map_body,
                 *event.config);
      fixing.wait();
      ++num_fixed;
    } else {
      base.setLocked(event.locked);
      base.replace(event.box, event.bricks);
    }
    count(event, false);  // Nothing throws from here on.
    events.pop_front();
    ++first;
  }

  /// Old poses of the body at the clouds.
  [[nodiscard]] PoseTrack oldTrack() const {
    std::vector<StampedPose> poses;
    for (const HistoryEvent& event : events) {
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

  /// Takes the next event that a correction lacks. @param is_locked  The caller holds the mutex.
  /// @param packed  Empty for an edit. @return Number of all events; 0: it lacks none.
  std::size_t takeNext(const MapCorrection::Implementation& correction, bool is_locked,
                       HistoryEvent& event, std::string& packed) const {
    std::unique_lock<std::mutex> lock(mutex, std::defer_lock);
    if (!is_locked) lock.lock();
    if (correction.start != start) {
      throw std::runtime_error("the whole map was replaced meanwhile, by another call: call again");
    }
    const std::size_t i = correction.poses.size();
    if (i == events.size()) return 0;
    event = events[i];
    packed.clear();
    if (event.isCloud()) packed = clouds.read(first + i);
    return events.size();
  }

  /// Puts the events that a correction lacks into its map. @return Number of them.
  std::size_t catchUp(MapCorrection::Implementation& made, bool is_locked,
                      const ProgressListener& listener) const {
    CloudReplay replay(made.map);
    HistoryEvent event;
    std::string packed;
    std::size_t count = 0;
    while (const std::size_t num_events = takeNext(made, is_locked, event, packed)) {
      made.put(event, packed, clouds.step_m(), replay);
      ++count;
      if (listener) listener(made.poses.size(), num_events);
    }
    replay.wait();
    return count;
  }

  mutable std::mutex mutex;
  HistoryLimits limits;
  CuboidMap base;  ///< The initial map with the fixed clouds.
  KeptClouds clouds;
  std::deque<HistoryEvent> events;
  std::uint64_t first = 0;  ///< Number of the first event.
  std::vector<std::shared_ptr<const ObservationConfig>> configs;
  CloudReplay fixing{base};
  std::vector<CellBox> locked;  ///< Locks after the last edit.
  std::uint64_t start = 0;      ///< Number of calls of restart().
  std::size_t num_clouds = 0;
  std::uint64_t num_bytes = 0;
  std::uint64_t num_points = 0;
  std::uint64_t num_fixed = 0;
  std::shared_ptr<int> hold = std::make_shared<int>();  ///< Shared while events must stay.
};

MapHistory::MapHistory(const MapConfig& config, double step_m, const HistoryLimits& limits)
    : implementation_(std::make_unique<Implementation>(config, step_m, limits)) {}

MapHistory::~MapHistory() = default;

double MapHistory::step_m() const { return implementation_->clouds.step_m(); }

void MapHistory::restart(const CuboidMap& map) {
  Implementation& own = *implementation_;
  CuboidMap base = copyOf(map);
  std::vector<CellBox> locked = base.lockedBoxes();
  const std::lock_guard<std::mutex> lock(own.mutex);
  own.clouds.clear();
  own.num_fixed += own.num_clouds;
  own.first += own.events.size();
  own.events.clear();
  own.num_clouds = 0;
  own.num_bytes = 0;
  own.num_points = 0;
  own.base = std::move(base);
  own.locked = std::move(locked);
  ++own.start;
}

void MapHistory::add(const KeptCloud& cloud, const ObservationConfig& config) {
  check(config);
  (void)PoseTrack({{cloud.stamp_ns, cloud.T_map_body}});  // Begins every correction.
  Implementation& own = *implementation_;
  const std::lock_guard<std::mutex> lock(own.mutex);
  HistoryEvent event;
  event.config = own.share(config);
  event.pose = {cloud.stamp_ns, cloud.T_map_body};
  for (const Scan& scan : cloud.scans_body) {
    event.num_points += scan.points.size() + scan.no_returns.size() + scan.open_ends.size() +
                        scan.free_points.size();
  }
  own.addCloud(std::move(event), cloud.scans_body);
}

void MapHistory::addEdit(const CellBox& box, const CuboidMap& map, const CellBox& whole) {
  HistoryEvent event;
  event.box = box;
  event.whole = whole.isEmpty() ? box : whole;
  event.bricks = map.voxels().copyIn(box);
  event.locked = map.lockedBoxes();
  const std::lock_guard<std::mutex> lock(implementation_->mutex);
  implementation_->addEdit(std::move(event));
}

std::uint64_t MapHistory::numAdded() const {
  const std::lock_guard<std::mutex> lock(implementation_->mutex);
  return implementation_->first + implementation_->events.size();
}

void MapHistory::dropEdits(std::uint64_t num_before, std::uint64_t count) {
  Implementation& own = *implementation_;
  const std::lock_guard<std::mutex> lock(own.mutex);
  const bool are_last =
      num_before >= own.first && num_before + count == own.first + own.events.size();
  if (!are_last || own.hold.use_count() > 1) return;
  const auto begin = own.events.end() - static_cast<std::ptrdiff_t>(count);
  const auto is_cloud = [](const HistoryEvent& event) { return event.isCloud(); };
  if (std::none_of(begin, own.events.end(), is_cloud)) own.events.erase(begin, own.events.end());
}

HistoryFigures MapHistory::figures() const {
  const Implementation& own = *implementation_;
  const std::lock_guard<std::mutex> lock(own.mutex);
  return {own.num_clouds, own.num_bytes, own.num_points, own.num_fixed};
}

std::optional<double> MapHistory::findShift_m(const PoseTrack& poses, double distance_m) const {
  if (!(distance_m >= 0.0)) throw std::invalid_argument("a distance must be a number >= 0");
  const Implementation& own = *implementation_;
  const std::lock_guard<std::mutex> lock(own.mutex);
  std::optional<double> shift_m;
  if (own.num_clouds == 0) return shift_m;
  const auto gap_motions = findGapMotions(own.oldTrack(), poses);
  for (const HistoryEvent& event : own.events) {
    const StampedPose& old = event.pose;
    if (!event.isCloud() || !poses.covers(old.stamp_ns)) continue;
    shift_m = std::max<std::optional<double>>(
        shift_m, cuboid_mapping::findShift_m(old.T_map_body, correctedPose(poses, gap_motions, old),
                                             distance_m));
  }
  return shift_m;
}

MapCorrection MapHistory::begin(const PoseTrack& poses, const CorrectionRule& rule) {
  if (!(rule.tolerance_m >= 0.0)) {
    throw std::invalid_argument("the tolerance must be a number >= 0, in metres");
  }
  Implementation& own = *implementation_;
  const std::lock_guard<std::mutex> lock(own.mutex);
  const PoseTrack old = own.oldTrack();
  const auto is_inside = [&](const HistoryEvent& event) {
    return event.isCloud() && poses.covers(event.pose.stamp_ns);
  };
  if (std::none_of(own.events.begin(), own.events.end(), is_inside)) {
    throw std::invalid_argument("no kept cloud was taken within the new poses: they are of " +
                                describeTimes(poses.begin_ns(), poses.end_ns()) +
                                ", the clouds of " + describeTimes(old.begin_ns(), old.end_ns()) +
                                ". Give poses with the stamps of the clouds, or keep more");
  }
  auto made = std::make_unique<MapCorrection::Implementation>(poses, rule, copyOf(own.base));
  made->T_new_first = findMotion(old, poses, poses.begin_ns());
  made->T_new_last = findMotion(old, poses, poses.end_ns());
  made->gap_motions = findGapMotions(old, poses);
  made->start = own.start;
  made->hold = own.hold;
  made->motion = made->motionOf(*own.findFirstCloud());
  const auto is_beyond = [&](const HistoryEvent& event) {
    return event.isCloud() && !made->map.grid().toCell(made->newPose(event.pose).translation());
  };
  if (std::any_of(own.events.begin(), own.events.end(), is_beyond)) {
    throw std::invalid_argument(
        "a new pose lies beyond all voxels: check the positions, in metres");
  }
  return MapCorrection(std::move(made));
}

MapCorrection MapHistory::correct(const PoseTrack& poses, const CorrectionRule& rule,
                                  const ProgressListener& listener) {
  MapCorrection made = begin(poses, rule);
  catchUp(made, listener);
  return made;
}

std::size_t MapHistory::catchUp(MapCorrection& correction, const ProgressListener& listener) {
  return implementation_->catchUp(*correction.implementation_, false, listener);
}

void MapHistory::finish(MapCorrection& correction) {
  Implementation& own = *implementation_;
  MapCorrection::Implementation& made = *correction.implementation_;
  own.catchUp(made, false, {});
  const std::lock_guard<std::mutex> lock(own.mutex);
  own.catchUp(made, true, {});  // Others may have added some more.
  std::vector<CellBox> locked = made.map.lockedBoxes();
  for (std::size_t i = 0; i < own.events.size(); ++i) {  // Nothing throws from here on.
    if (own.events[i].isCloud()) own.events[i].pose.T_map_body = made.poses[i];
  }
  for (auto& [i, edit] : made.moved_edits) own.events[i] = std::move(edit);
  own.locked = std::move(locked);
}

}  // namespace cuboid_mapping
