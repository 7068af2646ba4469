// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/class_fusion.h"

#include "cuboid_mapping/fusion/brick_division.h"
#include "cuboid_mapping/parallel/parallel_for.h"

#include <algorithm>
#include <array>
#include <limits>
#include <new>

namespace cuboid_mapping {
namespace {

/// So many cold bricks are written after a cloud at least; the others may have to wait.
constexpr std::size_t kFewestColdBricks = 64;
/// So many bricks are divided before the tree changes: bounds the memory for their cuboids.
constexpr std::size_t kMaxBatchBricks = 8192;
/// Groups of bricks that a thread compares at a time.
constexpr std::size_t kPartBatches = 16;

void sortAlongMortonCurve(std::vector<Cell>& bricks) {
  std::sort(bricks.begin(), bricks.end(), isBeforeOnMortonCurve);
}

/// What the tree holds of the bricks of a group. Keeps its buffers from one group to the next.
struct GroupMembers {
  Selection selection;
  std::array<std::vector<std::uint32_t>, kGroupBricks> of_brick;  ///< Indices into the selection.

  void select(const CellBox& window, const RTree& tree) {
    selection.clear();
    tree.select(window, selection);
    for (auto& members : of_brick) members.clear();
    for (std::uint32_t i = 0; i < selection.cuboids.size(); ++i) {
      of_brick[indexInGroup(brickOf(selection.cuboids[i].box.min))].push_back(i);
    }
  }
};

/// Finds out which cuboids of a brick have gone, and which are new.
void compareBrick(const GroupMembers& members, const Cell& brick, const std::vector<Cuboid>& now,
                  TreeChange& change) {
  constexpr std::uint16_t kNone = 0xFFFF;
  std::array<std::uint16_t, kBrickVoxels> now_at;
  now_at.fill(kNone);
  for (std::size_t i = 0; i < now.size(); ++i) {
    now_at[static_cast<std::size_t>(voxelIndex(now[i].box.min))] = static_cast<std::uint16_t>(i);
  }
  std::array<bool, kBrickVoxels> is_there{};
  for (const std::uint32_t i : members.of_brick[indexInGroup(brick)]) {
    const Cuboid& old = members.selection.cuboids[i];
    const std::uint16_t at = now_at[static_cast<std::size_t>(voxelIndex(old.box.min))];
    if (at != kNone && now[at] == old) {
      is_there[at] = true;
    } else {
      change.removed.push_back(members.selection.slots[i]);
    }
  }
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (!is_there[i]) change.added.push_back(now[i]);
  }
  change.endPart();
}

}  // namespace

void ClassFusion::announce(const std::vector<BrickChange>& changed, ChangeSet& changes) {
  const std::uint64_t cloud = num_clouds_ + 1;
  std::vector<Cell>& due = due_[cloud + kColdClouds];
  changes.bricks.reserve(changes.bricks.size() + changed.size());
  due.reserve(due.size() + changed.size());
  waiting_.reserve(waiting_.size() + changed.size());
  for (const BrickChange& change : changed) {  // From here on nothing can fail.
    changes.bricks.push_back({change.brick, change.is_reclassified});
    if (!change.is_reclassified || do_all_wait_) continue;
    const std::size_t num_before = waiting_.size();
    waiting_.at(change.brick).cloud = cloud;
    if (waiting_.size() > num_before) due.push_back(change.brick);
  }
}

void ClassFusion::noteCloud(const VoxelStore& voxels, const ScanUpdate& /*update*/,
                            const std::vector<BrickChange>& /*changed*/,
                            ChangeSet& /*changes*/) noexcept {
  ++num_clouds_;
  (void)changeTree([&] {
    if (do_all_wait_) queueAll(voxels);
    fuseCold(voxels);
  });
}

/// Lets the bricks wait one by one that wait all together.
void ClassFusion::queueAll(const VoxelStore& voxels) {
  due_.clear();
  waiting_.reserve(voxels.size());
  std::vector<Cell>& due = due_[num_clouds_];
  due.reserve(voxels.size());
  voxels.forEach([&](const VoxelBrick& brick) {
    waiting_.at(brick.brick);
    due.push_back(brick.brick);
  });
  do_all_wait_ = false;
}

