// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/window/map_window.h"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <new>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping {
namespace {

/// Steps after which a failed write or read is repeated.
constexpr std::uint64_t kRetrySteps = 20;

/// The pages of an update, each once. Neighbours in the update mostly share a page.
std::vector<Cell> findTouched(const ScanUpdate& update) {
  std::unordered_set<Cell, CellHash> found;
  std::vector<Cell> pages;
  std::optional<Cell> last;
  for (const BrickUpdate& brick : update.bricks) {
    const Cell page = pageOf(brick.brick);
    if (last == page) continue;
    last = page;
    if (found.insert(page).second) pages.push_back(page);
  }
  return pages;
}

bool isAnyLocked(const std::vector<CellBox>& locked, const Cell& page) {
  return std::any_of(locked.begin(), locked.end(),
                     [&](const CellBox& box) { return box.intersects(pageBox(page)); });
}

MapSnapshot headOf(const CuboidMap& map, const MapStore& store) {
  return {map.config().resolution_m,
          map.config().sensor_model,
          map.config().environment,
          store.head() ? store.head()->frame_id : std::string(),
          {}};
}

}  // namespace

MapWindow::MapWindow(const WindowConfig& config, std::unique_ptr<MapStore> store, CuboidMap& map)
    : config_(config), map_(map), store_(std::move(store)) {
  if (!(config.size_m > 0.0) || !(config.margin_m >= 0.0)) {
    throw std::invalid_argument("the size of a window must be > 0, its margin at least 0");
  }
  if ((config.outside == OutsideWindow::kKeep) != (store_ != nullptr)) {
    throw std::invalid_argument(
        "a window needs a store if it keeps the map outside, and must have none otherwise");
  }
  if (store_) {
    for (const Cell& page : store_->pages()) stored_.insert(page);
  }
  listPages();
}

/// Lists the pages of the map, all of them as changed.
void MapWindow::listPages() {
  fetched_.clear();
  for (auto& [page, state] : pages_) state.is_dirty = true;
  map_.voxels().forEach([this](const VoxelBrick& brick) {
    const Cell page = pageOf(brick.brick);
    pages_[page] = {true, step_};
    stored_.erase(page);
  });
  are_pages_stale_ = false;
}

void MapWindow::fetch(const ScanUpdate& update) {
  if (store_ && !are_pages_stale_) fetchPages(findTouched(update));
}

void MapWindow::fetch(const CellBox& box, std::size_t max_pages) {
  if (store_ && !are_pages_stale_) fetchPages(storedIn(box, max_pages));
}

/// Those that cannot be read are left to loadPage(), which says so.
void MapWindow::fetchPages(const std::vector<Cell>& pages) {
  fetched_.clear();
  for (const Cell& page : pages) {
    if (stored_.count(page) == 0 || isUnreadable(page)) continue;
    try {
      fetched_[page] = readPage(page);
    } catch (const MapFileError&) {
      return;
    }
  }
}

std::vector<VoxelBrick> MapWindow::readPage(const Cell& page) const {
  const std::lock_guard<std::mutex> lock(store_mutex_);
  return store_->read(page);
}

const ScanUpdate& MapWindow::admit(const ScanUpdate& update, const Eigen::Vector3d& center_map,
                                   ChangeSet& changes) {
  refresh();
  ++step_;
  num_loaded_now_ = 0;
  changes.revision = map_.revision();
  moveTo(center_map);
  const PageSet left_out = loadTouched(findTouched(update), changes);
  if (left_out.empty()) return update;
  const auto is_left_out = [&](const Cell& cell) { return left_out.count(pageOf(cell)) > 0; };
  admitted_ = update;
  std::vector<BrickUpdate>& bricks = admitted_.bricks;
  bricks.erase(std::remove_if(bricks.begin(), bricks.end(),
                              [&](const BrickUpdate& brick) { return is_left_out(brick.brick); }),
               bricks.end());
  std::vector<Cell>& samples = admitted_.samples;
  samples.erase(std::remove_if(samples.begin(), samples.end(), is_left_out), samples.end());
  (store_ ? figures_.num_unreadable : figures_.num_refused) += update.bricks.size() - bricks.size();
  return admitted_;
}

