// SPDX-License-Identifier: BSD-3-Clause
// The part of GrowthFusion that puts voxels into the R-tree before cells grow.
#include "cuboid_mapping/fusion/brick_division.h"
#include "cuboid_mapping/fusion/growth_fusion.h"
#include "cuboid_mapping/rtree/traversal.h"
#include "cuboid_mapping/voxels/brick_store.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <utility>

namespace cuboid_mapping {
namespace {

/// The rest of a cuboid after cells are cut out of it.
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
      pieces.push_back({part.box, cuboid.occupancy});
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

BrickMask findStable(const PackedVoxels& voxels, const SensorModel& model) {
  BrickMask stable;
  voxels.forEachValue([&](float log_odds, const BrickMask& of_value) {
    if (model.isStable(log_odds)) stable |= of_value;
  });
  return stable;
}

/// Divides voxels of a brick that are in no cuboid: boxes of voxels that may be fused, and single
/// cells.
void divideFresh(const VoxelBrick& brick, const BrickMask& fresh, const BrickMask& fusible,
                 std::vector<Cuboid>& cuboids) {
  const PackedVoxels& voxels = brick.voxels;
  forEachCell(brick.brick, fresh.without(fusible) & voxels.known(), [&](const Cell& cell) {
    cuboids.push_back({CellBox::ofCell(cell), voxels.at(voxelIndex(cell))});
  });
  divideVoxels(brick.brick, fresh & fusible & voxels.free(), Occupancy::kFree, cuboids);
  divideVoxels(brick.brick, fresh & fusible & voxels.occupied(), Occupancy::kOccupied, cuboids);
}

/// Computes the changes of the tree from changed voxels.
class CellWriter {
 public:
  /// @param is_edit  Stable voxels that were unknown may be cuboids of several voxels.
  CellWriter(const RTree& tree, bool is_edit) : tree_(tree), is_edit_(is_edit) {}

  /// @param after  The brick after the change. @param stable  Its stable voxels.
  /// @return Voxels that are split out of a cuboid.
  BrickMask write(const VoxelBrick& after, const BrickMask& changed, const BrickMask& stable) {
    findOwners(after.brick);
    BrickMask split;
    BrickMask fresh;
    forEachCell(after.brick, changed, [&](const Cell& cell) {
      const int voxel = voxelIndex(cell);
      const std::uint32_t owner = owners_[static_cast<std::size_t>(voxel)];
      const Occupancy occupancy = after.voxels.at(voxel);
      if (owner == kNobody) return fresh.set(voxel);
      const Cuboid& old = cuboids_[owner];
      const bool is_single = old.box == CellBox::ofCell(cell);
      if (old.occupancy == occupancy && (is_single || stable.test(voxel))) return;
      if (is_single) return rewrite(old.box, occupancy);
      split.set(voxel);
      Cut& cut = cuts_[old.box.min];
      cut.cuboid = old;
      cut.cells.push_back(cell);
      if (occupancy != Occupancy::kUnknown) {
        writes_.added.push_back({CellBox::ofCell(cell), occupancy});
      }
    });
    divideFresh(after, fresh, is_edit_ ? stable : BrickMask(), writes_.added);
    return split;
  }

  [[nodiscard]] CellWrites finish() {
    for (auto& [min, cut] : cuts_) {
      std::vector<Cuboid> pieces;
      cutOut(cut.cuboid, std::move(cut.cells), pieces);
      writes_.split.push_back(cut.cuboid.box);
      if (pieces.empty()) {
        writes_.removed.push_back(cut.cuboid.box);
        continue;
      }
      writes_.replaced.emplace_back(cut.cuboid.box, pieces.front());
      writes_.added.insert(writes_.added.end(), pieces.begin() + 1, pieces.end());
    }
    return std::move(writes_);
  }

  std::vector<CellWrites::BrickWrite>& bricks() { return writes_.bricks; }

 private:
  static constexpr std::uint32_t kNobody = 0xFFFFFFFFU;

  /// A cuboid of several voxels, and cells that leave it.
  struct Cut {
    Cuboid cuboid;
    std::vector<Cell> cells;
  };

