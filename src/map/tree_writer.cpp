// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/tree_writer.h"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <utility>

namespace cuboid_mapping {
namespace {

void setClasses(const BrickPartition& partition, VoxelClasses& classes) {
  BrickMask known{};
  BrickMask occupied{};
  for (const Cuboid& cuboid : partition.cuboids) {
    const std::uint64_t slice = sliceMask(cuboid.box);
    const bool is_occupied = cuboid.occupancy() == Occupancy::kOccupied;
    for (std::int32_t z = cuboid.box.min.z; z < cuboid.box.max.z; ++z) {
      const auto at = static_cast<std::size_t>(z & 7);
      known[at] |= slice;
      if (is_occupied) occupied[at] |= slice;
    }
  }
  classes.set(partition.brick, known, occupied);
}

/// What is left of a cuboid when cells are cut out of it.
void cutOut(const Cuboid& cuboid, std::vector<Cell> cells, std::vector<Cuboid>& pieces) {
  struct Part {
    CellBox box;
    std::vector<Cell> cells;
  };
  std::vector<Part> parts{{cuboid.box, std::move(cells)}};
  while (!parts.empty()) {
    const Part part = std::move(parts.back());
    parts.pop_back();
    if (part.cells.empty()) {
      pieces.push_back({part.box, cuboid.log_odds});
      continue;
    }
    for (const CellBox& piece : subtract(part.box, CellBox::ofCell(part.cells.front()))) {
      Part next{piece, {}};
      std::copy_if(part.cells.begin(), part.cells.end(), std::back_inserter(next.cells),
                   [&piece](const Cell& cell) { return piece.contains(cell); });
      parts.push_back(std::move(next));
    }
  }
}

bool isInOneBrick(const CellBox& box) { return brickBox(brickOf(box.min)).contains(box); }

}  // namespace

void TreeWriter::write(Partitions::const_iterator first, Partitions::const_iterator last,
                       RTree& tree, ChangeSet& changes, MapContent& content,
                       VoxelClasses& classes) {
  assert(first != last);
  CellBox window = brickBox(first->brick);
  for (auto brick = first; brick != last; ++brick) window = unite(window, brickBox(brick->brick));
  selectMembers(window, tree);

  added_.clear();
  is_removed_.assign(selection_.cuboids.size(), 0);
  std::vector<CellBox> changed;
  for (auto brick = first; brick != last; ++brick) {
    if (!compare(*brick)) continue;
    changed.push_back(brickBox(brick->brick));
    setClasses(*brick, classes);
  }
  if (changed.empty()) return;
  changes.boxes.insert(changes.boxes.end(), changed.begin(), changed.end());
  for (const std::uint32_t i : crossing_) {
    if (is_removed_[i] != 0) changes.boxes.push_back(selection_.cuboids[i].box);
  }
  cutOutside(changed);
  replaceInTree(tree, content);
}

void TreeWriter::selectMembers(const CellBox& window, const RTree& tree) {
  selection_.clear();
  tree.select(window, selection_);
  for (auto& members : members_) members.clear();
  crossing_.clear();
  for (std::uint32_t i = 0; i < selection_.cuboids.size(); ++i) {
    const CellBox& box = selection_.cuboids[i].box;
    if (isInOneBrick(box)) {
      members_[indexInGroup(brickOf(box.min))].push_back(i);
    } else {
      crossing_.push_back(i);
      (void)anyBrick(intersect(box, window), [&](const Cell& brick) {
        members_[indexInGroup(brick)].push_back(i);
        return false;  // On to the next.
      });
    }
  }
}

/// Finds out which cuboids of a brick have gone, and which are new.
/// @return Whether there are any.
bool TreeWriter::compare(const BrickPartition& partition) {
  const std::vector<std::uint32_t>& members = members_[indexInGroup(partition.brick)];
  const std::vector<Cuboid>& cuboids = partition.cuboids;
  std::array<std::int16_t, kBrickVoxels> new_at;
  new_at.fill(-1);
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    new_at[static_cast<std::size_t>(voxelIndex(cuboids[i].box.min))] = static_cast<std::int16_t>(i);
  }
  std::array<bool, kBrickVoxels> is_kept{};
  std::size_t num_kept = 0;
  for (const std::uint32_t i : members) {
    const Cuboid& old = selection_.cuboids[i];
    const bool is_inside = brickBox(partition.brick).contains(old.box);
    const auto at = is_inside ? new_at[static_cast<std::size_t>(voxelIndex(old.box.min))] : -1;
    if (at >= 0 && cuboids[static_cast<std::size_t>(at)] == old) {
      is_kept[static_cast<std::size_t>(at)] = true;
      ++num_kept;
    } else {
      is_removed_[i] = 1;
    }
  }
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    if (!is_kept[i]) added_.push_back(cuboids[i]);
  }
  return num_kept < members.size() || num_kept < cuboids.size();
}

