// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/window/map_window.h"

#include "cuboid_mapping/window/stored_pages.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <new>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping {
namespace {

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

}  // namespace

const char* toString(OutsideWindow outside) {
  switch (outside) {
    case OutsideWindow::kKeep: return "keep";
    case OutsideWindow::kForget: return "forget";
    default: return "refuse";
  }
}

CellBox cellsKeptAround(const Eigen::Vector3d& center_map, const WindowConfig& config,
                        const Grid& grid) {
  const Eigen::Vector3d center_cells = grid.toCellUnits(center_map);
  const double reach_cells = (0.5 * config.size_m + config.margin_m) / grid.resolution();
  CellBox cube;
  constexpr double kMax = Grid::kMaxCell;
  for (int axis = 0; axis < 3; ++axis) {
    const double min = std::floor(center_cells[axis] - reach_cells);
    const double max = std::ceil(center_cells[axis] + reach_cells);
    cube.min[axis] = static_cast<std::int32_t>(std::clamp(min, -kMax, kMax));
    cube.max[axis] = static_cast<std::int32_t>(std::clamp(max, -kMax, kMax));
  }
  return cube;
}

MapWindow::MapWindow(const WindowConfig& config, std::unique_ptr<MapStore> store, CuboidMap& map)
    : config_(config), map_(map), stored_(std::make_unique<StoredPages>(std::move(store))) {
  if (!(config.size_m > 0.0) || !(config.margin_m >= 0.0)) {
    throw std::invalid_argument("the size of a window must be > 0, its margin at least 0");
  }
  if ((config.outside == OutsideWindow::kKeep) != stored_->hasStore()) {
    throw std::invalid_argument(
        "a window needs a store if it keeps the map outside, and must have none otherwise");
  }
  listPages();
}

MapWindow::~MapWindow() = default;

/// Lists the pages of the map, all of them as changed.
void MapWindow::listPages() {
  stored_->forgetFetched();
  for (auto& [page, state] : pages_) state.is_dirty = true;
  map_.voxels().forEach([this](const VoxelBrick& brick) {
    const Cell page = pageOf(brick.brick);
    pages_[page] = {true, step_};
    stored_->erase(page);
  });
  are_pages_stale_ = false;
}

void MapWindow::fetch(const ScanUpdate& update) {
  if (stored_->hasStore() && !are_pages_stale_) stored_->fetch(findTouched(update), step_);
}

void MapWindow::fetch(const CellBox& box, std::size_t max_pages) {
  if (!are_pages_stale_) stored_->fetch(stored_->pagesIn(box, max_pages), step_);
}

const ScanUpdate& MapWindow::admit(const ScanUpdate& update, const Eigen::Vector3d& center_map,
                                   ChangeSet& changes) {
  if (!center_map.allFinite()) {
    throw std::invalid_argument("the middle of a window must be finite: it would leave the map");
  }
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
  (stored_->hasStore() ? figures_.num_unreadable : figures_.num_refused) +=
      update.bricks.size() - bricks.size();
  return admitted_;
}

void MapWindow::prepareCommit() {
  if (!stored_->hasStore() || are_pages_stale_) return;
  try {
    const std::size_t num_left = kPagesAStep - std::min(kPagesAStep, num_loaded_now_);
    const auto num_next = static_cast<std::ptrdiff_t>(std::min(ahead_.size(), num_left));
    stored_->fetch({ahead_.end() - num_next, ahead_.end()}, step_);
    if (isTurnToEvict()) (void)write(dirtyOf(findEvictable()));
  } catch (const std::bad_alloc&) {  // commit() tries again.
    stored_->noteFailure("there is not enough memory to load or evict pages");
  }
}

bool MapWindow::isTurnToEvict() const {
  return (!stored_->hasStore() || step_ % kStepsAWrite == 0) && !is_held_ && !are_pages_stale_;
}

void MapWindow::commit(CuboidMap::PendingChange& change, ChangeSet& changes) {
  const ChangeSet applied = map_.commit(change);
  markDirty(applied);
  changes.append(applied);
  try {
    prefetch(changes);
    if (isTurnToEvict()) evict(findEvictable(), changes);
  } catch (const std::bad_alloc&) {  // The change is made; pages can come and go later.
    stored_->noteFailure("there is not enough memory to load or evict pages");
  }
}

