// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"

#include <string>
#include <vector>

namespace cuboid_mapping {

/// All contradictions in and between the parts of a map; empty for a sound map.
///
/// Checked:
///   - voxel store: no brick without a known voxel; each can be found; occupied voxels are known;
///     each known voxel has one log-odds, which is finite and of its class; counts and bounds;
///   - R-tree: checkTree() and checkDisjoint();
///   - cuboids, those of waiting bricks as divide() gives them: every known voxel lies in exactly one
///     cuboid, of its class, and no other voxel lies in any;
///   - kClass, kNone: the cuboids of a brick are those of divideBrick(), or its voxels;
///   - kGrowth: a cuboid of several voxels has stable voxels only; no brick waits.
/// @complexity O(known voxels), and that of checkDisjoint(). For tests.
[[nodiscard]] std::vector<std::string> checkMap(const CuboidMap& map);

}  // namespace cuboid_mapping
