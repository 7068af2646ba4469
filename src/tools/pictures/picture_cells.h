// SPDX-License-Identifier: BSD-3-Clause
// The cells whose edges a picture of a map shows.
#pragma once

#include "pictures/map_picture.h"

namespace cuboid_mapping {

/// The cell of an occupied voxel: its cuboid, joined cuboid, leaf of OctoMap's pruned tree, or the voxel itself.
[[nodiscard]] CellBox findCell(const CuboidMap& map, const Cell& voxel, const PictureStyle& style);

/// Number of occupied cells of a map, of the kind that the style names. @complexity O(occupied voxels).
[[nodiscard]] std::size_t countCells(const CuboidMap& map, const PictureStyle& style);

/// How dark an edge of a cell is at a point of its surface: 0 off the edge, 1 on it. Edges fade where cells are
/// smaller than a few pixels, so that distant walls keep their colour.
/// @param pixel_m  Edge of a pixel at the distance of the point.
[[nodiscard]] double edgeDarkness(const MetricBox& cell, const Eigen::Vector3d& point_map,
                                  double pixel_m);

}  // namespace cuboid_mapping