void MapWindow::moveTo(const Eigen::Vector3d& center_map) {
  window_ = cellsKeptAround(center_map, {config_.size_m, 0.0}, map_.grid());
  outer_ = cellsKeptAround(center_map, config_, map_.grid());
  const CellBox pages{pageOf(window_.min), pageOf(window_.max)};
  if (step_ > 1 && pages == window_pages_ && !stored_->isRetryDue(step_)) return;
  ahead_ = stored_->pagesIn(window_, kAllPages);
  window_pages_ = pages;
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
      if (stored_->isUnreadable(page, step_)) {
        left_out.insert(page);
      } else if (stored_->contains(page)) {
        loadPage(page, changes);
      } else {
        pages_[page].last_use = step_;
      }
    } catch (const MapFileError& error) {
      stored_->noteUnreadable(page, step_, error);
      left_out.insert(page);
    }
  }
  return left_out;
}

/// Loads pages of the window before a cloud touches them, for queries.
void MapWindow::prefetch(ChangeSet& changes) {
  while (!ahead_.empty() && num_loaded_now_ < kPagesAStep) {
    const Cell page = ahead_.back();
    try {
      if (stored_->contains(page) && !stored_->isUnreadable(page, step_)) loadPage(page, changes);
    } catch (const MapFileError& error) {
      stored_->noteUnreadable(page, step_, error);
    }
    ahead_.pop_back();
  }
}

void MapWindow::loadPage(const Cell& page, ChangeSet& changes) {
  assert(pages_.count(page) == 0);
  std::vector<VoxelBrick> bricks = stored_->take(page);
  pages_[page].last_use = step_;
  try {
    changes.append(map_.replace(std::move(bricks)));
  } catch (...) {
    pages_.erase(page);
    throw;
  }
  stored_->erase(page);
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
  if (stored_->hasStore() && !write(dirtyOf(pages))) {
    const auto is_dirty = [this](const Cell& page) { return pages_.at(page).is_dirty; };
    pages.erase(std::remove_if(pages.begin(), pages.end(), is_dirty), pages.end());
  }
  for (const Cell& page : pages) {
    if (stored_->hasStore()) stored_->insert(page);
    ChangeSet change;
    try {
      change = map_.replace(pageBox(page), std::vector<VoxelBrick>());
    } catch (...) {
      stored_->erase(page);  // It is still in memory.
      throw;
    }
    if (change.bricks.empty()) stored_->erase(page);  // The store has no empty pages.
    changes.append(change);
    pages_.erase(page);
    if (!stored_->hasStore()) ++figures_.num_forgotten;
  }
}

/// @return Whether the store has these pages now.
bool MapWindow::write(const std::vector<Cell>& pages) {
  if (pages.empty()) return true;
  if (!stored_->write(pages, map_, step_)) return false;
  for (const Cell& page : pages) pages_.at(page).is_dirty = false;
  return true;
}

std::size_t MapWindow::countNotLoaded(const CellBox& box) const {
  return stored_->pagesIn(box, kAllPages).size();
}

std::vector<Cell> MapWindow::storedPages() const { return stored_->all(); }

void MapWindow::load(const CellBox& box, ChangeSet& changes, std::size_t max_pages) {
  refresh();
  changes.revision = map_.revision();
  for (const Cell& page : stored_->pagesIn(box, max_pages)) loadPage(page, changes);
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
      assert(!stored_->contains(pageOf(brick.brick)));
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
  ahead_.clear();
  stored_->markReplaced();
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
  if (!stored_->hasStore()) return false;
  refresh();
  std::vector<Cell> dirty = findDirty();
  if (dirty.size() <= kPagesAStep) {
    (void)save();
    return false;
  }
  dirty.resize(kPagesAStep);
  stored_->retryNow();
  return write(dirty);
}

bool MapWindow::save() {
  if (!stored_->hasStore()) return true;
  refresh();
  const std::vector<Cell> dirty = findDirty();
  stored_->retryNow();
  return dirty.empty() ? stored_->write({}, map_, step_) : write(dirty);
}

void MapWindow::addStored(const Cell& page, const SnapshotLimits& limits,
                          MapSnapshot& snapshot) const {
  for (VoxelBrick& brick : stored_->read(page)) snapshot.bricks.push_back(std::move(brick));
  if (snapshot.bricks.size() <= limits.max_bricks) return;
  throw MapFileError(MapFileDefect::kTooBig, stored_->file() + " has more than " +
                                                 std::to_string(limits.max_bricks) +
                                                 " bricks of 8 x 8 x 8 voxels");
}

void MapWindow::saveHead() {
  if (stored_->hasStore()) stored_->writeHead(map_);
}

WindowFigures MapWindow::figures() const {
  WindowFigures figures = figures_;
  figures.num_in_memory = pages_.size();
  stored_->addTo(figures);
  return figures;
}

}  // namespace cuboid_mapping
