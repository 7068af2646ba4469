// SPDX-License-Identifier: BSD-3-Clause
// OctoMap's serialized octrees, written from bricks and read into boxes without a tree in between.
//
// Writes nodes depth first, as octomap::OcTree::writeData (full: log-odds of every node) and writeBinaryData
// (binary: free, occupied or inner). OctoMap itself would build an OcTree voxel by voxel, which takes many
// times as long as its serialization, and its readers follow a damaged stream into any depth.
#pragma once

#include "cuboid_mapping/io/octomap_files.h"
#include "cuboid_mapping/occupancy/cuboid_filter.h"
#include "cuboid_mapping/voxels/voxel_store.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace cuboid_mapping {

/// Levels below the root, down to the voxels.
constexpr int kOctreeDepth = 16;
/// Cells of an octree of this depth.
constexpr CellBox kOctreeCells{{-32768, -32768, -32768}, {32768, 32768, 32768}};

/// A serialized octree.
struct OctreeStream {
  std::string bytes;          ///< Empty for a tree without nodes.
  std::size_t num_nodes = 0;  ///< Inner nodes and leaves, as octomap::OcTree::size().
  double num_left_out = 0.0;  ///< Voxels outside kOctreeCells, which are left out.
};

/// The pruned octree of bricks, byte for byte as octomap::OcTree writes it. @param bricks  Each once.
/// @complexity O(b log b) for b bricks.
[[nodiscard]] OctreeStream toOctreeStream(const std::vector<VoxelBrick>& bricks, OctreeKind kind);

/// A leaf of an octree: an aligned cube of voxels.
struct OctreeLeaf {
  Cell min;        ///< Least cell; each coordinate is a multiple of edge().
  int depth;       ///< Its edge has 2^(kOctreeDepth - depth) voxels.
  float log_odds;  ///< The same for all its voxels.

  /// Edge in voxels, 1 to 2^16.
  [[nodiscard]] std::int32_t edge() const { return std::int32_t{1} << (kOctreeDepth - depth); }
};

/// The leaves of the octree of bricks, depth first. Voxels outside kOctreeCells are left
/// out; for kBinary the log-odds are 1 and -1. @param classes  Leaves of other classes are left out.
[[nodiscard]] std::vector<OctreeLeaf> computeOctreeLeaves(
    const std::vector<VoxelBrick>& bricks, OctreeKind kind,
    CuboidFilter classes = CuboidFilter::kAll);

/// Content of an octree.
struct OctreeContent {
  std::vector<UniformBox> leaves;  ///< Disjoint cubes of known voxels.
  std::size_t num_nodes = 0;       ///< Inner nodes and leaves.
};

/// Reads a full octree. @param extra_bytes  Bytes of a node after its log-odds: 3 in a ColorOcTree.
/// @throws MapFileError: kTruncated; kCorrupted for a node deeper than kOctreeDepth, log-odds that
///         are no number, or bytes that follow the end; kTooBig for more nodes than allowed.
[[nodiscard]] OctreeContent readFullOctree(
    std::string_view bytes, std::size_t extra_bytes = 0,
    std::size_t max_nodes = std::numeric_limits<std::size_t>::max());

/// Reads a binary octree; its leaves get the log-odds given. @throws as above, and kCorrupted for
/// an inner node without children.
[[nodiscard]] OctreeContent readBinaryOctree(
    std::string_view bytes, float free_log_odds, float occupied_log_odds,
    std::size_t max_nodes = std::numeric_limits<std::size_t>::max());

}  // namespace cuboid_mapping
