// SPDX-License-Identifier: BSD-3-Clause
// Blocked voxels of an area, counted box by box: the oracle of planners' questions.
#pragma once

#include "cuboid_mapping/query/unknown_policy.h"
#include "support/modelled_map.h"

#include <vector>

namespace cuboid_mapping::test {

/// A summed volume table of an area; everything outside is unknown.
class DenseObstacles {
 public:
  DenseObstacles(const VoxelMap& voxels, const CellBox& area, UnknownPolicy policy)
      : DenseObstacles([&voxels](const Cell& cell) { return voxels.occupancyAt(cell); }, area,
                       policy) {}

  /// @param class_of  (const Cell&) -> Occupancy.
  template <typename ClassT>
  DenseObstacles(ClassT class_of, const CellBox& area, UnknownPolicy policy)
      : area_(area), blocks_unknown_(policy == UnknownPolicy::kObstacle) {
    const Cell size = area.size() + Cell{1, 1, 1};
    sums_.resize(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) *
                 static_cast<std::size_t>(size.z));
    visitCells(area, [&](const Cell& cell) {
      const Occupancy occupancy = class_of(cell);
      const bool is_blocked = occupancy == Occupancy::kOccupied ||
                              (occupancy == Occupancy::kUnknown && blocks_unknown_);
      const Cell at = cell + Cell{1, 1, 1};
      sum(at) = (is_blocked ? 1 : 0) + sum({at.x - 1, at.y, at.z}) + sum({at.x, at.y - 1, at.z}) +
                sum({at.x, at.y, at.z - 1}) - sum({at.x - 1, at.y - 1, at.z}) -
                sum({at.x - 1, at.y, at.z - 1}) - sum({at.x, at.y - 1, at.z - 1}) +
                sum({at.x - 1, at.y - 1, at.z - 1});
    });
  }

  /// Whether a box has a blocked voxel.
  [[nodiscard]] bool isAny(const CellBox& box) {
    const CellBox in = intersect(box, area_);
    if (blocks_unknown_ && in != box) return true;
    if (in.isEmpty()) return false;
    const Cell& a = in.min;
    const Cell& b = in.max;
    return sum(b) - sum({a.x, b.y, b.z}) - sum({b.x, a.y, b.z}) - sum({b.x, b.y, a.z}) +
               sum({a.x, a.y, b.z}) + sum({a.x, b.y, a.z}) + sum({b.x, a.y, a.z}) - sum(a) >
           0;
  }

 private:
  int& sum(const Cell& upper) {
    const Cell at = upper - area_.min;
    const Cell size = area_.size() + Cell{1, 1, 1};
    return sums_[(static_cast<std::size_t>(at.z) * static_cast<std::size_t>(size.y) +
                  static_cast<std::size_t>(at.y)) *
                     static_cast<std::size_t>(size.x) +
                 static_cast<std::size_t>(at.x)];
  }

  CellBox area_;
  bool blocks_unknown_;
  std::vector<int> sums_;
};

/// A map with space: mostly free, with unknown patches and obstacles.
inline ModelledMap randomRooms(Random& random, const MapConfig& config, const CellBox& area) {
  ModelledMap result(config);
  const auto fill = [&](const CellBox& box, const std::optional<float>& log_odds) {
    std::vector<UniformBox> boxes;
    if (log_odds) boxes.push_back({box, *log_odds});
    result.map.replace(box, boxes);
    visitCells(box, [&](const Cell& cell) { result.voxels.set(cell, log_odds); });
  };
  fill(area, -1.0F);
  for (int i = 0; i < 40; ++i) {
    const CellBox box = intersect(randomBox(random, area, random.chance(0.3) ? 12 : 3), area);
    fill(box, random.chance(0.25) ? std::nullopt : std::optional<float>(1.0F));
  }
  for (int i = 0; i < 12; ++i) {
    fill(intersect(randomBox(random, area, 12), area), -2.0F);
  }
  return result;
}

}  // namespace cuboid_mapping::test
