// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/cuboid_map.h"

#include <algorithm>
#include <cassert>

namespace cuboid_mapping {
namespace {

/// Number of a brick in its group of 4 x 4 x 4: the low six bits of its Morton code.
std::size_t indexInGroup(const Cell& brick) {
  const auto bits = [](std::int32_t v) { return static_cast<std::size_t>(v >> 3); };
  const std::size_t x = bits(brick.x);
  const std::size_t y = bits(brick.y);
  const std::size_t z = bits(brick.z);
  return (x & 1) | (y & 1) << 1 | (z & 1) << 2 | (x >> 1 & 1) << 3 | (y >> 1 & 1) << 4 |
         (z >> 1 & 1) << 5;
}

/// Calls visit(brick) for every brick that shares a cell with the box.
template <typename VisitorT>
void visitBricks(const CellBox& box, VisitorT visit) {
  const Cell first = brickOf(box.min);
  for (std::int32_t z = first.z; z < box.max.z; z += kBrickEdge) {
    for (std::int32_t y = first.y; y < box.max.y; y += kBrickEdge) {
      for (std::int32_t x = first.x; x < box.max.x; x += kBrickEdge) visit(Cell{x, y, z});
    }
  }
}

/// Adds a cuboid to the content of a map (sign 1), or takes it away (-1).
void count(const Cuboid& cuboid, int sign, MapContent& content) {
  const bool is_occupied = cuboid.occupancy() == Occupancy::kOccupied;
  (is_occupied ? content.occupied_cuboids : content.free_cuboids) += sign;
  (is_occupied ? content.occupied_voxels : content.free_voxels) += sign * cuboid.box.numVoxels();
}

bool isInOneBrick(const CellBox& box) { return brickBox(brickOf(box.min)).contains(box); }

}  // namespace

CuboidMap::CuboidMap(const MapConfig& config)
    : config_(config),
      grid_(config.resolution_m),
      sensor_model_(config.sensor_model, config.environment),
      fusion_(makeFusion(config.fusion)),
      tree_(config.rtree) {
  assert(fusion_ != nullptr);
}

ChangeSet CuboidMap::clear() {
  tree_.clear();
  content_ = {};
  ChangeSet changes;
  changes.revision = ++revision_;
  changes.is_everything = true;
  return changes;
}

ChangeSet CuboidMap::apply(const ScanUpdate& update) {
  ChangeSet changes;
  auto first = update.bricks.begin();
  while (first != update.bricks.end()) {
    const auto last = std::find_if(first, update.bricks.end(), [&](const BrickUpdate& brick) {
      return brick.morton >> 6 != first->morton >> 6;
    });
    applyGroup(first, last, changes);
    first = last;
  }
  if (!changes.boxes.empty()) ++revision_;
  changes.revision = revision_;
  return changes;
}

void CuboidMap::applyGroup(BrickIterator first, BrickIterator last, ChangeSet& changes) {
  CellBox window = brickBox(first->brick);
  for (auto brick = first; brick != last; ++brick) window = unite(window, brickBox(brick->brick));
  selection_.clear();
  tree_.select(window, selection_);
  sortIntoBricks(window);

  added_.clear();
  is_removed_.assign(selection_.cuboids.size(), 0);
  std::vector<CellBox> changed;
  for (auto brick = first; brick != last; ++brick) {
    const std::vector<std::uint32_t>& members = members_[indexInGroup(brick->brick)];
    if (!changesBrick(*brick, members)) continue;
    rebuildBrick(*brick, members);
    changed.push_back(brickBox(brick->brick));
  }
  if (changed.empty()) return;
  changes.boxes.insert(changes.boxes.end(), changed.begin(), changed.end());
  if (!crossing_.empty()) {
    for (const std::uint32_t i : crossing_) {
      if (is_removed_[i] != 0) changes.boxes.push_back(selection_.cuboids[i].box);
    }
    cutOutside(changed);
  }

  replaceInTree();
}

void CuboidMap::replaceInTree() {
  std::vector<LeafSlot> removed;
  for (std::size_t i = 0; i < is_removed_.size(); ++i) {
    if (is_removed_[i] == 0) continue;
    removed.push_back(selection_.slots[i]);
    count(selection_.cuboids[i], -1, content_);
  }
  for (const Cuboid& cuboid : added_) count(cuboid, 1, content_);
  tree_.replace(removed, added_);
}

void CuboidMap::sortIntoBricks(const CellBox& window) {
  for (auto& members : members_) members.clear();
  crossing_.clear();
  for (std::uint32_t i = 0; i < selection_.cuboids.size(); ++i) {
    const CellBox& box = selection_.cuboids[i].box;
    if (isInOneBrick(box)) {
      members_[indexInGroup(brickOf(box.min))].push_back(i);
    } else {
      crossing_.push_back(i);
      visitBricks(intersect(box, window),
                  [&](const Cell& brick) { members_[indexInGroup(brick)].push_back(i); });
    }
  }
}

bool CuboidMap::changesBrick(const BrickUpdate& update,
                             const std::vector<std::uint32_t>& members) const {
  const CellBox box = brickBox(update.brick);
  BrickMask known{};
  for (const std::uint32_t i : members) {
    const Cuboid& cuboid = selection_.cuboids[i];
    const CellBox part = intersect(cuboid.box, box);
    const std::uint64_t mask = sliceMask(part);
    std::uint64_t hits = 0;
    std::uint64_t misses = 0;
    for (std::int32_t z = part.min.z; z < part.max.z; ++z) {
      const auto slice = static_cast<std::size_t>(z & 7);
      known[slice] |= mask;
      hits |= update.hits[slice] & mask;
      misses |= update.misses[slice] & ~update.hits[slice] & mask;
    }
    const float log_odds = cuboid.log_odds;
    if (hits != 0 && sensor_model_.update(log_odds, sensor_model_.hit()) != log_odds) return true;
    if (misses != 0 && sensor_model_.update(log_odds, sensor_model_.miss()) != log_odds)
      return true;
  }
  for (std::size_t z = 0; z < kBrickEdge; ++z) {
    if (((update.hits[z] | update.misses[z]) & ~known[z]) != 0) return true;
  }
  return false;
}

void CuboidMap::rebuildBrick(const BrickUpdate& update, const std::vector<std::uint32_t>& members) {
  dense_.reset(update.brick);
  for (const std::uint32_t i : members) dense_.fill(selection_.cuboids[i]);
  dense_.apply(update, sensor_model_);
  partition_.clear();
  fusion_->partition(dense_, partition_);

  // A cuboid that comes out as it was stays where it is in the tree.
  std::array<std::int16_t, kBrickVoxels> new_at;
  new_at.fill(-1);
  for (std::size_t i = 0; i < partition_.size(); ++i) {
    new_at[static_cast<std::size_t>(voxelIndex(partition_[i].box.min))] =
        static_cast<std::int16_t>(i);
  }
  std::array<bool, kBrickVoxels> is_kept{};
  for (const std::uint32_t i : members) {
    const Cuboid& old = selection_.cuboids[i];
    is_removed_[i] = 1;
    if (!brickBox(update.brick).contains(old.box)) continue;
    const auto at = new_at[static_cast<std::size_t>(voxelIndex(old.box.min))];
    if (at >= 0 && partition_[static_cast<std::size_t>(at)] == old) {
      is_removed_[i] = 0;
      is_kept[static_cast<std::size_t>(at)] = true;
    }
  }
  for (std::size_t i = 0; i < partition_.size(); ++i) {
    if (!is_kept[i]) added_.push_back(partition_[i]);
  }
}

void CuboidMap::cutOutside(const std::vector<CellBox>& changed) {
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

}  // namespace cuboid_mapping
