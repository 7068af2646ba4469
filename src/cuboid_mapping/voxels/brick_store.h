// SPDX-License-Identifier: BSD-3-Clause
// The parts of a VoxelStore, for code inside the library that follows its changes.
#pragma once

#include "cuboid_mapping/voxels/brick_cuboids.h"
#include "cuboid_mapping/voxels/brick_table.h"
#include "cuboid_mapping/voxels/voxel_store.h"

namespace cuboid_mapping {

/// A brick of a map, with its cuboids.
struct Brick : VoxelBrick {
  BrickCuboids cuboids;  ///< Cuboids of the voxels, or stale.
};

struct VoxelStore::PendingBrick {
  static constexpr std::uint32_t kNoIndex = BrickTable<Brick>::kNoItem;

  Cell brick;                      ///< Its least cell.
  BrickMask changed;               ///< Voxels that are new, gone, or have another log-odds.
  bool is_reclassified = false;    ///< Some have another class.
  std::uint32_t index = kNoIndex;  ///< Number of the brick; of a new one after commit() only.
  PackedVoxels voxels;             ///< New voxels of a changing brick; after commit() the old ones.
  BrickCuboids cuboids;            ///< The same, if it is reclassified.
  CellBox bounds;                  ///< Around the known voxels afterwards, if it is reclassified.
  bool has_other_branch = false;   ///< One of the two differs from before, or the brick is new.
  bool has_occupied = false;       ///< Afterwards, if it is reclassified.
  bool is_new = false;             ///< No voxel is known before.
  bool is_gone = false;            ///< No voxel is known afterwards.
  int free = 0;                    ///< Voxels that become free, less those that do not stay so.
  int occupied = 0;                ///< The same of occupied ones.
};

}  // namespace cuboid_mapping
