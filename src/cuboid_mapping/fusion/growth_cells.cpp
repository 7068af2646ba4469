// SPDX-License-Identifier: BSD-3-Clause
// The part of GrowthFusion that brings voxels into the R-tree, before anything grows.
#include "cuboid_mapping/fusion/brick_division.h"
#include "cuboid_mapping/fusion/growth_fusion.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <new>
#include <utility>

namespace cuboid_mapping {
namespace {

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

/// Voxels of a brick that are in no cuboid: boxes of those that may be fused, single cells of the
/// others.
void divideFresh(const VoxelBrick& brick, const BrickMask& fresh, const BrickMask& fusible,
                 std::vector<Cuboid>& cuboids) {
  const PackedVoxels& voxels = brick.voxels;
  forEachCell(brick.brick, fresh.without(fusible) & voxels.known(), [&](const Cell& cell) {
    cuboids.push_back({CellBox::ofCell(cell), voxels.occupancyAt(voxelIndex(cell))});
  });
  divideVoxels(brick.brick, fresh & fusible & voxels.free(), Occupancy::kFree, cuboids);
  divideVoxels(brick.brick, fresh & fusible & voxels.occupied(), Occupancy::kOccupied, cuboids);
}

/// Writes the changed voxels of a few neighbouring bricks.
class CellWriter {
 public:
  CellWriter(const RTree& tree, const CellBox& window) { tree.select(window, selection_); }

  /// @param after  The brick as it is now. @param stable  Of these.
  /// @param is_edit  Stable voxels that were unknown may be cuboids of several voxels.
  /// @return The voxels that are split out of a cuboid.
  BrickMask write(const BrickChange& change, const VoxelBrick& after, const BrickMask& stable,
                  bool is_edit) {
    findOwners(change.brick);
    BrickMask split;
    BrickMask fresh;
    forEachCell(change.brick, change.changed, [&](const Cell& cell) {
      const int voxel = voxelIndex(cell);
      const std::uint32_t owner = owners_[static_cast<std::size_t>(voxel)];
      const Occupancy occupancy = after.voxels.occupancyAt(voxel);
      if (owner == kNobody) return fresh.set(voxel);
      const Cuboid& old = selection_.cuboids[owner];
      const bool is_single = old.box == CellBox::ofCell(cell);
      if (old.occupancy == occupancy && (is_single || stable.test(voxel))) return;
      if (!is_single) split.set(voxel);
      cut_[owner].push_back(cell);
      if (occupancy != Occupancy::kUnknown)
        result_.added.push_back({CellBox::ofCell(cell), occupancy});
    });
    divideFresh(after, fresh, is_edit ? stable : BrickMask(), result_.added);
    result_.endPart();
    return split;
  }

  /// @param changes  Gets the bricks of cuboids that are split.
  [[nodiscard]] TreeChange finish(ChangeSet& changes) {
    for (const auto& [owner, cells] : cut_) {
      const Cuboid& old = selection_.cuboids[owner];
      result_.removed.push_back(selection_.slots[owner]);
      cutOut(old, cells, result_.added);
      changes.addCuboidsIn(old.box);
    }
    result_.endPart();
    return std::move(result_);
  }

 private:
  static constexpr std::uint32_t kNobody = 0xFFFFFFFFU;

  void findOwners(const Cell& brick) {
    owners_.fill(kNobody);
    for (std::uint32_t i = 0; i < selection_.cuboids.size(); ++i) {
      const CellBox part = intersect(selection_.cuboids[i].box, brickBox(brick));
      if (part.isEmpty()) continue;
      BrickMask::ofBox(part).forEach(
          [&](int voxel) { owners_[static_cast<std::size_t>(voxel)] = i; });
    }
  }

