// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/tree_writer.h"

#include <cassert>

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