void TreeWriter::cutOutside(const std::vector<CellBox>& changed) {
  for (const std::uint32_t i : crossing_) {
    if (is_removed_[i] == 0) continue;
    const Cuboid& cuboid = selection_.cuboids[i];
    std::vector<CellBox> pieces{cuboid.box};
    for (const CellBox& brick : changed) {
      std::vector<CellBox> rest;
      for (const CellBox& piece : pieces) {
        const BoxPieces outside = subtract(piece, brick);
        rest.insert(rest.end(), outside.begin(), outside.end());
      }
      pieces = std::move(rest);
    }
    for (const CellBox& piece : pieces) added_.push_back({piece, cuboid.log_odds});
  }
}

std::vector<BrickChange> TreeWriter::update(const std::vector<const DenseBrick*>& bricks,
                                            RTree& tree, ChangeSet& changes, MapContent& content,
                                            VoxelClasses& classes) {
  assert(!bricks.empty());
  CellBox window = brickBox(bricks.front()->brick);
  for (const DenseBrick* brick : bricks) window = unite(window, brickBox(brick->brick));
  selectMembers(window, tree);

  added_.clear();
  contradictions_.clear();
  is_removed_.assign(selection_.cuboids.size(), 0);
  std::vector<BrickChange> brick_changes;
  for (const DenseBrick* brick : bricks) {
    const BrickChange change = compareVoxels(*brick);
    if (change.changed == BrickMask{}) continue;
    brick_changes.push_back(change);
    changes.boxes.push_back(brickBox(brick->brick));
    classes.set(brick->brick, brick->known, brick->occupied());
  }
  if (brick_changes.empty()) return brick_changes;
  splitMembers(changes);
  replaceInTree(tree, content);
  return brick_changes;
}

BrickChange TreeWriter::compareVoxels(const DenseBrick& brick) {
  constexpr std::uint32_t kNobody = 0xFFFFFFFFU;
  std::array<std::uint32_t, kBrickVoxels> owners;
  owners.fill(kNobody);
  for (const std::uint32_t i : members_[indexInGroup(brick.brick)]) {
    const CellBox part = intersect(selection_.cuboids[i].box, brickBox(brick.brick));
    forEachCell(brick.brick, toMask(part),
                [&](const Cell& cell) { owners[static_cast<std::size_t>(voxelIndex(cell))] = i; });
  }
  BrickChange change{brick.brick, {}, {}};
  forEachCell(brick.brick, brick.known, [&](const Cell& cell) {
    const auto at = static_cast<std::size_t>(voxelIndex(cell));
    const std::uint32_t owner = owners[at];
    if (owner != kNobody) {
      if (selection_.cuboids[owner].log_odds == brick.log_odds[at]) return;
      is_removed_[owner] = 1;
      if (selection_.cuboids[owner].box != CellBox::ofCell(cell)) {
        contradictions_.push_back({owner, cell});
        change.split[static_cast<std::size_t>(cell.z & 7)] |= voxelBit(cell);
      }
    }
    change.changed[static_cast<std::size_t>(cell.z & 7)] |= voxelBit(cell);
    added_.push_back({CellBox::ofCell(cell), brick.log_odds[at]});
  });
  return change;
}

/// Keeps the rest of the cuboids that are contradicted.
void TreeWriter::splitMembers(ChangeSet& changes) {
  std::stable_sort(
      contradictions_.begin(), contradictions_.end(),
      [](const Contradiction& a, const Contradiction& b) { return a.member < b.member; });
  for (auto first = contradictions_.cbegin(); first != contradictions_.cend();) {
    const Cuboid& cuboid = selection_.cuboids[first->member];
    std::vector<Cell> cells;
    for (const std::uint32_t member = first->member;
         first != contradictions_.cend() && first->member == member; ++first) {
      cells.push_back(first->cell);
    }
    cutOut(cuboid, std::move(cells), added_);
    changes.boxes.push_back(cuboid.box);
  }
}

void TreeWriter::replaceInTree(RTree& tree, MapContent& content) {
  std::vector<LeafSlot> removed;
  for (std::size_t i = 0; i < is_removed_.size(); ++i) {
    if (is_removed_[i] == 0) continue;
    removed.push_back(selection_.slots[i]);
    content.count(selection_.cuboids[i], -1);
  }
  for (const Cuboid& cuboid : added_) content.count(cuboid, 1);
  tree.replace(removed, added_);
}

}  // namespace cuboid_mapping
