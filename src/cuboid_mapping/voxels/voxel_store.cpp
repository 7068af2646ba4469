// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/voxels/voxel_store.h"

#include "cuboid_mapping/parallel/parallel_for.h"

#include <algorithm>
#include <utility>

namespace cuboid_mapping {
namespace {

/// Bricks that a thread takes at a time.
constexpr std::size_t kPartBricks = 64;

bool touches(const CellBox& bounds, const CellBox& box) {
  for (int axis = 0; axis < 3; ++axis) {
    if (box.min[axis] == bounds.min[axis] || box.max[axis] == bounds.max[axis]) return true;
  }
  return false;
}

}  // namespace

bool VoxelStore::isAnyOccupied(const CellBox& box) const {
  const auto is_occupied = [&box](const VoxelBrick& brick) {
    if (!brick.voxels.isAnyOccupied()) return false;
    const CellBox part = intersect(box, brickBox(brick.brick));
    return brick.voxels.occupied().intersects(BrickMask::ofBox(part));
  };
  if (numBricks(box) > static_cast<double>(bricks_.size())) {
    bool found = false;
    forEachIn(box, [&](const VoxelBrick& brick) { found = found || is_occupied(brick); });
    return found;
  }
  return anyBrick(box, [&](const Cell& brick) {
    const VoxelBrick* found = bricks_.find(brick);
    return found != nullptr && is_occupied(*found);
  });
}

/// Works everything out beside the map.
/// @param brick_of  (std::size_t i) -> Cell, each brick once.
/// @param work  (std::size_t i, const PackedVoxels& before, PackedVoxels& after) -> VoxelChange,
///              called side by side.
template <typename BrickOfT, typename WorkT>
VoxelStore::PendingChange VoxelStore::prepare(std::size_t count, int threads, BrickOfT brick_of,
                                              WorkT work) {
  static const PackedVoxels kUnknown;
  PendingChange pending;
  std::vector<NewBrick>& bricks = pending.bricks_;
  bricks.resize(count);
  parallelFor((count + kPartBricks - 1) / kPartBricks, threads, [&](std::size_t part) {
    const std::size_t begin = part * kPartBricks;
    const std::size_t end = std::min(count, begin + kPartBricks);
    for (std::size_t i = begin; i < end; ++i) {  // So that the processor waits for many at a time.
      bricks[i].place = bricks_.find(brick_of(i));
      if (bricks[i].place != nullptr) bricks[i].place->voxels.prefetch();
    }
    for (std::size_t i = begin; i < end; ++i) {
      NewBrick& brick = bricks[i];
      const PackedVoxels& before = brick.place == nullptr ? kUnknown : brick.place->voxels;
      const VoxelChange change = work(i, before, brick.voxels);
      brick.changed = change.changed;
      brick.is_reclassified = !change.reclassified.isEmpty();
      if (!brick.is_reclassified) continue;
      brick.free = brick.voxels.free().count() - before.free().count();
      brick.occupied = brick.voxels.occupied().count() - before.occupied().count();
    }
  });

  pending.changes_.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (bricks[i].changed.isEmpty()) continue;
    pending.changes_.push_back({brick_of(i), bricks[i].changed, bricks[i].is_reclassified});
    if (bricks[i].place == nullptr) ++pending.num_new_;
  }
  return pending;
}

/// Puts it there when nothing can fail any more.
const std::vector<BrickChange>& VoxelStore::commit(PendingChange& change,
                                                   const Announce& announce) {
  bricks_.reserve(bricks_.size() + change.num_new_);
  if (announce) announce(change.changes_);
  auto changed = change.changes_.begin();
  for (NewBrick& brick : change.bricks_) {
    if (!brick.changed.isEmpty()) commit((changed++)->brick, brick);
  }
  if (is_shrinking_) computeBounds();
  return change.changes_;
}

/// @pre There is room for it.
void VoxelStore::commit(const Cell& cell, NewBrick& brick) noexcept {
  num_free_ += brick.free;
  num_occupied_ += brick.occupied;
  if (brick.voxels.isEmpty()) {
    bricks_.erase(cell);
    is_shrinking_ |= touches(*bounds_, brickBox(cell));
    return;
  }
  if (brick.place == nullptr) brick.place = &bricks_.at(cell);
  std::swap(brick.place->voxels, brick.voxels);
  if (!bounds_ || !bounds_->contains(cell)) {
    bounds_ = bounds_ ? unite(*bounds_, brickBox(cell)) : brickBox(cell);
  }
}

VoxelStore::PendingChange VoxelStore::prepare(const std::vector<BrickUpdate>& update,
                                              const SensorModel& model, int threads) {
  return prepare(
      update.size(), threads, [&](std::size_t i) { return update[i].brick; },
      [&](std::size_t i, const PackedVoxels& before, PackedVoxels& after) {
        const BrickMask misses = update[i].misses | update[i].grazes.without(before.known());
        return before.observe(update[i].hits, misses, model, after);
      });
}

std::vector<BrickChange> VoxelStore::apply(const std::vector<BrickUpdate>& update,
                                           const SensorModel& model, int threads,
                                           const Announce& announce) {
  PendingChange change = prepare(update, model, threads);
  commit(change, announce);
  return std::move(change.changes_);  // A copy could fail.
}

std::vector<BrickChange> VoxelStore::replace(const CellBox& box,
                                             const std::vector<VoxelBrick>& bricks,
                                             const Announce& announce) {
  struct Source {
    Cell brick;
    const PackedVoxels* voxels;
  };
  static const PackedVoxels kUnknown;
  std::vector<Source> sources;
  forEachIn(box, [&](const VoxelBrick& old) { sources.push_back({old.brick, &kUnknown}); });
  for (const VoxelBrick& brick : bricks) {
    if (!intersect(brickBox(brick.brick), box).isEmpty()) {
      sources.push_back({brick.brick, &brick.voxels});
    }
  }
  // Of two with one brick, the new voxels come last.
  std::stable_sort(sources.begin(), sources.end(), [](const Source& a, const Source& b) {
    return isBeforeOnMortonCurve(a.brick, b.brick);
  });
  std::size_t count = 0;
  for (const Source& source : sources) {
    if (count > 0 && sources[count - 1].brick == source.brick) --count;
    sources[count++] = source;
  }
  PendingChange change = prepare(
      count, 1, [&](std::size_t i) { return sources[i].brick; },
      [&](std::size_t i, const PackedVoxels& before, PackedVoxels& after) {
        const CellBox part = intersect(brickBox(sources[i].brick), box);
        return before.replace(BrickMask::ofBox(part), *sources[i].voxels, after);
      });
  commit(change, announce);
  return std::move(change.changes_);  // A copy could fail.
}

void VoxelStore::computeBounds() {
  is_shrinking_ = false;
  bounds_.reset();
  forEach([this](const VoxelBrick& brick) {
    bounds_ = bounds_ ? unite(*bounds_, brickBox(brick.brick)) : brickBox(brick.brick);
  });
}

std::size_t VoxelStore::numBytes() const {
  std::size_t num_bytes = bricks_.numBytes();
  forEach([&num_bytes](const VoxelBrick& brick) { num_bytes += brick.voxels.numBytes(); });
  return num_bytes;
}

}  // namespace cuboid_mapping