void MapWindow::prepareCommit() {
  if (!store_ || are_pages_stale_) return;
  try {
    const std::size_t num_left = kPagesAStep - std::min(kPagesAStep, num_loaded_now_);
    const auto num_next = static_cast<std::ptrdiff_t>(std::min(ahead_.size(), num_left));
    fetchPages({ahead_.end() - num_next, ahead_.end()});
    if (isTurnToEvict()) (void)write(dirtyOf(findEvictable()));
  } catch (const std::bad_alloc&) {  // commit() tries again.
    noteFailure("there is not enough memory to load or evict pages");
  }
}

bool MapWindow::isTurnToEvict() const {
  return (!store_ || step_ % kStepsAWrite == 0) && !is_held_ && !are_pages_stale_;
}

void MapWindow::commit(CuboidMap::PendingChange& change, ChangeSet& changes) {
  const ChangeSet applied = map_.commit(change);
  markDirty(applied);
  changes.append(applied);
  try {
    prefetch(changes);
    if (isTurnToEvict()) evict(findEvictable(), changes);
  } catch (const std::bad_alloc&) {  // The change is made; pages can come and go later.
    noteFailure("there is not enough memory to load or evict pages");
  }
}

void MapWindow::moveTo(const Eigen::Vector3d& center_map) {
  window_ = windowAround(center_map, config_, map_.grid());
  outer_ = cellsKeptAround(center_map, config_, map_.grid());
  const CellBox pages{pageOf(window_.min), pageOf(window_.max)};
  if (step_ > 1 && pages == window_pages_) return;
  window_pages_ = pages;
  ahead_.clear();
  for (const Cell& page : stored_) {
    if (window_.intersects(pageBox(page)) && !isUnreadable(page)) ahead_.push_back(page);
  }
}

/// Whether a page could not be read a short while ago.
bool MapWindow::isUnreadable(const Cell& page) const {
  const auto found = unreadable_.find(page);
  return found != unreadable_.end() && step_ < found->second + kRetrySteps;
}

void MapWindow::noteUnreadable(const Cell& page, const MapFileError& error) {
  noteFailure(error.what());
  unreadable_[page] = step_;
}

/// @return Touched pages that cannot take observations.
MapWindow::PageSet MapWindow::loadTouched(const std::vector<Cell>& touched, ChangeSet& changes) {
  PageSet left_out;
  for (const Cell& page : touched) {
    const auto found = pages_.find(page);
    if (found != pages_.end()) {
      found->second.last_use = step_;
      continue;
    }
    if (config_.outside == OutsideWindow::kRefuse && !window_.intersects(pageBox(page))) {
      left_out.insert(page);
      continue;
    }
    try {
      if (isUnreadable(page)) {
        left_out.insert(page);
      } else if (stored_.count(page) > 0) {
        loadPage(page, changes);
      } else {
        pages_[page].last_use = step_;
      }
    } catch (const MapFileError& error) {
      noteUnreadable(page, error);
      left_out.insert(page);
    }
  }
  return left_out;
}

/// Loads pages of the window before a cloud touches them, for queries.
void MapWindow::prefetch(ChangeSet& changes) {
  while (!ahead_.empty() && num_loaded_now_ < kPagesAStep) {
    const Cell page = ahead_.back();
    ahead_.pop_back();
    if (stored_.count(page) == 0 || isUnreadable(page)) continue;
    try {
      loadPage(page, changes);
    } catch (const MapFileError& error) {
      noteUnreadable(page, error);
    }
  }
}

void MapWindow::loadPage(const Cell& page, ChangeSet& changes) {
  assert(pages_.count(page) == 0);
  const auto fetched = fetched_.find(page);
  std::vector<VoxelBrick> bricks =
      fetched == fetched_.end() ? readPage(page) : std::move(fetched->second);
  if (fetched != fetched_.end()) fetched_.erase(fetched);
  pages_[page].last_use = step_;
  try {
    changes.append(map_.replace(std::move(bricks)));
  } catch (...) {
    pages_.erase(page);
    throw;
  }
  stored_.erase(page);
  unreadable_.erase(page);
  ++figures_.num_loads;
  ++num_loaded_now_;
}

