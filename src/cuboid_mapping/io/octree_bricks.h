// SPDX-License-Identifier: BSD-3-Clause
// Bricks in the order of an octree.
#pragma once

#include "cuboid_mapping/geometry/brick.h"
#include "cuboid_mapping/io/octree_stream.h"

#include <array>
#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// Levels of the octree above the bricks, and inside a brick.
constexpr int kBrickDepth = 13;
constexpr int kLevelsInBrick = kOctreeDepth - kBrickDepth;

/// A brick with its place in an octree.
struct OctreeBrick {
  std::uint64_t order;  ///< Three bits for each level, the root's children highest.
  const PackedVoxels* voxels;
};

/// Bricks ordered by their place in an octree.
struct OctreeBricks {
  std::vector<OctreeBrick> bricks;
  double num_left_out = 0.0;  ///< Voxels outside kOctreeCells.
};

[[nodiscard]] OctreeBricks sortForOctree(const std::vector<VoxelBrick>& bricks);

/// Least cell of the brick at a place.
[[nodiscard]] Cell brickAt(std::uint64_t order);

/// The voxels of a brick in the order of an octree: bit 3 i of the index is bit i of x, bit 3 i + 1
/// of y, bit 3 i + 2 of z. So a word of `known` is a child of the brick, and a byte a child of that.
struct OctreeVoxels {
  std::array<float, kBrickVoxels> log_odds;  ///< Log-odds of known voxels.
  std::array<std::uint64_t, 8> known;

  /// Known voxels, one bit each, of `count` voxels (at most 64) from a place that is a multiple of it.
  [[nodiscard]] std::uint64_t knownFrom(std::uint32_t place, std::uint32_t count) const {
    const std::uint64_t word = known[place / 64] >> (place & 63U);
    return count == 64 ? word : word & ((1ULL << count) - 1);
  }
};

/// @param kind  For kBinary, values are 1 (occupied) and -1 (free).
void fillVoxels(const PackedVoxels& from, OctreeKind kind, OctreeVoxels& voxels);

}  // namespace cuboid_mapping