  void rewrite(const CellBox& single, Occupancy occupancy) {
    if (occupancy == Occupancy::kUnknown) {
      writes_.removed.push_back(single);
    } else {
      writes_.replaced.emplace_back(single, Cuboid{single, occupancy});
    }
  }

  void findOwners(const Cell& brick) {
    owners_.fill(kNobody);
    cuboids_.clear();
    visitBox(tree_, brickBox(brick), CuboidFilter::kAll, [&](const Cuboid& cuboid) {
      const auto owner = static_cast<std::uint32_t>(cuboids_.size());
      cuboids_.push_back(cuboid);
      BrickMask::ofBox(intersect(cuboid.box, brickBox(brick))).forEach([&](int voxel) {
        owners_[static_cast<std::size_t>(voxel)] = owner;
      });
      return Visit::kContinue;
    });
  }

  const RTree& tree_;
  bool is_edit_;
  std::vector<Cuboid> cuboids_;                     ///< Cuboids that share voxels with the brick.
  std::array<std::uint32_t, kBrickVoxels> owners_;  ///< Index in cuboids_ by voxel.
  std::map<Cell, Cut> cuts_;                        ///< Cuts by the least cell of their cuboid.
  CellWrites writes_;
};

}  // namespace

/// Updates voxels cell by cell, and leaves all other cuboids as they are (paper, Section
/// VI: a contradicted cell is split at the resolution of the grid).
CellWrites GrowthFusion::prepare(const VoxelStore::PendingChange& change, bool is_edit) {
  CellWriter writer(tree_, is_edit);
  for (const std::uint32_t i : change.changed) {
    const VoxelStore::PendingBrick& brick = change.bricks[i];
    const VoxelBrick after{brick.brick, brick.voxels};
    const BrickMask stable = findStable(after.voxels, model_);
    const BrickMask split = writer.write(after, brick.changed, stable);
    BrickMask fusible = stable.without(settling_.heldIn(brick.brick));
    if (!is_edit && config_.settle_clouds > 0) fusible &= ~split;
    writer.bricks().push_back({brick.brick, brick.changed, split, fusible, brick.is_reclassified});
  }
  CellWrites writes = writer.finish();
  reserve(writes);
  return writes;
}

CellWrites GrowthFusion::prepare(const VoxelStore& voxels, const SensorModel& model) {
  CellWriter writer(tree_, true);
  struct Changed {
    Cell brick;
    BrickMask voxels;
  };
  std::vector<Changed> changed;
  voxels.forEach([&](const VoxelBrick& brick) {
    const BrickMask other = findStable(brick.voxels, model_) ^ findStable(brick.voxels, model);
    if (!other.isEmpty()) changed.push_back({brick.brick, other});
  });
  sortBricks(changed);
  for (const Changed& brick : changed) {
    const VoxelBrick& now = *voxels.findBrick(brick.brick);
    const BrickMask stable = findStable(now.voxels, model);
    const BrickMask split = writer.write(now, brick.voxels, stable);
    writer.bricks().push_back(
        {brick.brick, brick.voxels, split, stable.without(settling_.heldIn(brick.brick)), false});
  }
  CellWrites writes = writer.finish();
  reserve(writes);
  return writes;
}

void GrowthFusion::reserve(const CellWrites& writes) {
  fusible_.reserve(fusible_.size() + writes.bricks.size());
  tree_.reserve(writes.added.size(), writes.removed.size());
}

void GrowthFusion::commit(const CellWrites& writes) noexcept {
  for (const auto& [box, cuboid] : writes.replaced) (void)tree_.replace(box, cuboid);
  for (const CellBox& box : writes.removed) (void)tree_.removeReserved(box);
  for (const Cuboid& cuboid : writes.added) tree_.insertReserved(cuboid);
  for (const CellWrites::BrickWrite& brick : writes.bricks) {
    if (brick.fusible.isEmpty()) {
      fusible_.erase(brick.brick);
    } else {
      fusible_.findOrAdd(brick.brick).fusible = brick.fusible;
    }
  }
}

}  // namespace cuboid_mapping
