// SPDX-License-Identifier: BSD-3-Clause
// The voxels of a brick one by one: the oracle of PackedVoxels, and random bricks of many kinds.
#pragma once

#include "cuboid_mapping/geometry/brick.h"
#include "cuboid_mapping/scan/brick_update.h"
#include "cuboid_mapping/voxels/packed_voxels.h"
#include "support/random_shapes.h"

#include <array>
#include <optional>
#include <set>
#include <vector>

namespace cuboid_mapping::test {

/// Log-odds by voxelIndex(); nothing for an unknown voxel.
using ModelledBrick = std::array<std::optional<float>, kBrickVoxels>;

/// Paints voxels of a brick.
inline void paint(ModelledBrick& brick, const BrickMask& voxels, std::optional<float> log_odds) {
  voxels.forEach([&](int voxel) { brick[static_cast<std::size_t>(voxel)] = log_odds; });
}

[[nodiscard]] inline BrickMask knownOf(const ModelledBrick& brick) {
  BrickMask known;
  for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
    if (brick[static_cast<std::size_t>(voxel)]) known.set(voxel);
  }
  return known;
}

/// Observes voxels once each, see PackedVoxels::apply().
inline void observe(ModelledBrick& brick, const BrickMask& hits, const BrickMask& misses,
                    const SensorModel& model) {
  (hits | misses).forEach([&](int voxel) {
    auto& log_odds = brick[static_cast<std::size_t>(voxel)];
    log_odds = model.update(log_odds.value_or(0.0F), hits.test(voxel) ? model.hit() : model.miss());
  });
}

[[nodiscard]] inline Occupancy classOf(const std::optional<float>& log_odds) {
  return log_odds ? classify(*log_odds) : Occupancy::kUnknown;
}

/// Packs a brick. Unknown voxels have a value, too: the result must not depend on it.
/// @param of_unknown  That value.
[[nodiscard]] inline PackedVoxels toPacked(const ModelledBrick& brick, float of_unknown = 0.25F) {
  VoxelValues values;
  for (std::size_t voxel = 0; voxel < brick.size(); ++voxel) {
    values[voxel] = brick[voxel].value_or(of_unknown);
  }
  return {knownOf(brick), values};
}

/// A box, a voxel, noise, everything or nothing.
[[nodiscard]] inline BrickMask randomMask(Random& random) {
  const CellBox all = brickBox({0, 0, 0});
  switch (random.integer(0, 5)) {
    case 0: return {};
    case 1: return BrickMask::all();
    case 2: return BrickMask::ofBox(CellBox::ofCell(randomCell(random, all)));
    case 3: {
      BrickMask mask;
      const double ratio = random.real(0.0, 1.0);
      for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
        if (random.chance(ratio)) mask.set(voxel);
      }
      return mask;
    }
    default: return BrickMask::ofBox(randomBoxInside(random, all));
  }
}

/// A brick with one of several patterns: noise, few voxels that differ, boxes painted over each
/// other, or only different log-odds.
[[nodiscard]] inline ModelledBrick randomModelledBrick(Random& random) {
  ModelledBrick brick;
  const int num_values = random.integer(1, 5);
  const auto random_value = [&] {
    return 0.5F * static_cast<float>(random.integer(0, num_values - 1)) - 1.0F;
  };
  switch (random.integer(0, 4)) {
    case 0: {  // Noise.
      const double known_ratio = random.real(0.0, 1.0);
      for (auto& voxel : brick) {
        if (random.chance(known_ratio)) voxel = random_value();
      }
      break;
    }
    case 1:  // All known, few voxels differ.
      for (auto& voxel : brick) voxel = random.chance(0.02) ? random_value() : 0.0F;
      break;
    case 2: {  // As many log-odds as known voxels; both classes, or one.
      const float first =
          random.chance(0.3) ? 0.0F : -0.01F * static_cast<float>(random.integer(0, 512));
      const double known_ratio = random.chance(0.5) ? 1.0 : random.real(0.0, 1.0);
      for (std::size_t voxel = 0; voxel < brick.size(); ++voxel) {
        if (random.chance(known_ratio)) brick[voxel] = first + 0.01F * static_cast<float>(voxel);
      }
      break;
    }
    default: {  // Boxes; the last one painted is on top.
      const int num_boxes = random.integer(1, 12);
      for (int i = 0; i < num_boxes; ++i) {
        paint(brick, BrickMask::ofBox(randomBoxInside(random, brickBox({0, 0, 0}))),
              random_value());
      }
    }
  }
  return brick;
}

/// The least cell of some brick near the origin.
[[nodiscard]] inline Cell randomBrick(Random& random, int reach = 100) {
  const Cell number = randomCell(random, {{-reach, -reach, -reach}, {reach, reach, reach}});
  return {number.x * kBrickEdge, number.y * kBrickEdge, number.z * kBrickEdge};
}

/// Random observations of a cloud in bricks near the origin, along the Morton curve.
[[nodiscard]] inline std::vector<BrickUpdate> randomBrickUpdates(Random& random, int reach,
                                                                 int max_bricks) {
  std::set<Cell> bricks;
  const int num_bricks = random.integer(1, max_bricks);
  for (int i = 0; i < num_bricks; ++i) bricks.insert(randomBrick(random, reach));
  std::vector<BrickUpdate> updates;
  for (const Cell& brick : bricks) {
    const BrickMask hits = random.chance(0.4) ? randomMask(random) : BrickMask();
    updates.push_back({brick, hits, randomMask(random)});
  }
  sortBricks(updates);
  return updates;
}

}  // namespace cuboid_mapping::test
