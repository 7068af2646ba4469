// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/voxel_set.h"

#include <functional>
#include <vector>

namespace cuboid_mapping {

/// Whether a cover may be taken. If it may not, no cover that contains it may.
using CoverTest = std::function<bool(const std::vector<CellBox>& boxes)>;

/// Cost of the voxels that a cover adds: 1 for an unknown voxel, more for a known free one, because robots drive
/// there.
class CoverCost {
 public:
  /// @param map  Must outlive this object.
  explicit CoverCost(const CuboidMap& map) : voxels_(map.voxels()) {}

  /// Cost of the voxels of a box that are not covered yet.
  [[nodiscard]] double ofBox(const CellBox& box, const VoxelSet& covered) const {
    double num_free = 0.0;
    forEachBrick(box, [&](const Cell& brick) {
      const PackedVoxels* voxels = voxels_.find(brick);
      if (voxels == nullptr || voxels->free().isEmpty()) return;
      const BrickMask part = BrickMask::ofBox(intersect(box, brickBox(brick)));
      num_free += (voxels->free() & part).without(covered.inBrick(brick)).count();
    });
    return box.numVoxels() - covered.count(box) + kMoreForFree * num_free;
  }

  /// Cost of all covered voxels that are not occupied.
  [[nodiscard]] double ofCover(const VoxelSet& covered, double num_occupied) const {
    double num_free = 0.0;
    covered.forEachBrick([&](const Cell& brick, const BrickMask& mask) {
      const PackedVoxels* voxels = voxels_.find(brick);
      if (voxels != nullptr) num_free += (voxels->free() & mask).count();
    });
    return covered.size() - num_occupied + kMoreForFree * num_free;
  }

 private:
  static constexpr double kMoreForFree = 1.0;

  const VoxelStore& voxels_;
};

}  // namespace cuboid_mapping
