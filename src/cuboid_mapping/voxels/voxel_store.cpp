// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/voxels/voxel_store.h"

#include "cuboid_mapping/parallel/parallel_for.h"

#include <algorithm>

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

/// @param brick_of  (std::size_t i) -> Cell, each brick once.
/// @param work  (std::size_t i, PackedVoxels&) -> VoxelChange, called side by side.
template <typename BrickOfT, typename WorkT>
std::vector<BrickChange> VoxelStore::change(std::size_t count, int threads, BrickOfT brick_of,
                                            WorkT work) {
  struct Task {
    PackedVoxels* voxels;
    BrickMask changed;
    int free;  ///< Voxels that become free, less those that do not stay so.
    int occupied;
    bool is_reclassified;
  };
  std::vector<Task> tasks(count);
  for (std::size_t i = 0; i < count; ++i) tasks[i].voxels = &bricks_.at(brick_of(i)).voxels;
  const std::size_t num_parts = (count + kPartBricks - 1) / kPartBricks;
  parallelFor(num_parts, threads, [&](std::size_t part) {
    const std::size_t end = std::min(count, (part + 1) * kPartBricks);
    for (std::size_t i = part * kPartBricks; i < end; ++i) {
      Task& task = tasks[i];
      const BrickMask free_before = task.voxels->free();
      const BrickMask occupied_before = task.voxels->occupied();
      const VoxelChange change = work(i, *task.voxels);
      task.changed = change.changed;
      task.is_reclassified = !change.reclassified.isEmpty();
      if (!task.is_reclassified) continue;
      task.free = task.voxels->free().count() - free_before.count();
      task.occupied = task.voxels->occupied().count() - occupied_before.count();
    }
  });

  std::vector<BrickChange> changes;
  bool is_shrinking = false;
  for (std::size_t i = 0; i < count; ++i) {
    const Task& task = tasks[i];
    const Cell brick = brick_of(i);
    if (task.voxels->isEmpty()) {
      bricks_.erase(brick);
      is_shrinking |= bounds_ && touches(*bounds_, brickBox(brick));
    } else if (!bounds_ || !bounds_->contains(brick)) {
      bounds_ = bounds_ ? unite(*bounds_, brickBox(brick)) : brickBox(brick);
    }
    if (task.changed.isEmpty()) continue;
    if (task.is_reclassified) {
      num_free_ += task.free;
      num_occupied_ += task.occupied;
    }
    changes.push_back({brick, task.changed, task.is_reclassified});
  }
  if (is_shrinking) computeBounds();
  return changes;
}

std::vector<BrickChange> VoxelStore::apply(const std::vector<BrickUpdate>& update,
                                           const SensorModel& model, int threads) {
  return change(
      update.size(), threads, [&](std::size_t i) { return update[i].brick; },
      [&](std::size_t i, PackedVoxels& voxels) {
        return voxels.apply(update[i].hits, update[i].misses, model);
      });
}

std::vector<BrickChange> VoxelStore::replace(const CellBox& box,
                                             const std::vector<VoxelBrick>& bricks) {
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
  return change(
      count, 1, [&](std::size_t i) { return sources[i].brick; },
      [&](std::size_t i, PackedVoxels& voxels) {
        const CellBox part = intersect(brickBox(sources[i].brick), box);
        return voxels.replace(BrickMask::ofBox(part), *sources[i].voxels);
      });
}

void VoxelStore::computeBounds() {
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
