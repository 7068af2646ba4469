// SPDX-License-Identifier: BSD-3-Clause
// Damaged .ot and .bt files, and damaged octrees of messages.
#include "cuboid_mapping/io/octomap_files.h"
#include "cuboid_mapping/io/octree_stream.h"

#include "fuzz_limits.h"
#include "fuzz_target.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

namespace {

using namespace cuboid_mapping;

bool isLeaf(const UniformBox& read, const OctreeLeaf& leaf) {
  const CellBox box{leaf.min, leaf.min + Cell{leaf.edge(), leaf.edge(), leaf.edge()}};
  return read.box == box && read.log_odds == leaf.log_odds;
}

/// Checks that the stream has the leaves of the bricks' octree.
void checkStream(const std::vector<VoxelBrick>& bricks, OctreeKind kind) {
  const OctreeStream stream = toOctreeStream(bricks, kind);
  const OctreeContent again = kind == OctreeKind::kFull
                                  ? readFullOctree(stream.bytes)
                                  : readBinaryOctree(stream.bytes, -1.0F, 1.0F);
  const std::vector<OctreeLeaf> leaves = computeOctreeLeaves(bricks, kind);
  const bool is_same =
      stream.num_nodes == again.num_nodes &&
      std::equal(again.leaves.begin(), again.leaves.end(), leaves.begin(), leaves.end(), isLeaf);
  if (!is_same) std::abort();
}

double countVoxels(const std::vector<UniformBox>& leaves) {
  double num_voxels = 0.0;
  for (const UniformBox& leaf : leaves) num_voxels += leaf.box.numVoxels();
  return num_voxels;
}

/// Checks that content that was read is written again.
void check(const OctreeContent& content) {
  const std::vector<VoxelBrick> bricks = bricksOf(content.leaves, fuzzLimits());
  checkStream(bricks, OctreeKind::kFull);
  checkStream(bricks, OctreeKind::kBinary);
  const OctreeStream full = toOctreeStream(bricks, OctreeKind::kFull);
  if (countVoxels(content.leaves) != countVoxels(readFullOctree(full.bytes).leaves)) std::abort();
}

template <typename ReadT>
void attempt(const ReadT& read) {
  try {
    read();
  } catch (const MapFileError&) {
    // Refused, as expected.
  }
}

/// An OctoMap file with a given number of nodes in its header.
std::string makeFile(const char* kind, std::size_t num_nodes, const std::string& nodes) {
  return "# Octomap OcTree " + std::string(kind) + "file\nid OcTree\nsize " +
         std::to_string(num_nodes) + "\nres 0.1\ndata\n" + nodes;
}

}  // namespace

FUZZ_TARGET(fuzz_octomap_files) {
  const std::string input(reinterpret_cast<const char*>(data), size);
  attempt([&] { (void)fromOctomapFile(input, {}, fuzzLimits()); });
  attempt([&] {
    const OctreeContent content = readFullOctree(input);
    attempt([&] { check(content); });
    (void)fromOctomapFile(makeFile("", content.num_nodes, input), {}, fuzzLimits());
  });
  attempt([&] {
    const OctreeContent content = readBinaryOctree(input, -1.0F, 1.0F);
    attempt([&] { check(content); });
    (void)fromOctomapFile(makeFile("binary ", content.num_nodes, input), {}, fuzzLimits());
  });
  attempt([&] { (void)readFullOctree(input, 3); });
  return 0;
}
