// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/sharing/map_follower.h"

#include "cuboid_mapping/fusion/brick_division.h"
#include "cuboid_mapping/map/config_check.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

namespace cuboid_mapping {
namespace {

void append(const VoxelBrick& brick, BrickArrays& arrays) {
  std::vector<Cuboid> cuboids;
  divideBrick(brick, cuboids);
  arrays.bricks.insert(arrays.bricks.end(), {brick.brick.x, brick.brick.y, brick.brick.z});
  arrays.counts.push_back(static_cast<std::uint16_t>(cuboids.size()));
  VoxelValues values;
  if (arrays.has_values) brick.voxels.getValues(values);
  for (const Cuboid& cuboid : cuboids) {
    for (const Cell& corner : {cuboid.box.min - brick.brick, cuboid.box.max - brick.brick}) {
      for (int axis = 0; axis < 3; ++axis) {
        arrays.bounds.push_back(static_cast<std::uint8_t>(corner[axis]));
      }
    }
    arrays.occupied.push_back(cuboid.isOccupied() ? 1 : 0);
    if (!arrays.has_values) continue;
    BrickMask::ofBox(cuboid.box).forEach([&](int voxel) {
      arrays.values.push_back(values[static_cast<std::size_t>(voxel)]);
    });
  }
}

/// Reads the bricks of arrays one after the other.
class BrickReader {
 public:
  explicit BrickReader(const BrickArrays& arrays) : arrays_(arrays) {}

  /// Nothing when the arrays do not fit together.
  std::optional<std::vector<VoxelBrick>> read() {
    const std::size_t num_cuboids = arrays_.occupied.size();
    if (arrays_.bricks.size() != 3 * arrays_.counts.size() ||
        arrays_.bounds.size() != 6 * num_cuboids) {
      return std::nullopt;
    }
    std::vector<VoxelBrick> bricks(arrays_.counts.size());
    for (std::size_t i = 0; i < bricks.size(); ++i) {
      if (arrays_.counts[i] > num_cuboids - cuboid_ || !readBrick(i, bricks[i])) {
        return std::nullopt;
      }
    }
    const bool is_at_end =
        cuboid_ == num_cuboids && (!arrays_.has_values || value_ == arrays_.values.size());
    if (!is_at_end) return std::nullopt;
    return bricks;
  }

 private:
  bool readBrick(std::size_t index, VoxelBrick& brick) {
    const std::int32_t* at = &arrays_.bricks[3 * index];
    brick.brick = {at[0], at[1], at[2]};
    if (brick.brick != brickOf(brick.brick) || !kAllCells.contains(brick.brick)) return false;
    BrickMask known;
    for (const std::size_t end = cuboid_ + arrays_.counts[index]; cuboid_ < end; ++cuboid_) {
      const std::uint8_t* b = &arrays_.bounds[6 * cuboid_];
      const CellBox box{{b[0], b[1], b[2]}, {b[3], b[4], b[5]}};
      constexpr CellBox kBrick{{0, 0, 0}, {kBrickEdge, kBrickEdge, kBrickEdge}};
      if (box.isEmpty() || !kBrick.contains(box)) return false;
      const BrickMask voxels = BrickMask::ofBox(box);
      if (known.intersects(voxels) || !readValues(voxels)) return false;
      known |= voxels;
    }
    brick.voxels = PackedVoxels(known, values_);
    return true;
  }

  /// Of the voxels of the current cuboid.
  bool readValues(const BrickMask& voxels) {
    static const SensorModel kModel;
    const bool is_occupied = arrays_.occupied[cuboid_] != 0;
    const auto count = static_cast<std::size_t>(voxels.count());
    if (arrays_.has_values && count > arrays_.values.size() - value_) return false;
    bool is_good = true;
    voxels.forEach([&](int voxel) {
      float log_odds = is_occupied ? kModel.max() : kModel.min();
      if (arrays_.has_values) {
        log_odds = arrays_.values[value_++];
        const bool is_of_class = (classify(log_odds) == Occupancy::kOccupied) == is_occupied;
        is_good = is_good && std::isfinite(log_odds) && is_of_class;
      }
      values_[static_cast<std::size_t>(voxel)] = log_odds;
    });
    return is_good;
  }

  const BrickArrays& arrays_;
  std::size_t cuboid_ = 0;
  std::size_t value_ = 0;
  VoxelValues values_;  ///< Of the current brick.
};

}  // namespace

MapImage makeImage(const CuboidMap& map, std::uint64_t instance, MapDetail detail) {
  MapImage image{instance, map.revision(), map.grid().resolution(), {}};
  image.content.has_values = detail == MapDetail::kValues;
  std::vector<const VoxelBrick*> bricks;
  bricks.reserve(map.voxels().size());
  map.voxels().forEach([&](const VoxelBrick& brick) { bricks.push_back(&brick); });
  std::sort(bricks.begin(), bricks.end(), [](const VoxelBrick* a, const VoxelBrick* b) {
    return isBeforeOnMortonCurve(a->brick, b->brick);
  });
  for (const VoxelBrick* brick : bricks) append(*brick, image.content);
  return image;
}

MapDelta makeDelta(const CuboidMap& map, const ChangeSet& changes, std::uint64_t instance,
                   std::uint64_t base, MapDetail detail) {
  MapDelta delta;
  delta.instance = instance;
  delta.base = base;
  delta.revision = map.revision();
  delta.is_everything = changes.is_everything;
  delta.resolution_m = map.grid().resolution();
  delta.content.has_values = detail == MapDetail::kValues;
  if (changes.is_everything) return delta;
  std::unordered_set<Cell, CellHash> done;
  for (const ChangedBrick& changed : changes.bricks) {
    if (detail == MapDetail::kClasses && !changed.has_new_cuboids) continue;
    if (!done.insert(changed.brick).second) continue;
    const VoxelBrick* brick = map.voxels().findBrick(changed.brick);
    const VoxelBrick unknown{changed.brick, {}};
    append(brick == nullptr ? unknown : *brick, delta.content);
  }
  return delta;
}

bool MapFollower::take(const MapImage& image) {
  if (map_ && image.instance == instance_ && image.revision < revision_) return true;
  const auto bricks = BrickReader(image.content).read();
  MapConfig config;
  config.resolution_m = image.resolution_m;
  if (!bricks || !checkConfig(config).empty()) return false;
  CuboidMap fresh(config);
  fresh.replace(kAllCells, *bricks);
  map_ = std::move(fresh);  // From here on nothing throws.
  instance_ = image.instance;
  revision_ = image.revision;
  return true;
}

FollowResult MapFollower::take(const MapDelta& delta) {
  if (!map_ || delta.instance != instance_) return FollowResult::kGap;
  if (delta.revision <= revision_) return FollowResult::kOld;
  if (delta.base > revision_ || delta.is_everything) return FollowResult::kGap;
  const auto bricks = BrickReader(delta.content).read();
  if (!bricks || delta.resolution_m != map_->grid().resolution()) return FollowResult::kDamaged;
  for (const VoxelBrick& brick : *bricks) map_->replace(brickBox(brick.brick), {brick});
  revision_ = delta.revision;
  return FollowResult::kApplied;
}

}  // namespace cuboid_mapping