/// The pages that commit() evicts at its turn.
std::vector<Cell> MapWindow::findEvictable() const {
  const bool is_kept = config_.outside == OutsideWindow::kKeep;
  const std::vector<CellBox> locked = is_kept ? std::vector<CellBox>() : map_.lockedBoxes();
  std::vector<Cell> evictable;
  for (const auto& [page, state] : pages_) {
    if (outer_.intersects(pageBox(page)) || state.last_use + config_.idleSteps() > step_) {
      continue;
    }
    if (!isAnyLocked(locked, page)) evictable.push_back(page);
  }
  std::sort(evictable.begin(), evictable.end());  // Makes the order independent of the table.
  const std::size_t count = std::max(kPagesAStep, evictable.size() / kEvictedShare);
  evictable.resize(std::min(evictable.size(), count));
  return evictable;
}

std::vector<Cell> MapWindow::dirtyOf(const std::vector<Cell>& pages) const {
  std::vector<Cell> dirty;
  std::copy_if(pages.begin(), pages.end(), std::back_inserter(dirty),
               [this](const Cell& page) { return pages_.at(page).is_dirty; });
  return dirty;
}

void MapWindow::evict(std::vector<Cell> pages, ChangeSet& changes) {
  if (store_ && !write(dirtyOf(pages))) {
    const auto is_dirty = [this](const Cell& page) { return pages_.at(page).is_dirty; };
    pages.erase(std::remove_if(pages.begin(), pages.end(), is_dirty), pages.end());
  }
  for (const Cell& page : pages) {
    if (store_) stored_.insert(page);
    ChangeSet change;
    try {
      change = map_.replace(pageBox(page), std::vector<VoxelBrick>());
    } catch (...) {
      stored_.erase(page);  // It is still in memory.
      throw;
    }
    if (change.bricks.empty()) stored_.erase(page);  // The store has no empty pages.
    changes.append(change);
    pages_.erase(page);
    if (!store_) ++figures_.num_forgotten;
  }
}

/// @return Whether the store has these pages now.
bool MapWindow::write(const std::vector<Cell>& pages) {
  if (pages.empty()) return true;
  if (step_ < next_write_) return false;
  const auto bricks_of = [this](const Cell& page) { return map_.voxels().copyIn(pageBox(page)); };
  try {
    const std::lock_guard<std::mutex> lock(store_mutex_);
    if (is_store_stale_) {
      store_->replaceAll(headOf(map_, *store_), pages, bricks_of);
    } else {
      store_->write(pages, bricks_of);
    }
  } catch (const MapFileError& error) {
    noteFailure(error.what());
    next_write_ = step_ + kRetrySteps;
    return false;
  }
  is_store_stale_ = false;
  {
    const std::lock_guard<std::mutex> lock(figures_mutex_);
    figures_.num_writes += pages.size();
  }
  for (const Cell& page : pages) pages_.at(page).is_dirty = false;
  return true;
}

void MapWindow::noteFailure(const char* text) noexcept {
  const std::lock_guard<std::mutex> lock(figures_mutex_);
  ++figures_.num_failures;
  try {
    figures_.last_failure = text;
  } catch (const std::bad_alloc&) {
    figures_.last_failure.clear();
  }
}

template <typename VisitT>
void MapWindow::forEachStored(const CellBox& box, const VisitT& visit) const {
  if (box.isEmpty()) return;
  if (numPages(box) > static_cast<double>(stored_.size())) {
    for (const Cell& page : stored_) {
      if (box.intersects(pageBox(page))) visit(page);
    }
    return;
  }
  const Cell first = pageOf(box.min);
  for (std::int32_t z = first.z; z < box.max.z; z += kPageEdge) {
    for (std::int32_t y = first.y; y < box.max.y; y += kPageEdge) {
      for (std::int32_t x = first.x; x < box.max.x; x += kPageEdge) {
        if (stored_.count({x, y, z}) > 0) visit({x, y, z});
      }
    }
  }
}

std::size_t MapWindow::countNotLoaded(const CellBox& box) const {
  std::size_t count = 0;
  forEachStored(box, [&](const Cell& /*page*/) { ++count; });
  return count;
}

