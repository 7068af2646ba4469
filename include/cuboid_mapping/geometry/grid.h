// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/cell_box.h"

#include <Eigen/Core>

#include <optional>

namespace cuboid_mapping {

/// Axis-aligned box in metres, in the frame of the map where nothing else is said.
struct MetricBox {
  Eigen::Vector3d min_m = Eigen::Vector3d::Zero();  ///< Lower x, y and z.
  Eigen::Vector3d max_m = Eigen::Vector3d::Zero();  ///< Upper x, y and z.
};

/// The least corner of a voxel, in voxels.
[[nodiscard]] inline Eigen::Vector3d toVector(const Cell& cell) {
  return {static_cast<double>(cell.x), static_cast<double>(cell.y), static_cast<double>(cell.z)};
}

/// Rounds between metres (map frame) and cells; computeRays() and CloudFaces repeat toCell() in vectors.
///
/// A cell is floor(coordinate * (1 / resolution)), as in octomap::OcTreeBaseImpl::coordToKey.
/// Cells reach from -kMaxCell to kMaxCell - 1: 53,687 km each way at 0.05 m. Thread-safe: const.
class Grid {
 public:
  /// Bound of the cell coordinates, a multiple of 64: 2 * kMaxCell is an int32, so that differences cannot overflow.
  static constexpr std::int32_t kMaxCell = (1 << 30) - 64;

  /// @param resolution_m Edge of a voxel, > 0.
  explicit Grid(double resolution_m);

  /// Edge of a voxel in metres.
  [[nodiscard]] double resolution() const { return resolution_m_; }

  /// Factor from metres to voxels: 1 / resolution().
  [[nodiscard]] double inverseResolution() const { return inverse_resolution_; }

  /// Volume of one voxel in cubic metres.
  [[nodiscard]] double voxelVolume() const { return resolution_m_ * resolution_m_ * resolution_m_; }

  /// The cell that holds a point; nothing when a coordinate is out of range, infinite or NaN.
  [[nodiscard]] std::optional<Cell> toCell(const Eigen::Vector3d& point_map) const {
    const Eigen::Vector3d cells = toCellUnits(point_map);
    for (const double cell : {cells.x(), cells.y(), cells.z()}) {
      if (!(cell >= -kMaxCell && cell < kMaxCell)) return std::nullopt;  // NaN fails it, too
    }
    return Cell{floorToInt(cells.x()), floorToInt(cells.y()), floorToInt(cells.z())};
  }

  /// All cells that a box overlaps; nothing when the box is out of range, has a NaN, or is
  /// flat or inverted (max <= min on some axis).
  ///
  /// A face within 1e-6 voxels of a voxel face counts as lying on it, so that [0.6, 0.8) at 0.2 m
  /// is one voxel whatever the rounding of 0.6 / 0.2.
  [[nodiscard]] std::optional<CellBox> toCellBox(const MetricBox& box_map) const;

  /// Edges in voxels of the smallest box of whole voxels that holds a box of this size; nothing
  /// when an edge is not > 0, not finite, or beyond the grid's range. Tolerance as in toCellBox.
  [[nodiscard]] std::optional<Cell> toSizeInCells(const Eigen::Vector3d& size_m) const;

  /// A point in units of voxels; its floor is the cell. Not checked for the range.
  [[nodiscard]] Eigen::Vector3d toCellUnits(const Eigen::Vector3d& point_map) const {
    return point_map * inverse_resolution_;
  }

  /// Inverse of toCellUnits.
  [[nodiscard]] Eigen::Vector3d toMetres(const Eigen::Vector3d& point_cells) const {
    return point_cells * resolution_m_;
  }

  /// The faces of a cell box in metres, map frame.
  [[nodiscard]] MetricBox toMetricBox(const CellBox& box) const;

  /// The centre of a cell box in metres, map frame.
  [[nodiscard]] Eigen::Vector3d centerOf(const CellBox& box) const;

 private:
  static std::int32_t floorToInt(double value) {
    const auto truncated = static_cast<std::int32_t>(value);
    return truncated - (value < truncated ? 1 : 0);
  }

  double resolution_m_;
  double inverse_resolution_;
};

}  // namespace cuboid_mapping
