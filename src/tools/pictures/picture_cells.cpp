// SPDX-License-Identifier: BSD-3-Clause
#include "pictures/picture_cells.h"

#include "joined_lookup.h"

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/cuboid_query.h"
#include "cuboid_mapping/query/value_query.h"

#include <algorithm>
#include <limits>
#include <optional>

namespace cuboid_mapping {
namespace {

/// The aligned cube of voxels around a voxel, as octrees have it. @param edge  A power of two.
CellBox alignedCube(const Cell& voxel, int edge) {
  const auto floor_to = [edge](int cell) { return cell & ~(edge - 1); };
  const Cell min{floor_to(voxel.x), floor_to(voxel.y), floor_to(voxel.z)};
  return {min, min + Cell{edge, edge, edge}};
}

/// Whether all voxels of a box are known with one log-odds, so that OctoMap prunes them to a leaf.
bool isLeaf(const CuboidMap& map, const CellBox& box) {
  double num_voxels = 0;
  std::optional<float> first;
  bool is_one = true;
  visitValues(map, box, Budget::unlimited(), [&](float log_odds, int count) {
    num_voxels += count;
    is_one = is_one && log_odds == first.value_or(log_odds);
    first = log_odds;
  });
  return is_one && num_voxels == box.numVoxels();
}

CellBox findLeaf(const CuboidMap& map, const Cell& voxel) {
  CellBox leaf = CellBox::ofCell(voxel);
  for (int edge = 2; edge <= 64; edge *= 2) {
    const CellBox larger = alignedCube(voxel, edge);
    if (!isLeaf(map, larger)) break;
    leaf = larger;
  }
  return leaf;
}

}  // namespace

CellBox findCell(const CuboidMap& map, const Cell& voxel, const PictureStyle& style) {
  std::optional<Cuboid> cuboid;
  switch (style.cells) {
    case PictureCells::kVoxels: break;
    case PictureCells::kOctomap: return findLeaf(map, voxel);
    case PictureCells::kCuboids: cuboid = findCuboidOfCell(map, voxel); break;
    case PictureCells::kJoined: cuboid = style.joined->find(voxel); break;
  }
  return cuboid ? cuboid->box : CellBox::ofCell(voxel);
}

std::size_t countCells(const CuboidMap& map, const PictureStyle& style) {
  if (style.cells == PictureCells::kJoined) return style.joined->cuboids().size();
  std::size_t num_cells = 0;
  visitAll(map, CuboidFilter::kOccupied, [&](const Cuboid& cuboid) {
    if (style.cells == PictureCells::kCuboids) {
      ++num_cells;
    } else {
      forEachBrick(cuboid.box, [&](const Cell& brick) {
        const auto part = BrickMask::ofBox(intersect(cuboid.box, brickBox(brick)));
        forEachCell(brick, part, [&](const Cell& voxel) {
          num_cells += findCell(map, voxel, style).min == voxel ? 1 : 0;
        });
      });
    }
    return Visit::kContinue;
  });
  return num_cells;
}

double edgeDarkness(const MetricBox& cell, const Eigen::Vector3d& point_map, double pixel_m) {
  const Eigen::Array3d to_face =
      (point_map - cell.min_m).array().abs().min((cell.max_m - point_map).array().abs());
  Eigen::Index axis = 0;
  to_face.minCoeff(&axis);
  double to_edge_m = std::numeric_limits<double>::infinity();
  double extent_m = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (i == axis) continue;
    to_edge_m = std::min(to_edge_m, to_face[i]);
    extent_m = std::min(extent_m, cell.max_m[i] - cell.min_m[i]);
  }
  constexpr double kHalfWidth = 0.6;  // In pixels.
  constexpr double kSmallest = 3.0,
                   kFullFrom = 8.0;  // Cells of fewer pixels have no edges, or faint ones.
  if (to_edge_m > kHalfWidth * pixel_m) return 0.0;
  return std::clamp((extent_m / pixel_m - kSmallest) / (kFullFrom - kSmallest), 0.0, 1.0);
}

}  // namespace cuboid_mapping
