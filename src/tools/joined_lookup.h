// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/boxes/joined_cuboids.h"
#include "cuboid_mapping/geometry/brick.h"

#include <cstddef>
#include <optional>
#include <unordered_map>
#include <vector>

namespace cuboid_mapping {

/// The joined occupied cuboids of a map, by voxel. Const functions may run side by side.
class JoinedLookup {
 public:
  explicit JoinedLookup(const CuboidMap& map)
      : cuboids_(joinCuboids(map, kAllCells, CuboidFilter::kOccupied, Budget::unlimited()).value) {
    for (std::size_t i = 0; i < cuboids_.size(); ++i) {
      forEachBrick(cuboids_[i].box, [&](const Cell& brick) { of_brick_[brick].push_back(i); });
    }
  }

  /// The joined cuboid that holds a voxel; nothing if the voxel is not occupied.
  [[nodiscard]] std::optional<Cuboid> find(const Cell& voxel) const {
    const auto found = of_brick_.find(brickOf(voxel));
    if (found == of_brick_.end()) return std::nullopt;
    for (const std::size_t i : found->second) {
      if (cuboids_[i].box.contains(voxel)) return cuboids_[i];
    }
    return std::nullopt;
  }

  /// All joined cuboids.
  [[nodiscard]] const std::vector<Cuboid>& cuboids() const { return cuboids_; }

 private:
  std::vector<Cuboid> cuboids_;
  std::unordered_map<Cell, std::vector<std::size_t>, CellHash> of_brick_;
};

}  // namespace cuboid_mapping
