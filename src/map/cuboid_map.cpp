// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/cuboid_map.h"

#include "cuboid_mapping/map/replace_region.h"
#include "cuboid_mapping/parallel/parallel_for.h"
#include "cuboid_mapping/rtree/traversal.h"

#include <algorithm>
#include <cassert>

namespace cuboid_mapping {
namespace {

/// A brick that so many clouds have not touched is cold.
constexpr std::uint64_t kColdClouds = 20;
/// At least so many bricks of an update are applied at once, whatever the bound of the hot bricks.
constexpr std::ptrdiff_t kMinChunkBricks = 1024;
/// So many groups are written back at once: bounds the memory for their cuboids.
constexpr std::size_t kWriteGroups = 64;
/// So many cold groups are written back after a cloud; the others have to wait for the next one.
constexpr std::size_t kMaxColdGroups = 32;

}  // namespace

/// The part of an update that falls into one group.
struct CuboidMap::GroupUpdate {
  HotGroup* group;
  BrickIterator first;
  BrickIterator last;
  std::vector<DenseBrick*> fresh;  ///< To be decoded from the R-tree.
};

CuboidMap::CuboidMap(const MapConfig& config)
    : config_(config),
      grid_(config.resolution_m),
      sensor_model_(config.sensor_model, config.environment),
      fusion_(makeFusion(config.fusion)),
      tree_(config.rtree) {
  if (config.fusion == kGrowthFusion) growth_.emplace(config.growth, sensor_model_);
  assert(fusion_ != nullptr || growth_);
}

void CuboidMap::setSensorModel(const SensorModelConfig& sensor_model) {
  config_.sensor_model = sensor_model;
  sensor_model_ = SensorModel(sensor_model, config_.environment);
}

ChangeSet CuboidMap::clear() {
  tree_.clear();
  classes_.clear();
  hot_.clear();
  locked_.clear();
  if (growth_) growth_->clear();
  content_ = {};
  ChangeSet changes;
  changes.revision = ++revision_;
  changes.is_everything = true;
  return changes;
}

ChangeSet CuboidMap::replace(const CellBox& box, const std::vector<Cuboid>& cuboids) {
  ChangeSet changes = flush(box);
  hot_.remove(box);
  if (replaceRegion(box, cuboids, {tree_, content_, classes_}, changes)) ++revision_;
  if (growth_) growth_->noteEdits(changes.boxes, tree_);
  changes.revision = revision_;
  return changes;
}

ChangeSet CuboidMap::apply(const ScanUpdate& update) {
  ChangeSet changes;
  ++num_clouds_;
  bool is_changed = false;
  for (auto first = update.bricks.begin(); first != update.bricks.end();) {
    const auto last = findChunkEnd(first, update.bricks.end());
    is_changed |= applyChunk(first, last, changes);
    first = last;
  }
  if (growth_) {
    flush(kAllCells, hot_.groups().size(), changes);
    grow(update, changes);
  }
  evictCold(changes);
  if (is_changed) ++revision_;
  changes.revision = revision_;
  return changes;
}

/// Whole groups that fit into the bound of the hot bricks together, or one.
CuboidMap::BrickIterator CuboidMap::findChunkEnd(BrickIterator first, BrickIterator last) const {
  const auto most = std::max<std::ptrdiff_t>(
      kMinChunkBricks, static_cast<std::ptrdiff_t>(config_.hot_bytes / sizeof(DenseBrick)));
  if (last - first <= most) return last;
  auto end = first + most;
  while (end != first && end->morton >> 6 == (end - 1)->morton >> 6) --end;
  return end;
}

bool CuboidMap::applyChunk(BrickIterator first, BrickIterator last, ChangeSet& changes) {
  std::vector<GroupUpdate> groups;
  for (auto brick = first; brick != last; ++brick) {
    if (brick == first || brick->morton >> 6 != (brick - 1)->morton >> 6) {
      groups.push_back({&hot_.touch(groupOf(brick->brick), num_clouds_), brick, brick, {}});
    }
    GroupUpdate& update = groups.back();
    update.last = brick + 1;
    if (update.group->bricks[indexInGroup(brick->brick)] == nullptr) {
      update.fresh.push_back(&hot_.add(*update.group, brick->brick));
    }
  }
  evict(groups.size(), changes);

  std::vector<std::uint64_t> changed(groups.size(), 0);
  parallelFor(groups.size(), config_.threads, [&](std::size_t i) {
    load(groups[i]);
    for (auto update = groups[i].first; update != groups[i].last; ++update) {
      const std::size_t index = indexInGroup(update->brick);
      DenseBrick& brick = *groups[i].group->bricks[index];
      const bool is_changed = locked_.boxes().empty()
                                  ? brick.apply(*update, sensor_model_)
                                  : brick.apply(locked_.without(*update), sensor_model_);
      changed[i] |= std::uint64_t{is_changed} << index;
    }
    groups[i].group->is_dirty |= changed[i];
  });
  if (config_.hot_bytes == 0) evict(0, changes);
  return std::any_of(changed.begin(), changed.end(),
                     [](std::uint64_t bricks) { return bricks != 0; });
}

void CuboidMap::load(const GroupUpdate& update) const {
  if (update.fresh.empty()) return;
  CellBox window = brickBox(update.fresh.front()->brick);
  std::array<DenseBrick*, kGroupBricks> fresh{};
  for (DenseBrick* brick : update.fresh) {
    window = unite(window, brickBox(brick->brick));
    fresh[indexInGroup(brick->brick)] = brick;
  }
  visitBox(tree_, window, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
    if (brickBox(brickOf(cuboid.box.min)).contains(cuboid.box)) {
      DenseBrick* brick = fresh[indexInGroup(cuboid.box.min)];
      if (brick != nullptr) brick->fill(cuboid);
    } else {
      for (DenseBrick* brick : update.fresh) brick->fill(cuboid);
    }
    return Visit::kContinue;
  });
}

