// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/octomap_server/projected_map.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

/// Extent of the known cells of a tile.
template <typename TileT>
CellBox boundsOf(const Cell& tile, const TileT& values) {
  constexpr std::int32_t kEdge = kBrickEdge;
  CellBox bounds;
  for (std::int32_t i = 0; i < kEdge * kEdge; ++i) {
    if (values[static_cast<std::size_t>(i)] == kUnknownCell) continue;
    const CellBox cell = CellBox::ofCell(tile + Cell{i % kEdge, i / kEdge, 0});
    bounds = bounds.isEmpty() ? cell : unite(bounds, cell);
  }
  return bounds;
}

/// Sorts tiles by their distance from the median tile. @pre There are tiles.
void sortByDistance(std::vector<Cell>& tiles) {
  const Cell middle = medianOf(tiles);
  const auto distance = [&middle](const Cell& tile) {
    return std::max(std::abs(std::int64_t{tile.x} - middle.x),
                    std::abs(std::int64_t{tile.y} - middle.y));
  };
  std::sort(tiles.begin(), tiles.end(), [&](const Cell& a, const Cell& b) {
    return std::make_pair(distance(a), a) < std::make_pair(distance(b), b);
  });
}

std::int32_t toLayer(double z_cells) {
  constexpr double kMax = Grid::kMaxCell;
  return static_cast<std::int32_t>(std::clamp(z_cells, -kMax, kMax));
}

}  // namespace

void ProjectedMap::noteChanges(const ChangeSet& changes) {
  if (changes.is_everything) *this = ProjectedMap(parameters_);
  if (is_everything_dirty_) return;
  // Voxels beside a change may have become speckles, or stopped being speckles.
  for (const ChangedBrick& changed : changes.bricks) {
    if (!changed.has_new_cuboids) continue;
    for (const std::int32_t y : {-kTileEdge, 0, kTileEdge}) {
      for (const std::int32_t x : {-kTileEdge, 0, kTileEdge}) {
        dirty_.insert({changed.brick.x + x, changed.brick.y + y, 0});
      }
    }
  }
}

void ProjectedMap::update(const CuboidMap& map) {
  if (is_everything_dirty_) {
    map.voxels().forEach([this](const VoxelBrick& brick) {
      dirty_.insert({brick.brick.x, brick.brick.y, 0});
    });
    is_everything_dirty_ = false;
  }
  for (const Cell& tile : dirty_) updateTile(map, tile);
  dirty_.clear();
}

void ProjectedMap::updateTile(const CuboidMap& map, const Cell& tile) {
  CellBox column{tile, tile + Cell{kTileEdge, kTileEdge, 0}};
  const double resolution_m = map.grid().resolution();
  column.min.z = toLayer(std::floor(parameters_.occupancy_min_z_m / resolution_m + 1e-6));
  column.max.z = toLayer(std::ceil(parameters_.occupancy_max_z_m / resolution_m - 1e-6));
  // A slice of a brick has a bit for each cell of the tile.
  std::uint64_t known = 0;
  std::uint64_t occupied = 0;
  if (const auto& bounds = map.bounds()) column = intersect(column, *bounds);
  if (!column.isEmpty()) {
    map.voxels().forEachIn(column, [&](const VoxelBrick& brick) {
      BrickMask seen = BrickMask::ofBox(intersect(column, brickBox(brick.brick)));
      if (parameters_.filter_speckles) seen &= ~findSpeckles(map.voxels(), brick);
      const BrickMask known_here = brick.voxels.known() & seen;
      const BrickMask occupied_here = brick.voxels.occupied() & seen;
      for (int z = 0; z < kBrickEdge; ++z) {
        known |= known_here[z];
        occupied |= occupied_here[z];
      }
    });
  }
  if (known == 0) {
    tiles_.erase(tile);
    return;
  }
  Tile& values = tiles_[tile];
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::int8_t value = (occupied >> i & 1) != 0 ? kOccupiedCell : kFreeCell;
    values[i] = (known >> i & 1) != 0 ? value : kUnknownCell;
  }
}

CellBox ProjectedMap::leastExtent(double resolution_m) const {
  if (parameters_.min_x_size_m == 0.0 && parameters_.min_y_size_m == 0.0) return {};
  CellBox extent{{0, 0, 0}, {0, 0, 1}};
  // The cells of both ends are included, as in octomap_server.
  const auto widen = [&](double size_m, std::int32_t& min, std::int32_t& max) {
    min = static_cast<std::int32_t>(std::floor(-0.5 * size_m / resolution_m + 1e-6));
    max = static_cast<std::int32_t>(std::floor(0.5 * size_m / resolution_m + 1e-6)) + 1;
  };
  widen(parameters_.min_x_size_m, extent.min.x, extent.max.x);
  widen(parameters_.min_y_size_m, extent.min.y, extent.max.y);
  return extent;
}

bool ProjectedMap::isTooLarge(const CellBox& extent) const {
  const Cell size = extent.size();
  return static_cast<double>(size.x) * size.y > 1e6 * parameters_.max_projection_mb;
}

CellBox ProjectedMap::findExtent(double resolution_m, FarTiles& far) const {
  CellBox extent = leastExtent(resolution_m);
  const auto add = [&extent](const CellBox& box) {
    extent = extent.isEmpty() ? box : unite(extent, box);
  };
  for (const auto& [tile, values] : tiles_) {
    const CellBox whole{tile, tile + Cell{kTileEdge, kTileEdge, 1}};
    if (!extent.contains(whole)) add(boundsOf(tile, values));
  }
  if (!isTooLarge(extent) || tiles_.empty()) return extent;

  std::vector<Cell> tiles;
  tiles.reserve(tiles_.size());
  for (const auto& [tile, values] : tiles_) tiles.push_back(tile);
  sortByDistance(tiles);
  extent = leastExtent(resolution_m);
  for (const Cell& tile : tiles) {
    const CellBox box = boundsOf(tile, tiles_.at(tile));
    if (isTooLarge(extent.isEmpty() ? box : unite(extent, box))) {
      ++far.count;
      far.farthest_m = resolution_m * Eigen::Vector2d(box.min.x, box.min.y);
    } else {
      add(box);
    }
  }
  return extent;
}

nav_msgs::OccupancyGrid ProjectedMap::makeGrid(const std_msgs::Header& header, double resolution_m,
                                               FarTiles& far) const {
  nav_msgs::OccupancyGrid grid;
  grid.header = header;
  grid.info.map_load_time = header.stamp;
  const CellBox extent = findExtent(resolution_m, far);
  if (isTooLarge(extent)) {
    throw std::length_error(
        "min_x_size and min_y_size alone make projected_map larger than 100 MB: lower them");
  }
  layOut(extent, resolution_m, grid);
  for (const auto& [tile, values] : tiles_) {
    for (std::int32_t i = 0; i < kTileEdge * kTileEdge; ++i) {
      const std::int8_t value = values[static_cast<std::size_t>(i)];
      if (value == kUnknownCell) continue;
      const Cell cell = tile + Cell{i % kTileEdge, i / kTileEdge, 0};
      if (!extent.contains(cell)) continue;  // The cell belongs to a far tile.
      const Cell at = cell - extent.min;
      grid.data[static_cast<std::size_t>(at.y) * grid.info.width + static_cast<std::size_t>(at.x)] =
          value;
    }
  }
  return grid;
}

}  // namespace cuboid_mapping_ros
