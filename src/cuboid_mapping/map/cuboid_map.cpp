// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/cuboid_map.h"

#include "cuboid_mapping/fusion/cuboid_tree.h"
#include "cuboid_mapping/fusion/growth_fusion.h"
#include "cuboid_mapping/map/locked_boxes.h"
#include "cuboid_mapping/voxels/brick_store.h"
#include "cuboid_mapping/voxels/uniform_boxes.h"

#include <cassert>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping {
namespace {

/// Whether cells grow by the same rules, from whichever samples.
bool growsAlike(const GrowthConfig& a, const GrowthConfig& b) {
  return a.settle_clouds == b.settle_clouds && a.alpha_min == b.alpha_min &&
         a.alpha_max == b.alpha_max && a.rules == b.rules;
}

}  // namespace

CuboidMap::CuboidMap(const MapConfig& config)
    : config_(checked(config)),
      grid_(config.resolution_m),
      sensor_model_(config.sensor_model, config.environment),
      locked_(std::make_unique<LockedBoxes>()) {
  if (config.fusion == FusionKind::kGrowth) {
    growth_ = std::make_unique<GrowthFusion>(config.growth, sensor_model_);
  }
  static const GrownBricks kNothingGrown;
  const GrownBricks* others = config.fusion == FusionKind::kNone ? &kNothingGrown : nullptr;
  cuboids_ = std::make_unique<CuboidTree>(config.rtree, growth_ ? &growth_->bricks() : others);
}

CuboidMap::PendingChange::PendingChange() = default;
CuboidMap::PendingChange::PendingChange(PendingChange&& other) noexcept = default;
CuboidMap::PendingChange& CuboidMap::PendingChange::operator=(PendingChange&& other) noexcept =
    default;
CuboidMap::PendingChange::~PendingChange() = default;

CuboidMap::CuboidMap(CuboidMap&& other) noexcept = default;
CuboidMap& CuboidMap::operator=(CuboidMap&& other) noexcept = default;
CuboidMap::~CuboidMap() = default;

VoxelStore::Work CuboidMap::work() const {
  return {config_.threads,
          config_.fusion == FusionKind::kClass && config_.fuse == FusionTime::kEveryCloud};
}

ChangeSet CuboidMap::apply(const ScanUpdate& update, const SensorModel& model) {
  PendingChange change = prepare(update, model);
  return commit(change);
}

CuboidMap::PendingChange CuboidMap::prepare(const ScanUpdate& update,
                                            const SensorModel& model) const {
  assert(model.min() == sensor_model_.min() && model.max() == sensor_model_.max());
  const std::vector<BrickUpdate>* bricks = &update.bricks;
  std::vector<BrickUpdate> admitted;
  if (!isOrdered(*bricks)) {
    admitted = ordered(*bricks);
    bricks = &admitted;
  }
  if (locked_->mayMeet(*bricks)) {
    admitted = locked_->without(*bricks);
    bricks = &admitted;
  }
  PendingChange change;
  change.voxels = voxels_.prepare(*bricks, model, work());
  if (growth_) {
    change.growth = std::make_unique<GrowthChange>(
        growth_->prepareCloud(voxels_, change.voxels, *bricks, update.samples));
  }
  return change;
}

ChangeSet CuboidMap::commit(PendingChange& change) {
  ChangeSet changes;
  voxels_.reserve(change.voxels);
  cuboids_->reserve(voxels_, change.voxels);
  std::size_t num_changes = change.voxels.changed.size();
  if (change.growth) {
    growth_->reserve(*change.growth);
    num_changes += change.growth->with_new_cuboids.size();
  }
  changes.bricks.reserve(num_changes);
  voxels_.commit(change.voxels,
                 [&](const VoxelStore::PendingBrick& brick) {  // Nothing throws from here on.
                   changes.bricks.push_back({brick.brick, brick.is_reclassified});
                   cuboids_->follow(brick);
                 });
  cuboids_->trim();
  if (change.growth) {
    growth_->commit(*change.growth);
    for (const Cell& brick : change.growth->with_new_cuboids) {
      changes.bricks.push_back({brick, true});
    }
  }
  const bool is_changed = !changes.bricks.empty();
  return finish(is_changed, std::move(changes));
}

