// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/cuboid_map.h"

#include "cuboid_mapping/fusion/make_fusion.h"
#include "cuboid_mapping/voxels/uniform_boxes.h"

#include <cassert>
#include <utility>

namespace cuboid_mapping {

CuboidMap::CuboidMap(const MapConfig& config)
    : config_(checked(config)),
      grid_(config.resolution_m),
      sensor_model_(config.sensor_model, config.environment),
      fusion_(makeFusion({config.fusion, config.growth, config.rtree, config.threads},
                         sensor_model_)) {}

ChangeSet CuboidMap::apply(const ScanUpdate& update, const SensorModel& model) {
  VoxelStore::PendingChange change = prepare(update, model);
  return commit(update, change);
}

VoxelStore::PendingChange CuboidMap::prepare(const ScanUpdate& update, const SensorModel& model) {
  assert(model.min() == sensor_model_.min() && model.max() == sensor_model_.max());
  return voxels_.prepare(locked_.isEmpty() ? update.bricks : locked_.without(update.bricks), model,
                         config_.threads);
}

ChangeSet CuboidMap::commit(const ScanUpdate& update, VoxelStore::PendingChange& change) {
  ChangeSet changes;
  const auto announce = [&](const auto& changed) { fusion_->announce(changed, changes); };
  const std::vector<BrickChange>& changed = voxels_.commit(change, announce);
  fusion_->noteCloud(voxels_, update, changed, changes);
  return finish(!changed.empty(), std::move(changes));
}

bool CuboidMap::fuse(std::size_t max_bricks) {
  fusion_->fuse(voxels_, max_bricks);
  return !fusion_->isAnyWaiting();
}

ChangeSet CuboidMap::replace(const CellBox& box, const std::vector<VoxelBrick>& bricks) {
  ChangeSet changes;
  if (box.isEmpty()) return finish(false, std::move(changes));
  const auto announce = [&](const auto& changed) { fusion_->announce(changed, changes); };
  const std::vector<BrickChange> changed = voxels_.replace(box, bricks, announce);
  fusion_->noteEdit(voxels_, changed, changes);
  return finish(!changed.empty(), std::move(changes));
}

ChangeSet CuboidMap::replace(const CellBox& box, const std::vector<UniformBox>& boxes) {
  return replace(box, toBricks(boxes).bricks);
}

ChangeSet CuboidMap::exchange(CuboidMap& other) {
  std::swap(voxels_, other.voxels_);
  std::swap(fusion_, other.fusion_);
  ChangeSet changes;
  changes.is_everything = true;
  return finish(true, std::move(changes));
}

ChangeSet CuboidMap::setSensorModel(const SensorModelConfig& sensor_model) {
  config_.sensor_model = checked(sensor_model);
  sensor_model_ = SensorModel(sensor_model, config_.environment);
  ChangeSet changes;
  fusion_->setSensorModel(voxels_, sensor_model_, changes);
  const bool is_changed = changes.is_everything || !changes.bricks.empty();
  return finish(is_changed, std::move(changes));
}

ChangeSet CuboidMap::clear() {
  voxels_.clear();
  fusion_->clear();
  locked_.clear();
  ChangeSet changes;
  changes.is_everything = true;
  return finish(true, std::move(changes));
}

ChangeSet CuboidMap::finish(bool is_changed, ChangeSet changes) {
  if (is_changed) ++revision_;
  changes.revision = revision_;
  return changes;
}

}  // namespace cuboid_mapping
