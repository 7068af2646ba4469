// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/voxels/voxel_store.h"

#include "cuboid_mapping/geometry/box_faces.h"
#include "cuboid_mapping/parallel/parallel_for.h"
#include "cuboid_mapping/voxels/brick_store.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace cuboid_mapping {
namespace {

/// Number of bricks that a thread takes at a time.
constexpr std::size_t kPartBricks = 64;

/// Completes a reclassified brick: counts, bounds, cuboids.
void complete(const PackedVoxels& before, const VoxelStore::Work& work,
              VoxelStore::PendingBrick& brick) {
  brick.is_gone = brick.voxels.isEmpty();
  const BrickMask occupied = brick.voxels.occupied();
  const BrickMask known = brick.voxels.known();
  const BrickMask known_before = before.known();
  const bool has_other_known = known != known_before;
  const bool is_any_occupied = brick.voxels.isAnyOccupied() || before.isAnyOccupied();
  if (is_any_occupied) brick.occupied = occupied.count() - before.occupied().count();
  brick.free = (has_other_known ? known.count() - known_before.count() : 0) - brick.occupied;
  if (brick.is_gone) return;
  brick.bounds = boundsOf(brick.brick, known);
  brick.has_occupied = brick.voxels.isAnyOccupied();
  brick.has_other_branch = brick.is_new || brick.has_occupied != before.isAnyOccupied() ||
                           (has_other_known && brick.bounds != boundsOf(brick.brick, known_before));
  if (work.divides) brick.cuboids = BrickCuboids(divide(occupied, known.without(occupied)));
}

}  // namespace

VoxelStore::PendingChange::PendingChange() = default;
VoxelStore::PendingChange::PendingChange(PendingChange&& other) noexcept = default;
VoxelStore::PendingChange& VoxelStore::PendingChange::operator=(PendingChange&& other) noexcept =
    default;
VoxelStore::PendingChange::~PendingChange() = default;

VoxelStore::VoxelStore() : bricks_(std::make_unique<BrickTable<Brick>>()) {}
VoxelStore::VoxelStore(VoxelStore&& other) noexcept = default;
VoxelStore& VoxelStore::operator=(VoxelStore&& other) noexcept = default;
VoxelStore::~VoxelStore() = default;

const VoxelBrick* VoxelStore::findBrick(const Cell& brick) const { return bricks_->find(brick); }

void VoxelStore::forEach(FunctionRef<void(const VoxelBrick&)> visit) const {
  std::as_const(*bricks_).forEach(visit);
}

void VoxelStore::forEachIn(const CellBox& box, FunctionRef<void(const VoxelBrick&)> visit) const {
  bricks_->forEachIn(box, visit);
}

Visit VoxelStore::visitIn(const CellBox& box, FunctionRef<Visit(const VoxelBrick&)> visit) const {
  return bricks_->visitIn(box, visit);
}

std::vector<VoxelBrick> VoxelStore::copyIn(const CellBox& box) const {
  std::vector<VoxelBrick> bricks;
  bricks.reserve(maxBricksIn(box));
  forEachIn(box, [&bricks](const VoxelBrick& brick) { bricks.push_back(brick); });
  sortBricks(bricks);
  return bricks;
}

std::uint64_t VoxelStore::maxBricksIn(const CellBox& box) const {
  return static_cast<std::uint64_t>(std::min(numBricks(box), static_cast<double>(size())));
}

std::size_t VoxelStore::size() const { return bricks_->size(); }

/// Computes a change without changing the map.
/// @param brick_of  (std::size_t i) -> Cell, each brick once.
/// @param change_of  (std::size_t i, const PackedVoxels& before, PackedVoxels& after) -> VoxelChange,
///                   called in parallel.
template <typename BrickOfT, typename WorkT>
VoxelStore::PendingChange VoxelStore::prepare(std::size_t count, const Work& work,
                                              BrickOfT brick_of, WorkT change_of) const {
  static const PackedVoxels kUnknown;
  PendingChange pending;
  pending.bricks.resize(count);
  const BrickTable<Brick>& table = *bricks_;
  parallelFor((count + kPartBricks - 1) / kPartBricks, work.threads, [&](std::size_t part) {
    const std::size_t begin = part * kPartBricks;
    const std::size_t end = std::min(count, begin + kPartBricks);
    // Prefetches many bricks together, so that the processor waits for memory once.
    for (std::size_t i = begin; i < end; ++i) table.prefetchSlot(brick_of(i));
    for (std::size_t i = begin; i < end; ++i) table.prefetchItem(brick_of(i));
    for (std::size_t i = begin; i < end; ++i) {
      PendingBrick& brick = pending.bricks[i];
      brick.brick = brick_of(i);
      brick.index = table.indexOf(brick.brick);
      brick.is_new = brick.index == PendingBrick::kNoIndex;
      if (!brick.is_new) table.item(brick.index).voxels.prefetch();
    }
    for (std::size_t i = begin; i < end; ++i) {
      PendingBrick& brick = pending.bricks[i];
      const PackedVoxels& before = brick.is_new ? kUnknown : table.item(brick.index).voxels;
      const VoxelChange change = change_of(i, before, brick.voxels);
      brick.changed = change.changed;
      brick.is_reclassified = !change.reclassified.isEmpty();
      if (brick.is_reclassified) complete(before, work, brick);
    }
  });
  pending.changed.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const PendingBrick& brick = pending.bricks[i];
    if (brick.changed.isEmpty()) continue;
    pending.changed.push_back(static_cast<std::uint32_t>(i));
    pending.num_new += brick.is_new ? 1 : 0;
    pending.num_gone += brick.is_gone ? 1 : 0;
  }
  return pending;
}