/// Drops the groups that were touched longest ago, until the others fit into the bound.
/// @param num_kept  So many of the groups touched last stay in any case.
void CuboidMap::evict(std::size_t num_kept, ChangeSet& changes) {
  while (hot_.groups().size() > num_kept && hot_.numBytes() > config_.hot_bytes) {
    evictLast(std::min(kWriteGroups, hot_.groups().size() - num_kept), changes);
  }
}

void CuboidMap::evictCold(ChangeSet& changes) {
  std::size_t num_cold = 0;
  for (auto group = hot_.groups().rbegin(); group != hot_.groups().rend(); ++group) {
    if (num_cold == kMaxColdGroups || group->last_cloud + kColdClouds >= num_clouds_) break;
    ++num_cold;
  }
  evictLast(num_cold, changes);
}

/// Writes back the groups that were touched longest ago, and drops them.
void CuboidMap::evictLast(std::size_t num_groups, ChangeSet& changes) {
  std::vector<DirtyBricks> evicted;
  auto group = hot_.groups().rbegin();
  for (std::size_t i = 0; i < num_groups; ++i, ++group) {
    evicted.push_back({&*group, group->is_dirty});
  }
  writeBack(evicted, changes);
  for (const DirtyBricks& last : evicted) hot_.remove(Cell(last.group->group));
}

ChangeSet CuboidMap::cool() {
  ChangeSet changes = flush();
  hot_.clear();
  return changes;
}

ChangeSet CuboidMap::flush() { return flush(kAllCells); }

ChangeSet CuboidMap::flush(const CellBox& region, std::size_t max_groups) {
  ChangeSet changes;
  flush(region, max_groups, changes);
  changes.revision = revision_;
  return changes;
}

void CuboidMap::flush(const CellBox& region, std::size_t max_groups, ChangeSet& changes) {
  std::vector<DirtyBricks> dirty;
  for (HotGroup& group : hot_.groups()) {
    if (max_groups == 0) break;
    const std::uint64_t bricks = dirtyBricks(group, region);
    if (bricks == 0) continue;
    --max_groups;
    dirty.push_back({&group, bricks});
    if (dirty.size() == kWriteGroups) {
      writeBack(dirty, changes);
      dirty.clear();
    }
  }
  writeBack(dirty, changes);
}

