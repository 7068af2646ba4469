// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/ros/middleware/grid_publisher.h"
#include "cuboid_mapping/ros/octomap_server/octomap_products.h"

#include <nav_msgs/OccupancyGrid.h>
#include <std_msgs/Header.h>

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <unordered_set>

namespace cuboid_mapping_ros {

/// Part of the map that a grid leaves out.
struct FarTiles {
  std::size_t count = 0;  ///< Tiles of 8 x 8 cells.
  Eigen::Vector2d farthest_m = Eigen::Vector2d::Zero();
};

/// projected_map of octomap_server: the map seen from above, updated by the changes of the map.
///
/// A cell is 100 when any voxel above it is occupied, else 0 when any is free, else -1; voxels whose
/// height is outside of [occupancy_min_z, occupancy_max_z] do not count, nor do speckles with
/// filter_speckles. Not thread-safe.
class ProjectedMap {
 public:
  explicit ProjectedMap(const OctomapServerParameters& parameters) : parameters_(parameters) {}

  /// Notes a change; call it for every change of the R-tree.
  void noteChanges(const ChangeSet& changes);

  /// Reads the columns that have changed. @complexity O(voxels in them).
  void update(const CuboidMap& map);

  /// The grid, from the least to the greatest known cell, and at least min_x_size by
  /// min_y_size around the origin. Empty if nothing is known and no minimum size is set.
  /// @param far  Gets the tiles so far from the rest that the grid would be larger than max_projection_mb.
  /// @throws std::length_error  if the minimum size is larger than that.
  [[nodiscard]] nav_msgs::OccupancyGrid makeGrid(const std_msgs::Header& header,
                                                 double resolution_m, FarTiles& far) const;

 private:
  static constexpr std::int32_t kTileEdge = 8;
  using Tile = std::array<std::int8_t, kTileEdge * kTileEdge>;
  using Tiles = std::unordered_map<Cell, Tile, CellHash>;

  void updateTile(const CuboidMap& map, const Cell& tile);
  /// Minimum size; empty if none is set.
  [[nodiscard]] CellBox leastExtent(double resolution_m) const;
  [[nodiscard]] bool isTooLarge(const CellBox& extent) const;
  /// Extent of all tiles, or of those nearest to their median.
  [[nodiscard]] CellBox findExtent(double resolution_m, FarTiles& far) const;

  OctomapServerParameters parameters_;
  bool is_everything_dirty_ = true;
  /// Changed tiles; tiles and columns of bricks are named by their least cell, with z 0.
  std::unordered_set<Cell, CellHash> dirty_;
  Tiles tiles_;
};

}  // namespace cuboid_mapping_ros
