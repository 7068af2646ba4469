// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/window/stored_pages.h"

#include <algorithm>
#include <new>
#include <utility>

namespace cuboid_mapping {
namespace {

/// Steps after which a failed write or read is repeated.
constexpr std::uint64_t kRetrySteps = 20;

MapSnapshot headOf(const CuboidMap& map, const MapStore& store) {
  MapSnapshot head{
      map.config().resolution_m, map.config().sensor_model, map.config().environment, {}, {}};
  if (store.head()) head.frame_id = store.head()->frame_id;
  return head;
}

}  // namespace

StoredPages::StoredPages(std::unique_ptr<MapStore> store) : store_(std::move(store)) {
  if (!store_) return;
  for (const Cell& page : store_->pages()) pages_.insert(page);
}

std::vector<Cell> StoredPages::pagesIn(const CellBox& asked, std::size_t max_pages) const {
  const CellBox box = intersect(asked, kAllCells);  // Beyond, the places of pages could overflow.
  std::vector<Cell> found;
  if (box.isEmpty()) return found;
  if (numPages(box) > static_cast<double>(pages_.size())) {
    for (const Cell& page : pages_) {
      if (found.size() < max_pages && box.intersects(pageBox(page))) found.push_back(page);
    }
    return found;
  }
  const Cell first = pageOf(box.min);
  for (std::int32_t z = first.z; z < box.max.z; z += kPageEdge) {
    for (std::int32_t y = first.y; y < box.max.y; y += kPageEdge) {
      for (std::int32_t x = first.x; x < box.max.x; x += kPageEdge) {
        if (found.size() < max_pages && contains({x, y, z})) found.push_back({x, y, z});
      }
    }
  }
  return found;
}

std::vector<VoxelBrick> StoredPages::read(const Cell& page) const {
  const std::lock_guard<std::mutex> lock(store_mutex_);
  return store_->read(page);
}

std::vector<VoxelBrick> StoredPages::take(const Cell& page) {
  const auto fetched = fetched_.find(page);
  if (fetched == fetched_.end()) return read(page);
  std::vector<VoxelBrick> bricks = std::move(fetched->second);
  fetched_.erase(fetched);
  return bricks;
}

void StoredPages::fetch(const std::vector<Cell>& pages, std::uint64_t step) {
  fetched_.clear();
  for (const Cell& page : pages) {
    if (!contains(page) || isUnreadable(page, step)) continue;
    try {
      fetched_[page] = read(page);
    } catch (const MapFileError&) {
      return;
    }
  }
}

void StoredPages::markReplaced() {
  pages_.clear();
  unreadable_.clear();
  fetched_.clear();
  is_replaced_ = hasStore();
}

void StoredPages::noteUnreadable(const Cell& page, std::uint64_t step, const MapFileError& error) {
  noteFailure(error.what());
  unreadable_[page] = step;
}

bool StoredPages::isUnreadable(const Cell& page, std::uint64_t step) const {
  const auto found = unreadable_.find(page);
  return found != unreadable_.end() && step < found->second + kRetrySteps;
}

bool StoredPages::isRetryDue(std::uint64_t step) const {
  return std::any_of(unreadable_.begin(), unreadable_.end(),
                     [step](const auto& tried) { return step == tried.second + kRetrySteps; });
}

bool StoredPages::write(const std::vector<Cell>& pages, const CuboidMap& map, std::uint64_t step) {
  if (pages.empty() && !is_replaced_) return true;
  if (step < next_write_) return false;
  const auto bricks_of = [&map](const Cell& page) { return map.voxels().copyIn(pageBox(page)); };
  try {
    const std::lock_guard<std::mutex> lock(store_mutex_);
    if (is_replaced_) {
      store_->replaceAll(headOf(map, *store_), pages, bricks_of);
    } else {
      store_->write(pages, bricks_of);
    }
  } catch (const MapFileError& error) {
    noteFailure(error.what());
    next_write_ = step + kRetrySteps;
    return false;
  }
  is_replaced_ = false;
  const std::lock_guard<std::mutex> lock(figures_mutex_);
  num_writes_ += pages.size();
  return true;
}

void StoredPages::writeHead(const CuboidMap& map) {
  try {
    const std::lock_guard<std::mutex> lock(store_mutex_);
    MapSnapshot head = headOf(map, *store_);
    if (store_->head()) head.progress = store_->head()->progress;
    store_->setHead(head);
  } catch (const MapFileError& error) {
    noteFailure(error.what());
  }
}

void StoredPages::noteFailure(const char* text) noexcept {
  const std::lock_guard<std::mutex> lock(figures_mutex_);
  ++num_failures_;
  try {
    last_failure_ = text;
  } catch (const std::bad_alloc&) {
    last_failure_.clear();
  }
}

void StoredPages::addTo(WindowFigures& figures) const {
  figures.num_on_disk_only = size();
  const std::lock_guard<std::mutex> lock(figures_mutex_);
  figures.num_writes = num_writes_;
  figures.num_failures = num_failures_;
  figures.last_failure = last_failure_;
}

}  // namespace cuboid_mapping
