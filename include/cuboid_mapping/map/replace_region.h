// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/change_set.h"
#include "cuboid_mapping/map/map_content.h"
#include "cuboid_mapping/map/voxel_classes.h"
#include "cuboid_mapping/rtree/rtree.h"

#include <vector>

namespace cuboid_mapping {

/// The R-tree of a map, and what is derived from it.
struct MapStore {
  RTree& tree;
  MapContent& content;
  VoxelClasses& classes;
};

/// Puts cuboids in the place of everything that the map holds inside a box.
///
/// A cuboid that reaches beyond the box is cut at its faces; what lies outside stays. One that is
/// there already, exactly so, stays where it is.
///
/// @param cuboids  Disjoint, inside the box; none: the box becomes unknown.
/// @param changes  Gets boxes around what has changed, see ChangeSet.
/// @return Whether a cuboid has changed.
/// @complexity O((k + c) log n) for k cuboids that are replaced by c; goes group by group.
bool replaceRegion(const CellBox& box, const std::vector<Cuboid>& cuboids, const MapStore& store,
                   ChangeSet& changes);

}  // namespace cuboid_mapping