bool CuboidMap::isFlushed(const CellBox& region) const {
  return std::none_of(hot_.groups().begin(), hot_.groups().end(),
                      [&region](const HotGroup& group) { return dirtyBricks(group, region) != 0; });
}

/// Bricks of a group that have to be written back before a region is looked at.
std::uint64_t CuboidMap::dirtyBricks(const HotGroup& group, const CellBox& region) {
  const CellBox box{group.group, group.group + Cell{kGroupEdge, kGroupEdge, kGroupEdge}};
  if (group.is_dirty == 0 || intersect(box, region).isEmpty()) return 0;
  if (region.contains(box)) return group.is_dirty;
  std::uint64_t bricks = 0;
  for (std::uint64_t dirty = group.is_dirty; dirty != 0; dirty &= dirty - 1) {
    const auto index = static_cast<std::size_t>(__builtin_ctzll(dirty));
    const bool is_inside = !intersect(brickBox(group.bricks[index]->brick), region).isEmpty();
    bricks |= std::uint64_t{is_inside} << index;
  }
  return bricks;
}

void CuboidMap::writeBack(const std::vector<DirtyBricks>& dirty, ChangeSet& changes) {
  std::vector<const DenseBrick*> bricks;
  for (const DirtyBricks& part : dirty) {
    for (std::uint64_t left = part.bricks; left != 0; left &= left - 1) {
      bricks.push_back(part.group->bricks[static_cast<std::size_t>(__builtin_ctzll(left))].get());
    }
    part.group->is_dirty &= ~part.bricks;
  }
  if (growth_) {
    writeCells(bricks, changes);
  } else {
    writePartitions(bricks, changes);
  }
}

/// Divides bricks into cuboids, and writes these to the R-tree.
/// @param bricks  Those of a group follow each other.
void CuboidMap::writePartitions(const std::vector<const DenseBrick*>& bricks, ChangeSet& changes) {
  TreeWriter::Partitions partitions(bricks.size());
  parallelFor(bricks.size(), config_.threads, [&](std::size_t i) {
    partitions[i].brick = bricks[i]->brick;
    fusion_->partition(*bricks[i], partitions[i].cuboids);
  });
  for (auto first = partitions.cbegin(); first != partitions.cend();) {
    const Cell group = groupOf(first->brick);
    const auto last = std::find_if(
        first, partitions.cend(),
        [&group](const BrickPartition& partition) { return groupOf(partition.brick) != group; });
    writer_.write(first, last, tree_, changes, content_, classes_);
    first = last;
  }
}

/// Writes the voxels of bricks that have changed to the R-tree, each as a cuboid, for growth_.
/// @param bricks  Those of a group follow each other.
void CuboidMap::writeCells(const std::vector<const DenseBrick*>& bricks, ChangeSet& changes) {
  for (auto first = bricks.cbegin(); first != bricks.cend();) {
    const Cell group = groupOf((*first)->brick);
    const auto last = std::find_if(first, bricks.cend(), [&group](const DenseBrick* brick) {
      return groupOf(brick->brick) != group;
    });
    const std::vector<const DenseBrick*> of_group(first, last);
    for (const BrickChange& change : writer_.update(of_group, tree_, changes, content_, classes_)) {
      const auto brick = std::find_if(first, last, [&change](const DenseBrick* candidate) {
        return candidate->brick == change.brick;
      });
      growth_->note(**brick, change, num_clouds_);
    }
    first = last;
  }
}

void CuboidMap::grow(const ScanUpdate& update, ChangeSet& changes) {
  std::vector<Cell> observed;  // The paper's set T.
  for (const BrickUpdate& brick : update.bricks) {
    forEachCell(brick.brick, brick.hits, [&](const Cell& cell) { observed.push_back(cell); });
  }
  observed.insert(observed.end(), update.samples.begin(), update.samples.end());
  for (const Fused& fused : growth_->fuse(observed, num_clouds_, tree_)) {
    (fused.cuboid.occupancy() == Occupancy::kOccupied ? content_.occupied_cuboids
                                                      : content_.free_cuboids) -=
        fused.num_absorbed - 1;
    changes.boxes.push_back(fused.cuboid.box);
  }
}

}  // namespace cuboid_mapping
