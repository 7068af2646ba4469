// SPDX-License-Identifier: BSD-3-Clause
// Damaged .ot and .bt files, and damaged octrees of messages.
#include "cuboid_mapping/interop/octomap_files.h"

#include "fuzz_limits.h"

#include <cstdint>
#include <cstdlib>
#include <string>

namespace {

using namespace cuboid_mapping;

/// What is read must be what is written again.
void check(const OctreeContent& content) {
  const std::string bytes = toOctreeStream(content.cuboids, OctreeKind::kBinary).bytes;
  double num_voxels = 0.0;
  for (const Cuboid& cuboid : content.cuboids) num_voxels += cuboid.box.numVoxels();
  double num_again = 0.0;
  for (const Cuboid& cuboid : readBinaryOctree(bytes, -1.0F, 1.0F).cuboids) {
    num_again += cuboid.box.numVoxels();
  }
  if (num_voxels != num_again) std::abort();
}

template <typename ReadT>
void attempt(const ReadT& read) {
  try {
    read();
  } catch (const MapFileError&) {
    // Refused, as it should be.
  }
}

/// A file of one node more than there are in it is refused before it is read: says how many.
std::string makeFile(const char* kind, std::size_t num_nodes, const std::string& nodes) {
  return "# Octomap OcTree " + std::string(kind) + "file\nid OcTree\nsize " +
         std::to_string(num_nodes) + "\nres 0.1\ndata\n" + nodes;
}

bool isSmall(const OctreeContent& content) {
  MapSnapshot snapshot;
  snapshot.cuboids = content.cuboids;
  return !findFault(snapshot, fuzzLimits());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string input(reinterpret_cast<const char*>(data), size);
  attempt([&] { (void)fromOctomapFile(input, {}, fuzzLimits()); });
  attempt([&] {
    const OctreeContent content = readFullOctree(input);
    if (isSmall(content)) check(content);
    (void)fromOctomapFile(makeFile("", content.num_nodes, input), {}, fuzzLimits());
  });
  attempt([&] {
    const OctreeContent content = readBinaryOctree(input, -1.0F, 1.0F);
    if (isSmall(content)) check(content);
    (void)fromOctomapFile(makeFile("binary ", content.num_nodes, input), {}, fuzzLimits());
  });
  attempt([&] { (void)readFullOctree(input, 3); });
  return 0;
}
