// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     DistanceField field(map, {{0, 0, 0}, {40, 20, 10}}, 2.0, UnknownPolicy::kFree);
//     std::cout << field.distanceAt({1.05, 0.5, 0.5}).value() << " m to the nearest obstacle\n";
//     const CellBox pillar{{5, 5, 0}, {6, 6, 10}};
//     field.update(map, map.replace(pillar, {{pillar, 1.0F}}));
//     std::cout << field.distanceAt({1.05, 0.5, 0.5}).value() << " m after a change\n";
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/unknown_policy.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

namespace cuboid_mapping {

class Obstacles;

/// Exact distances of the voxels of a region to the nearest obstacle, up to a bound, from centre to centre as
/// in dynamicEDT3D. Obstacles outside the region count, too. One pass along each axis (T. Saito, J. Toriwaki,
/// 1994).
///
/// Takes 5 bytes a voxel of the region, and 1 to 3 a voxel of its surroundings along y and z up to the bound.
/// Const functions may run side by side; a change needs exclusive access.
class DistanceField {
 public:
  static constexpr double kMaxVoxels = 1e9;   ///< Limit of the region and its surroundings.
  static constexpr double kMaxBound = 127.0;  ///< Limit of the bound in voxels.

  /// @param region  In kAllCells, not empty; with its surroundings up to the bound at most kMaxVoxels.
  /// @param bound_m  > 0, at most kMaxBound voxels: farther obstacles are ignored.
  /// @param policy  kObstacle: unknown voxels are obstacles, too.
  /// @throws std::invalid_argument  with the value to change.
  DistanceField(const CuboidMap& map, const CellBox& region, double bound_m, UnknownPolicy policy);

  /// Follows a change of the map; no change may be missed. @throws std::bad_alloc  The field is as before.
  /// @complexity O(r + b v) for r rows of the region and
  /// its surroundings, a bound of b voxels, and v voxels with a changed obstacle within the bound in y and z.
  void update(const CuboidMap& map, const ChangeSet& changes);

  /// The region.
  [[nodiscard]] const CellBox& region() const { return region_; }

  /// Metres from the centre of the voxel that holds a point to that of the nearest obstacle, 0 in an obstacle;
  /// infinity where none is within the bound. Nothing outside the region, and for NaN. @complexity O(1).
  [[nodiscard]] std::optional<double> distanceAt(const Eigen::Vector3d& point_map) const;

  /// The obstacle nearest to a voxel, which may be the voxel itself; any one of several. Nothing if none is
  /// within the bound, and outside the region. @complexity O(b) for a bound of b voxels.
  [[nodiscard]] std::optional<Cell> findNearest(const Cell& cell) const;

  /// Unit vector from the nearest obstacle to the voxel that holds a point, along which the distance grows the
  /// fastest; zero in an obstacle and where none is within the bound. Nothing outside the region, and for NaN.
  /// @complexity As findNearest().
  [[nodiscard]] std::optional<Eigen::Vector3d> gradientAt(const Eigen::Vector3d& point_map) const;

  /// Bytes held from the allocator.
  [[nodiscard]] std::size_t numBytes() const;

 private:
  /// Values of a box, row by row along x. A row has some places beyond the box if that is narrower than min_width.
  template <typename T>
  struct Rows {
    CellBox box;
    std::int32_t width;
    std::vector<T> values;

    Rows(const CellBox& of, T value, std::int32_t min_width = 1)
        : box(of),
          width(std::max(of.size().x, min_width)),
          values(static_cast<std::size_t>(width) * static_cast<std::size_t>(of.size().y) *
                     static_cast<std::size_t>(of.size().z),
                 value) {}
    [[nodiscard]] T* row(std::int32_t y, std::int32_t z) { return &values[indexOf(y, z)]; }
    [[nodiscard]] const T* row(std::int32_t y, std::int32_t z) const {
      return &values[indexOf(y, z)];
    }
    [[nodiscard]] T at(const Cell& cell) const { return row(cell.y, cell.z)[cell.x - box.min.x]; }

   private:
    [[nodiscard]] std::size_t indexOf(std::int32_t y, std::int32_t z) const {
      const Cell size = box.size();
      return (static_cast<std::size_t>(z - box.min.z) * static_cast<std::size_t>(size.y) +
              static_cast<std::size_t>(y - box.min.y)) *
             static_cast<std::size_t>(width);
    }
  };

  /// Places of a row, from the least corner on.
  struct Part {
    std::int32_t begin = 0;
    std::int32_t end = 0;

    [[nodiscard]] bool isEmpty() const { return begin >= end; }
  };
  struct Scratch;
  void computeRows(const Obstacles& obstacles, std::int32_t brick_y, std::int32_t brick_z,
                   Scratch& scratch);
  void computeLayers(Scratch& scratch);
  void computeSquares(Scratch& scratch);

  Grid grid_;
  CellBox region_;
  CellBox around_;      ///< The region and its surroundings up to the bound.
  std::int32_t bound_;  ///< Voxels, rounded down.
  std::int16_t max_square_;
  UnknownPolicy policy_;
  /// Offset along x to the nearest obstacle in the row, of all rows around.
  Rows<std::int8_t> offsets_;
  /// Squared distance to the nearest obstacle in the layer, of all layers around.
  Rows<std::int16_t> layers_;
  Rows<std::int16_t> squares_;  ///< Squared distance to the nearest obstacle.
  Rows<Part> row_changes_;      ///< Last changed part of each row of offsets_.
  Rows<Part> layer_changes_;    ///< Last changed part of each row of layers_.
};

}  // namespace cuboid_mapping