  Selection selection_;
  std::array<std::uint32_t, kBrickVoxels> owners_;  ///< Of the brick at hand.
  std::map<std::uint32_t, std::vector<Cell>> cut_;  ///< Cells that leave their owner.
  TreeChange result_;
};

}  // namespace

/// Brings voxels up to date cell by cell, and leaves all other cuboids as they are (paper, Section
/// VI: a contradicted cell is split at the resolution of the grid).
std::vector<GrowthFusion::CellChange> GrowthFusion::writeCells(
    const VoxelStore& voxels, const std::vector<BrickChange>& changed, bool is_edit,
    ChangeSet& changes) {
  std::vector<CellChange> cell_changes;
  for (auto first = changed.begin(); first != changed.end();) {
    const Cell group = groupOf(first->brick);
    CellBox window = brickBox(first->brick);
    auto last = first;
    for (; last != changed.end() && groupOf(last->brick) == group; ++last) {
      window = unite(window, brickBox(last->brick));
    }
    CellWriter writer(tree_, window);
    for (; first != last; ++first) {
      const VoxelBrick unknown{first->brick, {}};
      const VoxelBrick* found = voxels.findBrick(first->brick);
      const VoxelBrick& after = found == nullptr ? unknown : *found;
      const BrickMask stable = findStable(after.voxels, model_);
      const BrickMask split = writer.write(*first, after, stable, is_edit);
      cell_changes.push_back({first->brick, first->changed, split});
      changes.bricks.push_back({first->brick, first->is_reclassified});
    }
    tree_.replace(writer.finish(changes));
  }
  return cell_changes;
}

void GrowthFusion::updateFusible(const VoxelStore& voxels, const Cell& brick) {
  const PackedVoxels* found = voxels.find(brick);
  const BrickMask fusible =
      found == nullptr ? BrickMask() : findStable(*found, model_).without(settling_.heldIn(brick));
  if (fusible.isEmpty()) {
    fusible_.erase(brick);
  } else {
    fusible_.at(brick).fusible = fusible;
  }
}

void GrowthFusion::divide(const VoxelBrick& brick, std::vector<Cuboid>& cuboids) const {
  divideFresh(brick, brick.voxels.known(), findStable(brick.voxels, model_), cuboids);
}

void GrowthFusion::writeEdit(const VoxelStore& voxels, const std::vector<BrickChange>& changed,
                             ChangeSet& changes) {
  for (const CellChange& change : writeCells(voxels, changed, true, changes)) {
    updateFusible(voxels, change.brick);
  }
}

/// Makes the tree anew of all voxels, as if they came in an edit.
void GrowthFusion::writeAll(const VoxelStore& voxels) {
  std::vector<BrickChange> all;
  voxels.forEach([&all](const VoxelBrick& brick) {
    all.push_back({brick.brick, brick.voxels.known(), true});
  });
  sortBricks(all);
  ChangeSet ignored;
  do_all_wait_ = false;
  writeEdit(voxels, all, ignored);
}

/// Lets the tree follow the voxels. @param work  What is to be done when it is not lost.
template <typename WorkT>
void GrowthFusion::follow(const VoxelStore& voxels, ChangeSet& changes, WorkT work) noexcept {
  changes.is_everything |= do_all_wait_;
  changes.is_everything |= !changeTree([&] { do_all_wait_ ? writeAll(voxels) : work(); });
}

void GrowthFusion::noteCloud(const VoxelStore& voxels, const ScanUpdate& update,
                             const std::vector<BrickChange>& changed, ChangeSet& changes) noexcept {
  ++num_clouds_;
  follow(voxels, changes, [&] { writeAndGrow(voxels, update, changed, changes); });
}

void GrowthFusion::noteEdit(const VoxelStore& voxels, const std::vector<BrickChange>& changed,
                            ChangeSet& changes) noexcept {
  follow(voxels, changes, [&] { writeEdit(voxels, changed, changes); });
}

void GrowthFusion::setSensorModel(const VoxelStore& voxels, const SensorModel& model,
                                  ChangeSet& changes) noexcept {
  const SensorModel old = std::exchange(model_, model);
  follow(voxels, changes, [&] {
    std::vector<BrickChange> changed;
    voxels.forEach([&](const VoxelBrick& brick) {
      const BrickMask other = findStable(brick.voxels, old) ^ findStable(brick.voxels, model);
      if (!other.isEmpty()) changed.push_back({brick.brick, other, false});
    });
    sortBricks(changed);
    writeEdit(voxels, changed, changes);
  });
}

void GrowthFusion::fuse(const VoxelStore& voxels, std::size_t /*max_bricks*/) {
  if (do_all_wait_ && !changeTree([&] { writeAll(voxels); })) throw std::bad_alloc();
}

}  // namespace cuboid_mapping
