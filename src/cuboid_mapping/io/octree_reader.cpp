// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/octree_stream.h"

#include "cuboid_mapping/io/byte_stream.h"

#include <cmath>
#include <string>

namespace cuboid_mapping {
namespace {

/// A node with its least cell.
struct Place {
  Cell min;
  int depth;

  [[nodiscard]] std::int32_t edge() const { return std::int32_t{1} << (kOctreeDepth - depth); }
  [[nodiscard]] Place child(unsigned i) const {
    const std::int32_t half = edge() / 2;
    return {
        min + Cell{(i & 1U) != 0 ? half : 0, (i & 2U) != 0 ? half : 0, (i & 4U) != 0 ? half : 0},
        depth + 1};
  }
};

constexpr Place kRoot{kOctreeCells.min, 0};

[[noreturn]] void failInOctree(const std::string& what) {
  throw MapFileError(MapFileDefect::kCorrupted, "is damaged: " + what);
}

class OctreeReader {
 public:
  OctreeReader(std::string_view bytes, std::size_t max_nodes)
      : reader_(bytes), max_nodes_(max_nodes) {}

  void readFullNode(const Place& place, std::size_t extra_bytes) {
    const float log_odds = reader_.readF32();
    (void)reader_.readBytes(extra_bytes);
    const auto children = static_cast<unsigned char>(reader_.readBytes(1)[0]);
    countNode();
    if (!std::isfinite(log_odds)) failInOctree("a node of the octree has no finite log-odds");
    if (children == 0) return addLeaf(place, log_odds);
    checkDepth(place);
    for (unsigned i = 0; i < 8; ++i) {
      if ((children >> i & 1U) != 0) readFullNode(place.child(i), extra_bytes);
    }
  }

  void readBinaryNode(const Place& place, float free_log_odds, float occupied_log_odds) {
    checkDepth(place);
    const std::string_view bytes = reader_.readBytes(2);
    const unsigned children = static_cast<unsigned char>(bytes[0]) |
                              static_cast<unsigned>(static_cast<unsigned char>(bytes[1])) << 8;
    countNode();
    if (children == 0) failInOctree("an inner node of the octree has no children");
    for (unsigned i = 0; i < 8; ++i) {
      const unsigned child = children >> (2 * i) & 3U;
      if (child == 3) {
        readBinaryNode(place.child(i), free_log_odds, occupied_log_odds);
      } else if (child != 0) {
        countNode();
        addLeaf(place.child(i), child == 1 ? free_log_odds : occupied_log_odds);
      }
    }
  }

  OctreeContent finish() {
    if (reader_.numLeft() != 0) failInOctree("there is more data after the octree");
    return std::move(content_);
  }

 private:
  void countNode() {
    if (++content_.num_nodes <= max_nodes_) return;
    throw MapFileError(MapFileDefect::kTooBig, "holds an octree of more nodes than the " +
                                                   std::to_string(max_nodes_) + " that are read");
  }

  static void checkDepth(const Place& place) {
    if (place.depth == kOctreeDepth) failInOctree("the octree has more than 16 levels");
  }

  void addLeaf(const Place& place, float log_odds) {
    const std::int32_t edge = place.edge();
    content_.leaves.push_back({{place.min, place.min + Cell{edge, edge, edge}}, log_odds});
  }

  ByteReader reader_;
  std::size_t max_nodes_;
  OctreeContent content_;
};

}  // namespace

OctreeContent readFullOctree(std::string_view bytes, std::size_t extra_bytes,
                             std::size_t max_nodes) {
  if (bytes.empty()) return {};
  OctreeReader reader(bytes, max_nodes);
  reader.readFullNode(kRoot, extra_bytes);
  return reader.finish();
}

OctreeContent readBinaryOctree(std::string_view bytes, float free_log_odds, float occupied_log_odds,
                               std::size_t max_nodes) {
  if (bytes.empty()) return {};
  OctreeReader reader(bytes, max_nodes);
  reader.readBinaryNode(kRoot, free_log_odds, occupied_log_odds);
  return reader.finish();
}

}  // namespace cuboid_mapping
