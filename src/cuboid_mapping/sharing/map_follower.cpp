// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/sharing/map_follower.h"

#include "cuboid_mapping/map/config_check.h"
#include "cuboid_mapping/map/map_snapshot.h"

#include <algorithm>
#include <utility>

namespace cuboid_mapping {
namespace {

/// Voxels of a brick in the detail that is sent.
PackedVoxels detailOf(const PackedVoxels& voxels, MapDetail detail) {
  static const SensorModel kModel;
  if (detail == MapDetail::kValues) return voxels;
  return PackedVoxels::ofClasses(voxels.known(), voxels.occupied(), kModel);
}

bool areGood(const std::vector<VoxelBrick>& bricks) {
  return std::all_of(bricks.begin(), bricks.end(),
                     [](const VoxelBrick& brick) { return findFault(brick).empty(); });
}

}  // namespace

MapImage makeImage(const CuboidMap& map, std::uint64_t instance, MapDetail detail) {
  MapImage image{instance, map.revision(), map.grid().resolution(), detail, {}};
  image.bricks.reserve(map.voxels().size());
  map.voxels().forEach([&](const VoxelBrick& brick) {
    image.bricks.push_back({brick.brick, detailOf(brick.voxels, detail)});
  });
  sortBricks(image.bricks);
  return image;
}

MapDelta makeDelta(const CuboidMap& map, const ChangeSet& changes, std::uint64_t instance,
                   std::uint64_t base, MapDetail detail) {
  MapDelta delta{instance, base, map.revision(), changes.is_everything, map.grid().resolution(),
                 detail,   {}};
  if (changes.is_everything) return delta;
  std::vector<Cell> changed;
  changed.reserve(changes.bricks.size());
  for (const ChangedBrick& brick : changes.bricks) {
    if (detail == MapDetail::kValues || brick.has_new_cuboids) changed.push_back(brick.brick);
  }
  if (!std::is_sorted(changed.begin(), changed.end(), isBeforeOnMortonCurve)) {
    std::sort(changed.begin(), changed.end(), isBeforeOnMortonCurve);
  }
  changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
  delta.bricks.reserve(changed.size());
  for (const Cell& brick : changed) {
    const PackedVoxels* voxels = map.voxels().find(brick);
    delta.bricks.push_back({brick, voxels == nullptr ? PackedVoxels() : detailOf(*voxels, detail)});
  }
  return delta;
}

bool MapFollower::take(MapImage image) {
  if (map_ && image.instance == instance_ && image.revision < revision_) return true;
  MapConfig config;
  config.resolution_m = image.resolution_m;
  if (!checkConfig(config).empty() || !areGood(image.bricks)) return false;
  CuboidMap fresh(config);
  fresh.replace(std::move(image.bricks));
  if (map_ && map_->grid().resolution() == image.resolution_m) {  // Nothing throws from here on.
    map_->exchange(fresh);  // Its revision rises, as those who keep something of it rely on.
  } else {
    map_ = std::move(fresh);
  }
  instance_ = image.instance;
  revision_ = image.revision;
  label_ = std::move(image.label);
  return true;
}

FollowResult MapFollower::check(const MapDelta& delta) const {
  if (!map_ || delta.instance != instance_) return FollowResult::kGap;
  if (delta.revision <= revision_) return FollowResult::kOld;
  if (delta.base > revision_ || delta.is_everything) return FollowResult::kGap;
  const bool is_good = delta.resolution_m == map_->grid().resolution() && areGood(delta.bricks);
  return is_good ? FollowResult::kApplied : FollowResult::kDamaged;
}

FollowResult MapFollower::take(MapDelta delta) {
  const FollowResult result = check(delta);
  if (result != FollowResult::kApplied) return result;
  map_->replace(std::move(delta.bricks));
  revision_ = delta.revision;
  label_ = std::move(delta.label);
  return result;
}

MapFollower MapFollower::copy() const {
  MapFollower other;
  if (map_) other.map_ = copyOf(*map_);
  other.instance_ = instance_;
  other.revision_ = revision_;
  other.label_ = label_;
  return other;
}

}  // namespace cuboid_mapping
