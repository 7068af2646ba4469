// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/cuboid_map.h"

#include "cuboid_mapping/fusion/class_fusion.h"
#include "cuboid_mapping/fusion/growth_fusion.h"
#include "cuboid_mapping/map/locked_boxes.h"
#include "cuboid_mapping/voxels/brick_store.h"
#include "cuboid_mapping/voxels/uniform_boxes.h"

#include <cassert>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping {

CuboidMap::CuboidMap(const MapConfig& config)
    : config_(checked(config)),
      grid_(config.resolution_m),
      sensor_model_(config.sensor_model, config.environment),
      locked_(std::make_unique<LockedBoxes>()) {
  if (config.fusion == FusionKind::kGrowth) {
    growth_ = std::make_unique<GrowthFusion>(config.growth, config.rtree, sensor_model_);
  } else {
    by_class_ = std::make_unique<ClassFusion>(config.rtree, config.fusion == FusionKind::kClass);
  }
}

CuboidMap::CuboidMap(CuboidMap&& other) noexcept = default;
CuboidMap& CuboidMap::operator=(CuboidMap&& other) noexcept = default;
CuboidMap::~CuboidMap() = default;

VoxelStore::Work CuboidMap::work() const {
  return {config_.threads,
          config_.fusion == FusionKind::kClass && config_.fuse == FusionTime::kEveryCloud};
}

ChangeSet CuboidMap::apply(const ScanUpdate& update, const SensorModel& model) {
  VoxelStore::PendingChange change = prepare(update, model);
  return commit(update, change);
}

VoxelStore::PendingChange CuboidMap::prepare(const ScanUpdate& update,
                                             const SensorModel& model) const {
  assert(model.min() == sensor_model_.min() && model.max() == sensor_model_.max());
  if (locked_->isEmpty() && isOrdered(update.bricks)) {
    return voxels_.prepare(update.bricks, model, work());
  }
  return voxels_.prepare(locked_->without(ordered(update.bricks)), model, work());
}

ChangeSet CuboidMap::commit(const ScanUpdate& update, VoxelStore::PendingChange& change) {
  return commit(change, &update);
}

/// @param cloud  Null for an edit.
ChangeSet CuboidMap::commit(VoxelStore::PendingChange& change, const ScanUpdate* cloud) {
  ChangeSet changes;
  CellWrites writes;
  voxels_.reserve(change);
  if (growth_) {
    writes = growth_->prepare(change, cloud == nullptr);
    for (const CellBox& box : writes.split) changes.addCuboidsIn(box);
  } else {
    by_class_->reserve(voxels_, change);
  }
  changes.bricks.reserve(changes.bricks.size() + change.changed.size());
  voxels_.commit(change,
                 [&](const VoxelStore::PendingBrick& brick) {  // Nothing throws from here on.
                   changes.bricks.push_back({brick.brick, brick.is_reclassified});
                   if (by_class_) by_class_->follow(brick);
                 });
  if (growth_) {
    growth_->commit(writes);
    if (cloud != nullptr) growth_->grow(voxels_, *cloud, writes, changes);
  } else {
    by_class_->trim();
  }
  return finish(!change.changed.empty(), std::move(changes));
}

ChangeSet CuboidMap::replace(const CellBox& box, std::vector<VoxelBrick> bricks) {
  if (box.isEmpty()) return finish(false, {});
  VoxelStore::PendingChange change =
      voxels_.prepareReplace(box, std::move(bricks), {config_.threads});
  return commit(change, nullptr);
}

ChangeSet CuboidMap::replace(std::vector<VoxelBrick> bricks) {
  VoxelStore::PendingChange change = voxels_.prepareReplace(std::move(bricks), {config_.threads});
  return commit(change, nullptr);
}

ChangeSet CuboidMap::replace(const CellBox& box, const std::vector<UniformBox>& boxes) {
  for (const UniformBox& each : boxes) {
    if (!std::isfinite(each.log_odds)) throw std::invalid_argument("log-odds must be finite");
  }
  return replace(box, toBricks(boxes).bricks);
}

ChangeSet CuboidMap::exchange(CuboidMap& other) {
  std::swap(voxels_, other.voxels_);
  std::swap(by_class_, other.by_class_);
  std::swap(growth_, other.growth_);
  ChangeSet changes;
  changes.is_everything = true;
  return finish(true, std::move(changes));
}

void CuboidMap::lock(const CellBox& box) { locked_->add(box); }

void CuboidMap::unlock(const CellBox& box) { locked_->remove(box); }

void CuboidMap::setLocked(const std::vector<CellBox>& boxes) {
  auto locked = std::make_unique<LockedBoxes>();
  for (const CellBox& box : boxes) locked->add(box);
  locked_ = std::move(locked);
}

std::vector<CellBox> CuboidMap::lockedBoxes() const { return locked_->boxes(); }

ChangeSet CuboidMap::setSensorModel(const SensorModelConfig& sensor_model) {
  const SensorModel model(checked(sensor_model), config_.environment);
  ChangeSet changes;
  if (growth_) {
    const CellWrites writes = growth_->prepare(voxels_, model);
    for (const auto& brick : writes.bricks) changes.bricks.push_back({brick.brick, false});
    for (const CellBox& box : writes.split) changes.addCuboidsIn(box);
    growth_->commit(writes);
    growth_->setSensorModel(model);
  }
  config_.sensor_model = sensor_model;
  sensor_model_ = model;
  const bool is_changed = !changes.bricks.empty();
  return finish(is_changed, std::move(changes));
}

ChangeSet CuboidMap::clear() {
  CuboidMap empty(config_);
  locked_.swap(empty.locked_);
  return exchange(empty);
}

const CuboidTree& CuboidMap::cuboids() const {
  if (growth_) return *growth_;
  return *by_class_;
}

std::optional<CellBox> CuboidMap::bounds() const { return cuboids().inner().bounds(); }

std::size_t CuboidMap::numBytes() const { return voxels_.numBytes() + cuboids().numBytes(); }

ChangeSet CuboidMap::finish(bool is_changed, ChangeSet changes) {
  if (is_changed) ++revision_;
  changes.revision = revision_;
  return changes;
}

}  // namespace cuboid_mapping