ChangeSet CuboidMap::replace(const CellBox& box, std::vector<VoxelBrick> bricks) {
  const CellBox within = intersect(box, kAllCells);
  if (within.isEmpty()) return finish(false, {});
  return edit(voxels_.prepareReplace(within, std::move(bricks), {config_.threads}));
}

ChangeSet CuboidMap::replace(std::vector<VoxelBrick> bricks) {
  return edit(voxels_.prepareReplace(std::move(bricks), {config_.threads}));
}

ChangeSet CuboidMap::edit(VoxelStore::PendingChange voxels) {
  PendingChange change;
  change.voxels = std::move(voxels);
  if (growth_) {
    change.growth = std::make_unique<GrowthChange>(growth_->prepareEdit(voxels_, change.voxels));
  }
  return commit(change);
}

ChangeSet CuboidMap::replace(const CellBox& box, const std::vector<UniformBox>& boxes) {
  const CellBox within = intersect(box, kAllCells);
  std::vector<UniformBox> parts;
  parts.reserve(boxes.size());
  for (const UniformBox& each : boxes) {
    if (!std::isfinite(each.log_odds)) throw std::invalid_argument("log-odds must be finite");
    parts.push_back({intersect(each.box, within), each.log_odds});
  }
  return replace(within, toBricks(parts).bricks);
}

ChangeSet CuboidMap::setGrownCuboids(const std::vector<Cuboid>& cuboids) {
  PendingChange change;
  if (growth_) {
    change.growth = std::make_unique<GrowthChange>(growth_->prepareCuboids(voxels_, cuboids));
  }
  return commit(change);
}

ChangeSet CuboidMap::exchange(CuboidMap& other) {
  const MapConfig& a = config_;
  const MapConfig& b = other.config_;
  if (a.resolution_m != b.resolution_m || a.fusion != b.fusion || a.environment != b.environment ||
      a.sensor_model != b.sensor_model || a.rtree.max_branches != b.rtree.max_branches ||
      a.rtree.min_branches != b.rtree.min_branches ||
      (growth_ && !growsAlike(a.growth, b.growth))) {
    throw std::invalid_argument(
        "maps of different configs cannot be exchanged: make both with one");
  }
  std::swap(voxels_, other.voxels_);
  std::swap(growth_, other.growth_);
  std::swap(cuboids_, other.cuboids_);
  ++other.revision_;
  ChangeSet changes;
  changes.is_everything = true;
  return finish(true, std::move(changes));
}

void CuboidMap::lock(const CellBox& box) { locked_->add(intersect(box, kAllCells)); }

void CuboidMap::unlock(const CellBox& box) { locked_->remove(box); }

void CuboidMap::setLocked(const std::vector<CellBox>& boxes) {
  auto locked = std::make_unique<LockedBoxes>();
  for (const CellBox& box : boxes) locked->add(intersect(box, kAllCells));
  locked_ = std::move(locked);
}

std::vector<CellBox> CuboidMap::lockedBoxes() const { return locked_->boxes(); }

ChangeSet CuboidMap::setSensorModel(const SensorModelConfig& sensor_model) {
  const SensorModel model(checked(sensor_model), config_.environment);
  PendingChange change;
  if (growth_) {
    change.growth = std::make_unique<GrowthChange>(growth_->prepareModel(voxels_, model));
  }
  ChangeSet changes = commit(change);
  if (growth_) growth_->setSensorModel(model);
  config_.sensor_model = sensor_model;
  sensor_model_ = model;
  return changes;
}

ChangeSet CuboidMap::clear() {
  CuboidMap empty(config_);
  locked_.swap(empty.locked_);
  return exchange(empty);
}

std::optional<CellBox> CuboidMap::bounds() const { return cuboids().inner().bounds(); }

std::size_t CuboidMap::numBytes() const {
  return voxels_.numBytes() + cuboids().inner().numBytes() + (growth_ ? growth_->numBytes() : 0);
}

ChangeSet CuboidMap::finish(bool is_changed, ChangeSet changes) {
  if (is_changed) ++revision_;
  changes.revision = revision_;
  return changes;
}

}  // namespace cuboid_mapping