std::vector<Cell> MapWindow::storedIn(const CellBox& box, std::size_t max_pages) const {
  std::vector<Cell> pages;
  forEachStored(box, [&](const Cell& page) {
    if (pages.size() < max_pages) pages.push_back(page);
  });
  return pages;
}

void MapWindow::load(const CellBox& box, ChangeSet& changes, std::size_t max_pages) {
  refresh();
  changes.revision = map_.revision();
  for (const Cell& page : storedIn(box, max_pages)) loadPage(page, changes);
}

void MapWindow::edit(const CellBox& box, FunctionRef<ChangeSet()> work, ChangeSet& changes) {
  load(box, changes);
  try {
    const ChangeSet edited = work();
    markDirty(edited);
    changes.append(edited);
  } catch (...) {  // Some of it may be done.
    are_pages_stale_ = true;
    changes.is_everything = true;
    throw;
  }
}

void MapWindow::markDirty(const ChangeSet& changes) noexcept {
  if (changes.is_everything) {
    for (auto& [page, state] : pages_) state.is_dirty = true;
  }
  try {
    for (const ChangedBrick& brick : changes.bricks) {
      assert(stored_.count(pageOf(brick.brick)) == 0);
      pages_[pageOf(brick.brick)] = {true, step_};
    }
  } catch (const std::bad_alloc&) {
    are_pages_stale_ = true;
  }
}

void MapWindow::replaceAll(FunctionRef<ChangeSet()> work, ChangeSet& changes) {
  are_pages_stale_ = true;
  try {
    changes.append(work());
  } catch (...) {
    changes.is_everything = true;
    throw;
  }
  pages_.clear();
  stored_.clear();
  unreadable_.clear();
  ahead_.clear();
  is_store_stale_ = store_ != nullptr;
  listPages();
}

std::vector<Cell> MapWindow::findDirty() const {
  std::vector<Cell> dirty;
  for (const auto& [page, state] : pages_) {
    if (state.is_dirty) dirty.push_back(page);
  }
  return dirty;
}

void MapWindow::refresh() {
  if (are_pages_stale_) listPages();
}

bool MapWindow::saveSome() {
  if (!store_) return false;
  refresh();
  std::vector<Cell> dirty = findDirty();
  if (dirty.size() <= kPagesAStep) {
    (void)save();
    return false;
  }
  dirty.resize(kPagesAStep);
  next_write_ = step_;
  return write(dirty);
}

bool MapWindow::save() {
  if (!store_) return true;
  refresh();
  const std::vector<Cell> dirty = findDirty();
  next_write_ = step_;
  if (!dirty.empty() || !is_store_stale_) return write(dirty);
  try {  // An empty map.
    const std::lock_guard<std::mutex> lock(store_mutex_);
    store_->replaceAll(headOf(map_, *store_), {}, {});
    is_store_stale_ = false;
  } catch (const MapFileError& error) {
    noteFailure(error.what());
  }
  return !is_store_stale_;
}

void MapWindow::addStored(const Cell& page, const SnapshotLimits& limits,
                          MapSnapshot& snapshot) const {
  for (VoxelBrick& brick : readPage(page)) snapshot.bricks.push_back(std::move(brick));
  if (snapshot.bricks.size() <= limits.max_bricks) return;
  throw MapFileError(MapFileDefect::kTooBig, store_->file() + " has more than " +
                                                 std::to_string(limits.max_bricks) +
                                                 " bricks of 8 x 8 x 8 voxels");
}

void MapWindow::saveHead() {
  if (!store_) return;
  try {
    const std::lock_guard<std::mutex> lock(store_mutex_);
    MapSnapshot head = headOf(map_, *store_);
    if (store_->head()) head.progress = store_->head()->progress;
    store_->setHead(head);
  } catch (const MapFileError& error) {
    noteFailure(error.what());
  }
}

WindowFigures MapWindow::figures() const {
  std::unique_lock<std::mutex> lock(figures_mutex_);
  WindowFigures figures = figures_;
  lock.unlock();
  figures.num_in_memory = pages_.size();
  figures.num_on_disk_only = stored_.size();
  return figures;
}

}  // namespace cuboid_mapping
