// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/growth_fusion.h"

#include "cuboid_mapping/fusion/growth_rules.h"
#include "cuboid_mapping/geometry/box_faces.h"
#include "cuboid_mapping/voxels/brick_cuboids.h"
#include "cuboid_mapping/voxels/brick_store.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

namespace cuboid_mapping {
namespace {

/// Calls visit(const CellBox&) for each piece of a box without some of its cells.
template <typename VisitT>
void visitPieces(const CellBox& box, std::vector<Cell> cells, VisitT visit) {
  struct Part {
    CellBox box;
    std::vector<Cell> cells;
  };
  std::vector<Part> parts{{box, std::move(cells)}};
  while (!parts.empty()) {
    const Part part = std::move(parts.back());
    parts.pop_back();
    if (part.cells.empty()) {
      visit(part.box);
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

/// Voxels that leave fused cuboids, which become several (paper, Section VI: a contradicted cell is split at the
/// resolution of the grid).
class CuboidCuts {
 public:
  /// Notes voxels of a brick that leave a cuboid.
  void add(const Cuboid& cuboid, const Cell& brick, const BrickMask& voxels) {
    Cut& cut = cuts_[cuboid.box.min];
    cut.cuboid = cuboid;
    forEachCell(brick, voxels, [&cut](const Cell& cell) { cut.cells.push_back(cell); });
  }

  /// Replaces the noted cuboids by their pieces. The voxels that leave are single cells.
  void apply(GrowingBricks& bricks) {
    for (auto& entry : cuts_) {
      Cut& cut = entry.second;
      bricks.remove(cut.cuboid.box);
      visitPieces(cut.cuboid.box, std::move(cut.cells), [&](const CellBox& piece) {
        if (piece.numVoxels() > 1.0) bricks.add({piece, cut.cuboid.occupancy});
      });
    }
    cuts_.clear();
  }

 private:
  struct Cut {
    Cuboid cuboid;
    std::vector<Cell> cells;
  };

  std::map<Cell, Cut> cuts_;  ///< By the least cell of the cuboid.
};

/// Changed voxels of fused cuboids that must leave them: they are not stable any more, or have another class.
BrickMask cutChanged(const BrickMask& changed, const GrowingBrick& brick, CuboidCuts& cuts) {
  BrickMask split;
  const BrickMask suspects = changed & brick.fused;
  if (suspects.isEmpty()) return split;
  for (const Cuboid& cuboid : brick.cuboids) {
    const BrickMask part = BrickMask::ofBox(intersect(cuboid.box, brickBox(brick.brick)));
    const BrickMask leaving = (suspects & part).without(brick.stableOf(cuboid.occupancy));
    if (leaving.isEmpty()) continue;
    cuts.add(cuboid, brick.brick, leaving);
    split |= leaving;
  }
  return split;
}

/// Restarts the time of voxels that wait and have changed, and lets split ones wait. @return Whether there is any.
bool holdVoxels(const BrickMask& changed, const BrickMask& split, std::uint64_t cloud,
                GrowingBrick& brick) {
  const BrickMask restarted = brick.held_voxels & changed;
  if (restarted.isEmpty() && split.isEmpty()) return false;
  for (HeldVoxel& held : brick.held) {
    if (restarted.test(held.voxel)) held.last_change = cloud;
  }
  split.without(brick.held_voxels).forEach([&](int voxel) {
    brick.held.push_back({cloud, voxel});
  });
  brick.held_voxels |= split;
  brick.has_other_held_voxels = true;
  return true;
}

/// Adds the boxes of stable voxels that an edit has made known.
void addBoxes(const BrickMask& fresh, const Cell& brick, GrowingBricks& bricks) {
  std::vector<Cuboid> boxes;
  for (const Occupancy occupancy : {Occupancy::kFree, Occupancy::kOccupied}) {
    divideVoxels(brick, fresh & bricks.at(brick).stableOf(occupancy), occupancy, boxes);
  }
  for (const Cuboid& cuboid : boxes) {
    if (cuboid.box.numVoxels() > 1.0) bricks.add(cuboid);
  }
}

/// Moves what differs from the bricks before into a change.
void takeChanges(GrowingBricks& bricks, GrowthChange& change) {
  bricks.forEach([&](GrowingBrick& brick) {
    if (!brick.has_other_cuboids && !brick.has_other_held_voxels) return;
    if (brick.has_other_cuboids) change.with_new_cuboids.push_back(brick.brick);
    change.bricks.push_back(std::move(static_cast<GrownBrick&>(brick)));
  });
}

/// Adaptation of the cell resolution (paper, Section IV-B and Figure 5): a stable cell expands in one search direction
/// after the other. An expansion succeeds if cells inside the added slab fill it (6), and are stable in the same
/// class (7), (8). The fused cuboid replaces these cells.
class Grower {
 public:
  /// @param bricks  Get the fused cuboids. Both must outlive the object.
  Grower(const GrowthRules& rules, GrowingBricks& bricks) : rules_(rules), bricks_(bricks) {}

  /// Grows cells until none of them can: one pass tries each cell once; the next pass tries those beside a fused cuboid
  /// again. @param cells  The paper's set T, in the order of trial. @throws std::bad_alloc
  void grow(std::vector<Cell> cells) {
    while (!cells.empty()) {
      for (const Cell& cell : cells) tryCell(cell);
      cells = startersBesideFused();
      for (const Cell& cell : tried_) bricks_.at(brickOf(cell)).tried = {};
      tried_.clear();
      fused_.clear();
    }
  }

 private:
  /// Fuse(g_i) of Figure 5 for the cuboid that holds a cell, as a loop in place of a recursion.
  void tryCell(const Cell& cell) {
    const GrowingBrick& brick = bricks_.at(brickOf(cell));
    const int voxel = voxelIndex(cell);
    const bool is_stable = brick.stable[0].test(voxel) || brick.stable[1].test(voxel);
    if (!is_stable || brick.held_voxels.test(voxel)) return;
    const bool is_fused = brick.fused.test(voxel);
    const Cuboid start = bricks_.cuboidAt(cell);
    GrowingBrick& first = bricks_.at(brickOf(start.box.min));
    first.starters.set(voxelIndex(start.box.min));
    if (first.tried.test(voxelIndex(start.box.min))) return;
    GrowingCell growth{start.box, start.occupancy, {}};
    while (rules_.expand(bricks_, growth)) {
    }
    const Cell& least = growth.box.min;
    GrowingBrick& last = bricks_.at(brickOf(least));
    last.starters.set(voxelIndex(least));
    last.tried.set(voxelIndex(least));
    tried_.push_back(least);
    if (growth.box == start.box) return;
    if (is_fused) bricks_.remove(start.box);
    for (const CellBox& box : growth.absorbed) bricks_.remove(box);
    bricks_.add({growth.box, growth.occupancy});
    fused_.push_back(growth.box);
  }

  /// Starters that may be able to grow now, because a cell beside them has fused.
  [[nodiscard]] std::vector<Cell> startersBesideFused() {
    std::vector<Cell> cells;
    if (fused_.empty()) return cells;
    if (rules_.reachesFar()) {
      bricks_.forEach([&](const GrowingBrick& brick) {
        forEachCell(brick.brick, brick.starters, [&](const Cell& cell) { cells.push_back(cell); });
      });
      fused_.clear();
    }
    for (const CellBox& box : fused_) {
      const CellBox around = dilate(box);
      forEachBrick(around, [&](const Cell& brick) {
        const GrowingBrick& copy = bricks_.at(brick);
        const BrickMask part = BrickMask::ofBox(intersect(around, brickBox(brick)));
        forEachCell(brick, copy.starters.without(copy.fused) & part,
                    [&](const Cell& cell) { cells.push_back(cell); });
      });
      bricks_.visitFused(around, [&](const Cuboid& cuboid) {
        const Cell& least = cuboid.box.min;
        if (bricks_.at(brickOf(least)).starters.test(voxelIndex(least))) cells.push_back(least);
        return Visit::kContinue;
      });
    }
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    return cells;
  }

  const GrowthRules& rules_;
  GrowingBricks& bricks_;
  /// Cuboids that have fused in this pass, also those absorbed since.
  std::vector<CellBox> fused_;
  std::vector<Cell> tried_;  ///< Cells in the masks `tried` of the bricks.
};

}  // namespace

GrowthFusion::GrowthFusion(const GrowthConfig& config, const SensorModel& model)
    : config_(config),
      rules_(config.rules ? config.rules : std::make_shared<const GrowthRules>()),
      model_(model) {
  waiting_.reserve(static_cast<std::size_t>(config.settle_clouds) + 1);
}

GrowthChange GrowthFusion::prepareCloud(const VoxelStore& voxels,
                                        const VoxelStore::PendingChange& change,
                                        const std::vector<BrickUpdate>& observed,
                                        const std::vector<Cell>& samples) const {
  GrowthChange result;
  result.is_cloud = true;
  GrowingBricks bricks(bricks_, voxels, change, thresholdsOf(model_));
  const std::uint64_t cloud = num_clouds_ + 1;
  CuboidCuts cuts;
  for (const std::uint32_t i : change.changed) {
    const VoxelStore::PendingBrick& pending = change.bricks[i];
    GrowingBrick& brick = bricks.at(pending.brick);
    const BrickMask split = cutChanged(pending.changed, brick, cuts);
    if (config_.settle_clouds > 0 && holdVoxels(pending.changed, split, cloud, brick)) {
      result.with_held_voxels.push_back(pending.brick);
    }
  }
  cuts.apply(bricks);
  std::vector<Cell> cells = release(bricks, cloud);
  const std::vector<Cell> starters = rules_->startersOf(change, observed, samples);
  cells.insert(cells.end(), starters.begin(), starters.end());
  Grower(*rules_, bricks).grow(std::move(cells));
  takeChanges(bricks, result);
  return result;
}

/// Lets voxels fuse again that have kept their value long enough. @return These, if they are stable, and the cuboids
/// around them, which could not grow before; by their least cells.
std::vector<Cell> GrowthFusion::release(GrowingBricks& bricks, std::uint64_t cloud) const {
  std::vector<Cell> cells;
  const auto clouds = static_cast<std::size_t>(config_.settle_clouds);
  if (clouds == 0 || waiting_.size() < clouds) return cells;
  std::vector<Cell> released;
  for (const Cell& least : waiting_.front()) {
    GrowingBrick& brick = bricks.at(least);
    const auto waits = [&](const HeldVoxel& held) { return held.last_change + clouds > cloud; };
    const auto due = std::stable_partition(brick.held.begin(), brick.held.end(), waits);
    if (due == brick.held.end()) continue;
    for (auto held = due; held != brick.held.end(); ++held) {
      const Cell cell = cellAt(least, held->voxel);
      const BrickMask voxel = BrickMask::ofBox(CellBox::ofCell(cell));
      brick.held_voxels &= ~voxel;
      if ((brick.stable[0] | brick.stable[1]).intersects(voxel)) released.push_back(cell);
    }
    brick.held.erase(due, brick.held.end());
    brick.has_other_held_voxels = true;
  }
  for (const Cell& cell : released) {
    const CellBox around = dilate(CellBox::ofCell(cell));
    forEachBrick(around, [&](const Cell& least) {
      const GrowingBrick& brick = bricks.at(least);
      const BrickMask part = BrickMask::ofBox(intersect(around, brickBox(least)));
      forEachCell(least, (brick.voxels->known() & part).without(brick.fused),
                  [&](const Cell& single) { cells.push_back(single); });
    });
    bricks.visitFused(around, [&](const Cuboid& cuboid) {
      cells.push_back(cuboid.box.min);
      return Visit::kContinue;
    });
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}

GrowthChange GrowthFusion::prepareEdit(const VoxelStore& voxels,
                                       const VoxelStore::PendingChange& change) const {
  GrowthChange result;
  GrowingBricks bricks(bricks_, voxels, change, thresholdsOf(model_));
  CuboidCuts cuts;
  for (const std::uint32_t i : change.changed) {
    const VoxelStore::PendingBrick& pending = change.bricks[i];
    (void)cutChanged(pending.changed, bricks.at(pending.brick), cuts);
  }
  cuts.apply(bricks);
  for (const std::uint32_t i : change.changed) {
    const VoxelStore::PendingBrick& pending = change.bricks[i];
    const PackedVoxels* before = voxels.find(pending.brick);
    addBoxes(before == nullptr ? pending.changed : pending.changed.without(before->known()),
             pending.brick, bricks);
  }
  takeChanges(bricks, result);
  return result;
}

GrowthChange GrowthFusion::prepareModel(const VoxelStore& voxels, const SensorModel& model) const {
  GrowthChange result;
  const VoxelStore::PendingChange no_change;
  GrowingBricks bricks(bricks_, voxels, no_change, thresholdsOf(model));
  std::vector<Cell> fused;
  bricks_.forEach([&](const GrownBrick& brick) { fused.push_back(brick.brick); });
  std::sort(fused.begin(), fused.end(), isBeforeOnMortonCurve);
  CuboidCuts cuts;
  for (const Cell& brick : fused) (void)cutChanged(BrickMask::all(), bricks.at(brick), cuts);
  cuts.apply(bricks);
  takeChanges(bricks, result);
  return result;
}

GrowthChange GrowthFusion::prepareCuboids(const VoxelStore& voxels,
                                          const std::vector<Cuboid>& cuboids) const {
  GrowthChange result;
  const VoxelStore::PendingChange no_change;
  GrowingBricks bricks(bricks_, voxels, no_change, thresholdsOf(model_));
  bricks_.forEach([&](const GrownBrick& brick) {
    while (!bricks.at(brick.brick).cuboids.empty()) {
      bricks.remove(CellBox(bricks.at(brick.brick).cuboids.front().box));
    }
  });
  for (const Cuboid& cuboid : cuboids) {
    if (cuboid.box.numVoxels() <= 1.0 || !bricks.isAllFusible(cuboid.box, cuboid.occupancy))
      continue;
    bool is_alone = true;
    bricks.visitFused(cuboid.box, [&is_alone](const Cuboid& /*other*/) {
      is_alone = false;
      return Visit::kStop;
    });
    if (is_alone) bricks.add(cuboid);
  }
  takeChanges(bricks, result);
  return result;
}

/// Clouds take no log-odds beyond the clamping thresholds, which are rounded.
FusionThresholds GrowthFusion::thresholdsOf(const SensorModel& model) const {
  const auto log_odds = [](const std::optional<double>& probability, float otherwise) {
    return probability ? toLogOdds(*probability) : otherwise;
  };
  return {std::max(log_odds(config_.alpha_min, model.min()), model.min()),
          std::min(log_odds(config_.alpha_max, model.max()), model.max())};
}

void GrowthFusion::reserve(const GrowthChange& change) {
  bricks_.reserve(bricks_.size() + change.bricks.size());
}

void GrowthFusion::commit(GrowthChange& change) noexcept {
  for (GrownBrick& after : change.bricks) {
    if (after.isEmpty()) {
      if (GrownBrick* gone = bricks_.find(after.brick)) std::swap(*gone, after);
      bricks_.erase(after.brick);
    } else {
      std::swap(bricks_.findOrAdd(after.brick), after);
    }
  }
  if (!change.is_cloud) return;
  ++num_clouds_;
  if (config_.settle_clouds == 0) return;
  if (waiting_.size() == static_cast<std::size_t>(config_.settle_clouds)) {
    std::rotate(waiting_.begin(), waiting_.begin() + 1, waiting_.end());
    waiting_.back().swap(change.with_held_voxels);
    return;
  }
  waiting_.push_back(std::move(change.with_held_voxels));
}

std::size_t GrowthFusion::numBytes() const {
  std::size_t num_bytes = bricks_.numBytes() + waiting_.capacity() * sizeof(std::vector<Cell>);
  for (const auto& bricks : waiting_) num_bytes += bricks.capacity() * sizeof(Cell);
  bricks_.forEach([&num_bytes](const GrownBrick& brick) {
    num_bytes +=
        brick.cuboids.capacity() * sizeof(Cuboid) + brick.held.capacity() * sizeof(HeldVoxel);
  });
  return num_bytes;
}

}  // namespace cuboid_mapping