VoxelStore::PendingChange VoxelStore::prepare(const std::vector<BrickUpdate>& update,
                                              const SensorModel& model, const Work& work) const {
  return prepare(
      update.size(), work, [&](std::size_t i) { return update[i].brick; },
      [&](std::size_t i, const PackedVoxels& before, PackedVoxels& after) {
        const BrickMask misses = update[i].misses | update[i].grazes.without(before.known());
        return before.observe(update[i].hits, misses, model, after);
      });
}

/// New content of a brick.
struct VoxelStore::Source {
  Cell brick;
  PackedVoxels* voxels;  ///< Null: unknown.
};

VoxelStore::PendingChange VoxelStore::prepareReplace(const CellBox& box,
                                                     std::vector<VoxelBrick> bricks,
                                                     const Work& work) const {
  std::vector<Source> sources;
  forEachIn(box, [&](const VoxelBrick& old) { sources.push_back({old.brick, nullptr}); });
  for (VoxelBrick& brick : bricks) {
    if (brickBox(brick.brick).intersects(box)) sources.push_back({brick.brick, &brick.voxels});
  }
  return prepareReplace(std::move(sources), box, work);
}

VoxelStore::PendingChange VoxelStore::prepareReplace(std::vector<VoxelBrick> bricks,
                                                     const Work& work) const {
  std::vector<Source> sources;
  sources.reserve(bricks.size());
  for (VoxelBrick& brick : bricks) sources.push_back({brick.brick, &brick.voxels});
  constexpr std::int32_t kMax = std::numeric_limits<std::int32_t>::max();
  return prepareReplace(std::move(sources), {{-kMax, -kMax, -kMax}, {kMax, kMax, kMax}}, work);
}

/// @param sources  Where a brick comes twice, the later one counts.
VoxelStore::PendingChange VoxelStore::prepareReplace(std::vector<Source> sources,
                                                     const CellBox& box, const Work& work) const {
  const auto is_before = [](const Source& a, const Source& b) {
    return isBeforeOnMortonCurve(a.brick, b.brick);
  };
  if (!std::is_sorted(sources.begin(), sources.end(), is_before)) {
    std::stable_sort(sources.begin(), sources.end(), is_before);
  }
  std::size_t count = 0;
  for (const Source& source : sources) {
    if (count > 0 && sources[count - 1].brick == source.brick) --count;
    sources[count++] = source;
  }
  return prepare(
      count, work, [&](std::size_t i) { return sources[i].brick; },
      [&](std::size_t i, const PackedVoxels& before, PackedVoxels& after) {
        const auto& [brick, voxels] = sources[i];
        const CellBox part = intersect(brickBox(brick), box);
        return before.replace(BrickMask::ofBox(part),
                              voxels == nullptr ? PackedVoxels() : std::move(*voxels), after);
      });
}

void VoxelStore::reserve(const PendingChange& change) {
  if (change.num_new > 0) bricks_->reserve(size() + change.num_new);
}

void VoxelStore::commit(PendingChange& change,
                        FunctionRef<void(const PendingBrick&)> follow) noexcept {
  for (const std::uint32_t i : change.changed) {
    commit(change.bricks[i]);
    follow(change.bricks[i]);
  }
}

void VoxelStore::commit(PendingBrick& brick) noexcept {
  num_free_ += brick.free;
  num_occupied_ += brick.occupied;
  if (brick.is_gone) {
    Brick& gone = bricks_->item(brick.index);
    std::swap(gone.voxels, brick.voxels);
    gone.cuboids.swap(brick.cuboids);
    bricks_->erase(brick.brick);
    return;
  }
  if (brick.is_new) {
    bricks_->findOrAdd(brick.brick);
    brick.index = bricks_->indexOf(brick.brick);
  }
  Brick& now = bricks_->item(brick.index);
  std::swap(now.voxels, brick.voxels);
  if (brick.is_reclassified) now.cuboids.swap(brick.cuboids);
}

void VoxelStore::apply(const std::vector<BrickUpdate>& update, const SensorModel& model,
                       const Work& work) {
  PendingChange change = prepare(update, model, work);
  reserve(change);
  commit(change, [](const PendingBrick& /*brick*/) {});
}

std::size_t VoxelStore::numBytes() const {
  std::size_t num_bytes = bricks_->numBytes();
  std::as_const(*bricks_).forEach([&num_bytes](const Brick& brick) {
    num_bytes += brick.voxels.numBytes() + brick.cuboids.numBytes();
  });
  return num_bytes;
}

}  // namespace cuboid_mapping