/// Writes bricks that have gone cold; not all at once, when many have.
void ClassFusion::fuseCold(const VoxelStore& voxels) {
  const std::size_t most = std::max(kFewestColdBricks, waiting_.size() / kColdClouds);
  std::vector<Cell> cold;
  while (!due_.empty() && due_.begin()->first <= num_clouds_ && cold.size() < most) {
    std::vector<Cell>& due = due_.begin()->second;
    for (; !due.empty() && cold.size() < most; due.pop_back()) {
      const std::uint64_t last_cloud = waiting_.find(due.back())->cloud;
      if (last_cloud + kColdClouds > num_clouds_) {
        due_[last_cloud + kColdClouds].push_back(due.back());
      } else {
        cold.push_back(due.back());
      }
    }
    if (due.empty()) due_.erase(due_.begin());
  }
  write(voxels, std::move(cold));
}

void ClassFusion::fuse(const VoxelStore& voxels, std::size_t max_bricks) {
  const bool is_done = changeTree([&] {
    if (do_all_wait_) queueAll(voxels);
    write(voxels, takeDue(max_bricks));
  });
  if (!is_done) throw std::bad_alloc();
}

/// Waiting bricks, those first that are to be looked at first.
std::vector<Cell> ClassFusion::takeDue(std::size_t max_bricks) {
  std::vector<Cell> bricks;
  while (!due_.empty() && bricks.size() < max_bricks) {
    std::vector<Cell>& due = due_.begin()->second;
    for (; !due.empty() && bricks.size() < max_bricks; due.pop_back()) bricks.push_back(due.back());
    if (due.empty()) due_.erase(due_.begin());
  }
  return bricks;
}

/// Memory that is used again from one batch to the next.
struct ClassFusion::Scratch {
  GroupMembers members;
  std::vector<Cuboid> cuboids;
};

/// Puts the cuboids of waiting bricks into the tree.
void ClassFusion::write(const VoxelStore& voxels, std::vector<Cell> bricks) {
  sortAlongMortonCurve(bricks);
  for (std::size_t next = 0; next < bricks.size();) {
    std::vector<Batch> batches;
    const std::size_t end = std::min(bricks.size(), next + kMaxBatchBricks);
    while (next < end) {
      const Cell group = groupOf(bricks[next]);
      const Cell* first = &bricks[next];
      while (next < end && groupOf(bricks[next]) == group) ++next;
      batches.push_back({first, bricks.data() + next, {}});
    }
    parallelFor((batches.size() + kPartBatches - 1) / kPartBatches, threads_, [&](std::size_t i) {
      Scratch scratch;
      const std::size_t last = std::min(batches.size(), (i + 1) * kPartBatches);
      for (std::size_t k = i * kPartBatches; k < last; ++k) compare(voxels, batches[k], scratch);
    });
    TreeChange change;
    for (const Batch& batch : batches) change.append(batch.change);
    tree_.replace(change);
  }
  for (const Cell& brick : bricks) waiting_.erase(brick);
  if (waiting_.isEmpty()) waiting_.clear();  // Gives its memory back.
}

void ClassFusion::compare(const VoxelStore& voxels, Batch& batch, Scratch& scratch) const {
  auto& [members, cuboids] = scratch;
  CellBox window = brickBox(*batch.first);
  for (const Cell* brick = batch.first; brick != batch.last; ++brick) {
    window = unite(window, brickBox(*brick));
  }
  members.select(window, tree_);
  for (const Cell* brick = batch.first; brick != batch.last; ++brick) {
    cuboids.clear();
    if (const VoxelBrick* found = voxels.findBrick(*brick)) divide(*found, cuboids);
    compareBrick(members, *brick, cuboids, batch.change);
  }
}

void ClassFusion::divide(const VoxelBrick& brick, std::vector<Cuboid>& cuboids) const {
  if (division_ == BrickDivision::kBoxes) return divideBrick(brick, cuboids);
  forEachCell(brick.brick, brick.voxels.known(), [&](const Cell& cell) {
    cuboids.push_back({CellBox::ofCell(cell), brick.voxels.occupancyAt(voxelIndex(cell))});
  });
}

void ClassFusion::clear() noexcept {
  Fusion::clear();
  due_.clear();
}

std::size_t ClassFusion::numBytes() const {
  std::size_t num_bytes = Fusion::numBytes();
  for (const auto& [cloud, bricks] : due_) num_bytes += bricks.capacity() * sizeof(Cell);
  return num_bytes;
}

}  // namespace cuboid_mapping
