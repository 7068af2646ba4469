// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/map/guarded_map.h"

#include <new>
#include <tuple>

namespace cuboid_mapping_ros {
namespace {

/// Maximum number of remembered bricks that were changed and are empty now, as after edits. With more,
/// it is shorter to report that everything has changed.
constexpr std::size_t kMaxGoneBricks = 100000;

}  // namespace

void followSensorModel(const CuboidMap& map, CuboidMap& fresh) {
  const auto& model = map.config().sensor_model;
  if (fresh.config().sensor_model != model) fresh.setSensorModel(model);
}

void GuardedMap::integrate(const ros::Time& stamp, const ScanUpdate& update,
                           const SensorModel& model, const Eigen::Vector3d& window_center_map,
                           const std::optional<KeptObservation>& kept) {
  const Changing changing(change_);
  const auto& admitted = window_ ? admit(update, window_center_map) : update;
  auto pending = map_.prepare(admitted, model);  // Destroyed last, when the map is free again.
  if (window_) window_->prepareCommit();
  {
    const WriteLock alone(mutex_);
    noteGathered([&](ChangeSet& changes) {
      if (!window_) return changes.append(map_.commit(pending));
      window_->hold(num_holds_ > 0);  // Set again: a reader may have begun meanwhile.
      window_->commit(pending, changes);
    });
    stamp_ = stamp;
  }
  if (!history_ || !kept) return;
  history_->change([&](MapHistory& history) { history.add(kept->cloud, kept->config); });
}

void GuardedMap::exchange(MapCorrection& correction) {
  const Changing changing(change_);
  history_->whole().finish(correction);  // Nobody changes the map; others read it.
  CuboidMap& corrected = correction.map();
  followSensorModel(map_, corrected);
  replaceWhole([&] {
    map_.setLocked(corrected.lockedBoxes());
    return map_.exchange(corrected);
  });
}

std::unique_lock<std::mutex> GuardedMap::beginEdit() {
  std::unique_lock<std::mutex> turn(edit_turn_);
  const ChangeLock lock(*this);
  undo_.begin(history_ ? history_->numAdded() : 0);
  return turn;
}

std::optional<std::size_t> GuardedMap::undoEdit() {
  const std::lock_guard<std::mutex> turn(edit_turn_);
  const PageHold stay = hold();
  const auto look = [this] {
    const ReadLock lock(mutex_);
    return std::tuple(undo_.size(), undo_.nextBox(), undo_.lastEdit());
  };
  auto [num_edits, box, edit] = look();
  if (num_edits == 0) return std::nullopt;
  std::size_t num_left = num_edits;
  while (num_left == num_edits) {
    editIn(box, [this](CuboidMap& map) { return undo_.undoPart(map); });
    std::tie(num_left, box, std::ignore) = look();
  }
  const Changing changing(change_);
  if (history_) {
    history_->change([first = edit.first, count = 2 * edit.second](MapHistory& history) {
      history.dropEdits(first, count);
    });
  }
  return num_left;
}

/// The part of an update that the window admits; its pages are loaded.
const ScanUpdate& GuardedMap::admit(const ScanUpdate& update,
                                    const Eigen::Vector3d& window_center_map) {
  window_->fetch(update);
  const WriteLock alone(mutex_);
  const ScanUpdate* admitted = nullptr;
  noteGathered([&](ChangeSet& changes) {
    window_->hold(num_holds_ > 0);
    admitted = &window_->admit(update, window_center_map, changes);
  });
  return *admitted;
}

std::size_t GuardedMap::countNotLoaded(const CellBox& box) const {
  if (!window_) return 0;
  const ReadLock lock(mutex_);
  return window_->countNotLoaded(box);
}

std::optional<CellBox> GuardedMap::regionOfSearch() const {
  const ReadLock lock(mutex_);
  if (!window_ || window_->figures().num_on_disk_only == 0) return std::nullopt;
  return window_->window();
}

void GuardedMap::load(const CellBox& box, const std::atomic<bool>* is_stopped) {
  const PageHold come_back = hold();
  while (countNotLoaded(box) > 0 && (is_stopped == nullptr || !*is_stopped)) {
    const Changing changing(change_);
    window_->fetch(box, MapWindow::kPagesAStep);
    const WriteLock alone(mutex_);
    noteGathered([&](ChangeSet& changes) { window_->load(box, changes, MapWindow::kPagesAStep); });
  }
}

std::optional<WindowFigures> GuardedMap::windowFigures() const {
  const ReadLock lock(mutex_);
  if (!window_) return std::nullopt;
  return window_->figures();
}

std::string GuardedMap::save() {
  if (!window_) return {};
  constexpr int kMaxTurns = 100000;  // Clouds change the map meanwhile.
  for (int turn = 0; turn < kMaxTurns; ++turn) {
    const Changing changing(change_);
    if (window_->arePagesStale()) {
      const WriteLock alone(mutex_);
      window_->refresh();
    }
    const std::uint64_t num_failures = window_->figures().num_failures;
    if (window_->saveSome()) continue;
    const WindowFigures figures = window_->figures();
    return figures.num_failures > num_failures ? figures.last_failure : "";
  }
  return "clouds change the map faster than it is saved";
}

void GuardedMap::saveHead() {
  const Changing changing(change_);
  if (window_) window_->saveHead();
}

void GuardedMap::note(const ChangeSet& changes) {
  const std::lock_guard<std::mutex> lock(changes_mutex_);
  changed_revision_ = changes.revision;
  if (changes.is_everything) {
    is_everything_changed_ = true;
    changed_.clear();
  }
  if (is_everything_changed_) return;
  try {
    for (const ChangedBrick& brick : changes.bricks) {
      changed_.findOrAdd(brick.brick).has_new_cuboids |= brick.has_new_cuboids;
    }
  } catch (const std::bad_alloc&) {  // The map has changed: everybody must notice.
    is_everything_changed_ = true;
    changed_.clear();
  }
  if (changed_.size() <= kMaxGoneBricks + map_.voxels().size()) return;
  is_everything_changed_ = true;
  changed_.clear();
}

void GuardedMap::noteEverything() noexcept {
  const std::lock_guard<std::mutex> lock(changes_mutex_);
  is_everything_changed_ = true;
  changed_.clear();
}

ChangeSet GuardedMap::takeChanges() {
  const std::lock_guard<std::mutex> lock(changes_mutex_);
  ChangeSet changes{changed_revision_, is_everything_changed_, {}};
  changes.bricks.reserve(changed_.size());
  changed_.forEach([&changes](const auto& brick) { changes.bricks.push_back(brick); });
  changed_.clear();
  is_everything_changed_ = false;
  return changes;
}

}  // namespace cuboid_mapping_ros
