// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/brick_update.h"

#include <octomap/OcTree.h>

namespace cuboid_mapping::bench {

/// The key of a voxel in a tree of 16 levels. @pre Within its range.
[[nodiscard]] octomap::OcTreeKey toKey(const Cell& cell);

/// What insertPointCloud does with the voxels that it has found.
void updateOctomap(const ScanUpdate& update, octomap::OcTree& tree);

}  // namespace cuboid_mapping::bench
