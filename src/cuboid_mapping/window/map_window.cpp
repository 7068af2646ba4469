// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/window/map_window.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <stdexcept>

namespace cuboid_mapping {
namespace {

/// Steps after which a failed write is repeated.
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

/// The cells of a cube, cut at the limits of a map.
CellBox cubeAround(const Eigen::Vector3d& center_cells, double edge_cells) {
  CellBox cube;
  constexpr double kMax = Grid::kMaxCell;
  for (int axis = 0; axis < 3; ++axis) {
    const double min = std::floor(center_cells[axis] - 0.5 * edge_cells);
    const double max = std::ceil(center_cells[axis] + 0.5 * edge_cells);
    cube.min[axis] = static_cast<std::int32_t>(std::clamp(min, -kMax, kMax));
    cube.max[axis] = static_cast<std::int32_t>(std::clamp(max, -kMax, kMax));
  }
  return cube;
}

std::vector<VoxelBrick> bricksOf(const CuboidMap& map, const Cell& page) {
  std::vector<VoxelBrick> bricks;
  map.voxels().forEachIn(pageBox(page), [&](const VoxelBrick& brick) { bricks.push_back(brick); });
  sortBricks(bricks);
  return bricks;
}

/// Number of pages that share a cell with a box.
double numPages(const CellBox& box) {
  double count = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    // Computed in double: a box may be wider than an int32.
    count *= 1.0 + (1.0 * pageOf(box.max)[axis] - pageOf(box.min)[axis]) / kPageEdge;
  }
  return count;
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

const char* toString(OutsideWindow outside) {
  switch (outside) {
    case OutsideWindow::kKeep: return "keep";
    case OutsideWindow::kForget: return "forget";
    default: return "refuse";
  }
}

CellBox cellsKeptAround(const Eigen::Vector3d& center_map, const WindowConfig& config,
                        const Grid& grid) {
  return cubeAround(grid.toCellUnits(center_map),
                    (config.size_m + 2.0 * config.margin_m) / grid.resolution());
}

MapWindow::MapWindow(const WindowConfig& config, std::unique_ptr<MapStore> store,
                     const CuboidMap& map)
    : config_(config), store_(std::move(store)) {
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
  map.voxels().forEach([this](const VoxelBrick& brick) {
    pages_[pageOf(brick.brick)].is_changed = true;
    stored_.erase(pageOf(brick.brick));
  });
}

const ScanUpdate& MapWindow::admit(const ScanUpdate& update, const Eigen::Vector3d& center_map,
                                   CuboidMap& map, ChangeSet& changes) {
  ++step_;
  num_loaded_now_ = 0;
  changes.revision = map.revision();
  moveTo(center_map, map.grid());
  const PageSet left_out = bringBack(findTouched(update), map, changes);
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

void MapWindow::settle(const ChangeSet& applied, CuboidMap& map, ChangeSet& changes) {
  note(applied);
  changes.append(applied);
  bringAhead(map, changes);
  if (!is_held_ && (!store_ || step_ % kStepsAWrite == 0)) {
    letLeave(findLeaving(map), map, changes);
  }
}

void MapWindow::moveTo(const Eigen::Vector3d& center_map, const Grid& grid) {
  const Eigen::Vector3d center = grid.toCellUnits(center_map);
  window_ = cubeAround(center, config_.size_m / grid.resolution());
  outer_ = cellsKeptAround(center_map, config_, grid);
  const CellBox pages{pageOf(window_.min), pageOf(window_.max)};
  if (step_ > 1 && pages == window_pages_) return;
  window_pages_ = pages;
  ahead_.clear();
  for (const Cell& page : stored_) {
    if (window_.intersects(pageBox(page)) && unreadable_.count(page) == 0) ahead_.push_back(page);
  }
}

/// @return Touched pages that cannot take observations.
MapWindow::PageSet MapWindow::bringBack(const std::vector<Cell>& touched, CuboidMap& map,
                                        ChangeSet& changes) {
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
      if (unreadable_.count(page) > 0) {
        left_out.insert(page);
      } else if (stored_.count(page) > 0) {
        loadPage(page, map, changes);
      } else {
        pages_[page].last_use = step_;
      }
    } catch (const MapFileError& error) {
      noteFailure(error.what());
      unreadable_.insert(page);
      left_out.insert(page);
    }
  }
  return left_out;
}

/// Prefetches pages of the window before a cloud touches them, for queries.
void MapWindow::bringAhead(CuboidMap& map, ChangeSet& changes) {
  while (!ahead_.empty() && num_loaded_now_ < kPagesAStep) {
    const Cell page = ahead_.back();
    ahead_.pop_back();
    if (stored_.count(page) == 0 || unreadable_.count(page) > 0) continue;
    try {
      loadPage(page, map, changes);
    } catch (const MapFileError& error) {
      noteFailure(error.what());
      unreadable_.insert(page);
    }
  }
}

void MapWindow::loadPage(const Cell& page, CuboidMap& map, ChangeSet& changes) {
  changes.append(map.replace(store_->read(page)));
  pages_[page].last_use = step_;
  stored_.erase(page);
  ++figures_.num_loads;
  ++num_loaded_now_;
}

std::vector<Cell> MapWindow::findLeaving(const CuboidMap& map) const {
  const bool is_kept = config_.outside == OutsideWindow::kKeep;
  const std::vector<CellBox> locked = is_kept ? std::vector<CellBox>() : map.lockedBoxes();
  std::vector<Cell> leaving;
  for (const auto& [page, state] : pages_) {
    if (outer_.intersects(pageBox(page)) || state.last_use + idleSteps(config_) > step_) {
      continue;
    }
    if (!isAnyLocked(locked, page)) leaving.push_back(page);
  }
  std::sort(leaving.begin(), leaving.end());  // Makes the order independent of the table.
  return leaving;
}

void MapWindow::letLeave(std::vector<Cell> pages, CuboidMap& map, ChangeSet& changes) {
  pages.resize(std::min(pages.size(), std::max(kPagesAStep, pages.size() / kPartLeaving)));
  if (store_) {
    const auto is_changed = [this](const Cell& page) { return pages_.at(page).is_changed; };
    const auto first_changed = std::stable_partition(
        pages.begin(), pages.end(), [&](const Cell& page) { return !is_changed(page); });
    const std::vector<Cell> changed(first_changed, pages.end());
    if (!write(changed, map)) pages.erase(first_changed, pages.end());
  } else {
    figures_.num_forgotten += pages.size();
  }
  for (const Cell& page : pages) {
    const ChangeSet change = map.replace(pageBox(page), std::vector<VoxelBrick>());
    if (store_ && !change.bricks.empty()) stored_.insert(page);
    changes.append(change);
    pages_.erase(page);
  }
}

/// @return Whether the store has these pages now.
bool MapWindow::write(const std::vector<Cell>& pages, const CuboidMap& map) {
  if (pages.empty()) return true;
  if (step_ < next_write_) return false;
  const auto bricks_of = [&](const Cell& page) { return bricksOf(map, page); };
  try {
    if (is_store_stale_) {
      store_->replaceAll(headOf(map, *store_), pages, bricks_of);
    } else {
      store_->write(pages, bricks_of);
    }
  } catch (const MapFileError& error) {
    noteFailure(error.what());
    next_write_ = step_ + kRetrySteps;
    return false;
  }
  is_store_stale_ = false;
  figures_.num_writes += pages.size();
  for (const Cell& page : pages) pages_.at(page).is_changed = false;
  return true;
}

void MapWindow::noteFailure(const std::string& text) {
  ++figures_.num_failures;
  figures_.last_failure = text;
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

void MapWindow::load(const CellBox& box, CuboidMap& map, ChangeSet& changes,
                     std::size_t max_pages) {
  changes.revision = map.revision();
  std::vector<Cell> pages;
  forEachStored(box, [&](const Cell& page) {
    if (pages.size() < max_pages) pages.push_back(page);
  });
  for (const Cell& page : pages) loadPage(page, map, changes);
}

void MapWindow::note(const ChangeSet& changes) {
  if (changes.is_everything) {
    for (auto& [page, state] : pages_) state.is_changed = true;
  }
  for (const ChangedBrick& brick : changes.bricks) {
    assert(stored_.count(pageOf(brick.brick)) == 0);
    pages_[pageOf(brick.brick)] = {true, step_};
  }
}

void MapWindow::noteReplaced(const CuboidMap& map) {
  pages_.clear();
  stored_.clear();
  unreadable_.clear();
  ahead_.clear();
  map.voxels().forEach([this](const VoxelBrick& brick) {
    pages_[pageOf(brick.brick)] = {true, step_};
  });
  if (!store_) return;
  is_store_stale_ = true;
  next_write_ = step_;
  (void)save(map);
}

std::vector<Cell> MapWindow::findChanged() const {
  std::vector<Cell> changed;
  for (const auto& [page, state] : pages_) {
    if (state.is_changed) changed.push_back(page);
  }
  return changed;
}

bool MapWindow::saveSome(const CuboidMap& map) {
  if (!store_) return false;
  std::vector<Cell> changed = findChanged();
  if (changed.size() <= kPagesAStep) {
    (void)save(map);
    return false;
  }
  changed.resize(kPagesAStep);
  next_write_ = step_;
  return write(changed, map);
}

bool MapWindow::save(const CuboidMap& map) {
  if (!store_) return true;
  const std::vector<Cell> changed = findChanged();
  next_write_ = step_;
  if (!changed.empty() || !is_store_stale_) return write(changed, map);
  try {  // An empty map.
    store_->replaceAll(headOf(map, *store_), {}, {});
    is_store_stale_ = false;
  } catch (const MapFileError& error) {
    noteFailure(error.what());
  }
  return !is_store_stale_;
}

void MapWindow::addStored(const Cell& page, const SnapshotLimits& limits,
                          MapSnapshot& snapshot) const {
  const std::lock_guard<std::mutex> lock(reading_);
  for (VoxelBrick& brick : store_->read(page)) snapshot.bricks.push_back(std::move(brick));
  if (snapshot.bricks.size() <= limits.max_bricks) return;
  throw MapFileError(MapFileDefect::kTooBig, store_->file() + " has more than " +
                                                 std::to_string(limits.max_bricks) +
                                                 " bricks of 8 x 8 x 8 voxels");
}

void MapWindow::saveHead(const CuboidMap& map) {
  if (!store_) return;
  try {
    MapSnapshot head = headOf(map, *store_);
    if (store_->head()) head.progress = store_->head()->progress;
    store_->setHead(head);
  } catch (const MapFileError& error) {
    noteFailure(error.what());
  }
}

WindowFigures MapWindow::figures() const {
  WindowFigures figures = figures_;
  figures.num_in_memory = pages_.size();
  figures.num_on_disk_only = stored_.size();
  return figures;
}

}  // namespace cuboid_mapping
