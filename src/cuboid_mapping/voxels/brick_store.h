// SPDX-License-Identifier: BSD-3-Clause
// Parts of a VoxelStore for library code that follows its changes.
#pragma once

#include "cuboid_mapping/voxels/brick_cuboids.h"
#include "cuboid_mapping/voxels/brick_table.h"
#include "cuboid_mapping/voxels/voxel_store.h"

namespace cuboid_mapping {

/// A brick of a map, with its cuboids.
struct Brick : VoxelBrick {
  BrickCuboids cuboids;  ///< Cuboids of the voxels, or stale.
};

/// commit() swaps voxels and cuboids with those of the map: it frees no memory, and what it replaces is freed with
/// the change, when readers go on.
struct VoxelStore::PendingBrick {
  static constexpr std::uint32_t kNoIndex = BrickTable<Brick>::kNoItem;

  Cell brick;                      ///< Its least cell.
  BrickMask changed;               ///< Voxels that are new, gone, or have another log-odds.
  bool is_reclassified = false;    ///< Some voxels have another class.
  std::uint32_t index = kNoIndex;  ///< Number of the brick; for a new one only after commit().
  PackedVoxels voxels;             ///< New voxels of a changing brick.
  BrickCuboids cuboids;            ///< New cuboids.
  CellBox bounds;                  ///< Box of the known voxels afterwards, if it is reclassified.
  bool has_other_branch = false;   ///< Whether bounds or has_occupied changes, or the brick is new.
  bool has_occupied = false;       ///< Whether some are occupied afterwards, if it is reclassified.
  bool is_new = false;             ///< No voxel was known before.
  bool is_gone = false;            ///< No voxel is known afterwards.
  int free = 0;                    ///< Change of the number of free voxels.
  int occupied = 0;                ///< Change of the number of occupied voxels.
};

}  // namespace cuboid_mapping
