// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/interop/octree_stream.h"

#include "octree_bricks.h"

#include <algorithm>
#include <cstring>
#include <limits>

namespace cuboid_mapping {
namespace {

/// What has become of a node.
struct NodeState {
  enum class Kind : unsigned char { kUnknown, kLeaf, kInner } kind;
  float log_odds;  ///< Of inner nodes the greatest below them.
};

constexpr NodeState kUnknownNode{NodeState::Kind::kUnknown, 0.0F};

/// Writes full trees: log-odds, then a bit for each child.
class FullSink {
 public:
  struct Mark {
    std::size_t num_bytes;
    std::size_t num_nodes;
  };

  explicit FullSink(OctreeStream& stream) : stream_(stream) {}

  Mark open() {
    const Mark mark{stream_.bytes.size(), stream_.num_nodes};
    leaf({}, 0, 0.0F);
    return mark;
  }
  void close(const Mark& mark, const std::array<NodeState, 8>& children, float log_odds) {
    char* node = stream_.bytes.data() + mark.num_bytes;
    std::memcpy(node, &log_odds, sizeof(log_odds));
    unsigned bits = 0;
    for (unsigned i = 0; i < 8; ++i) {
      if (children[i].kind != NodeState::Kind::kUnknown) bits |= 1U << i;
    }
    node[sizeof(log_odds)] = static_cast<char>(bits);
  }
  void undo(const Mark& mark) {
    stream_.bytes.resize(mark.num_bytes);
    stream_.num_nodes = mark.num_nodes;
  }
  void leaf(const Cell& /*min*/, int /*depth*/, float log_odds) {
    char node[sizeof(log_odds) + 1] = {};
    std::memcpy(node, &log_odds, sizeof(log_odds));
    stream_.bytes.append(node, sizeof(node));
    ++stream_.num_nodes;
  }

 private:
  OctreeStream& stream_;
};

/// Writes binary trees: two bits for each child, nothing for a leaf.
class BinarySink {
 public:
  using Mark = FullSink::Mark;

  explicit BinarySink(OctreeStream& stream) : stream_(stream) {}

  Mark open() {
    const Mark mark{stream_.bytes.size(), stream_.num_nodes};
    stream_.bytes.append(2, '\0');
    ++stream_.num_nodes;
    return mark;
  }
  void close(const Mark& mark, const std::array<NodeState, 8>& children, float /*log_odds*/) {
    unsigned bits = 0;
    for (unsigned i = 0; i < 8; ++i) {
      const bool is_leaf = children[i].kind == NodeState::Kind::kLeaf;
      const bool is_inner = children[i].kind == NodeState::Kind::kInner;
      if (is_inner || (is_leaf && children[i].log_odds < 0.0F)) bits |= 1U << (2 * i);
      if (is_inner || (is_leaf && children[i].log_odds >= 0.0F)) bits |= 2U << (2 * i);
    }
    stream_.bytes[mark.num_bytes] = static_cast<char>(bits & 0xFFU);
    stream_.bytes[mark.num_bytes + 1] = static_cast<char>(bits >> 8);
  }
  void undo(const Mark& mark) {
    stream_.bytes.resize(mark.num_bytes);
    stream_.num_nodes = mark.num_nodes;
  }
  void leaf(const Cell& /*min*/, int /*depth*/, float /*log_odds*/) { ++stream_.num_nodes; }

 private:
  OctreeStream& stream_;
};

/// Collects leaves.
class LeafSink {
 public:
  using Mark = std::size_t;

  explicit LeafSink(std::vector<OctreeLeaf>& leaves) : leaves_(leaves) {}

  Mark open() { return leaves_.size(); }
  void close(Mark /*mark*/, const std::array<NodeState, 8>& /*children*/, float /*log_odds*/) {}
  void undo(Mark mark) { leaves_.erase(leaves_.begin() + static_cast<long>(mark), leaves_.end()); }
  void leaf(const Cell& min, int depth, float log_odds) {
    leaves_.push_back({min, depth, log_odds});
  }

 private:
  std::vector<OctreeLeaf>& leaves_;
};

/// Walks the octree of cuboids depth first, and tells a sink of its nodes. Eight leaves of one value
/// are undone and become one.
template <typename SinkT>
class OctreeWalk {
 public:
  OctreeWalk(const std::vector<Cuboid>& cuboids, OctreeKind kind, SinkT sink)
      : cuboids_(cuboids), kind_(kind), sink_(sink), sorted_(sortIntoBricks(cuboids)) {}

  void run() { (void)visitBricks(sorted_.bricks.data(), end(), 0); }
  [[nodiscard]] double numLeftOut() const { return sorted_.num_left_out; }

 private:
  [[nodiscard]] const OctreeBrick* end() const {
    return sorted_.bricks.data() + sorted_.bricks.size();
  }

  /// @param visit_child  (int child) -> NodeState. @param min  Of the node.
  template <typename VisitT>
  NodeState visitNode(const Cell& min, int depth, const VisitT& visit_child) {
    const auto mark = sink_.open();
    std::array<NodeState, 8> children;
    bool is_known = false;
    bool is_uniform = true;
    float log_odds = -std::numeric_limits<float>::infinity();
    for (int i = 0; i < 8; ++i) {
      const NodeState child = visit_child(i);
      children[static_cast<std::size_t>(i)] = child;
      is_uniform &= child.kind == NodeState::Kind::kLeaf && child.log_odds == children[0].log_odds;
      if (child.kind == NodeState::Kind::kUnknown) continue;
      is_known = true;
      log_odds = std::max(log_odds, child.log_odds);
    }
    if (is_known && !is_uniform) {
      sink_.close(mark, children, log_odds);
      return {NodeState::Kind::kInner, log_odds};
    }
    sink_.undo(mark);
    return is_known ? makeLeaf(min, depth, log_odds) : kUnknownNode;
  }

  NodeState makeLeaf(const Cell& min, int depth, float log_odds) {
    sink_.leaf(min, depth, log_odds);
    return {NodeState::Kind::kLeaf, log_odds};
  }

  /// The node at a depth above all bricks of a range, which lie below it.
  NodeState visitBricks(const OctreeBrick* first, const OctreeBrick* last, int depth) {
    if (first == last) return kUnknownNode;
    if (depth == kBrickDepth) return visitBrick(*first);
    const int shift = 3 * (kBrickDepth - depth - 1);
    const Cell min = brickAt(first->order >> (shift + 3) << (shift + 3));
    return visitNode(min, depth, [&](int child) {
      const OctreeBrick* begin = first;
      while (first != last && static_cast<int>(first->order >> shift & 7) == child) ++first;
      return visitBricks(begin, first, depth + 1);
    });
  }

  NodeState visitBrick(const OctreeBrick& brick) {
    brick_ = brickAt(brick.order);
    fillVoxels(brick_, cuboids_, &sorted_.members[brick.first], sorted_.members.data() + brick.last,
               kind_, voxels_);
    if (voxels_.is_uniform) return makeLeaf(brick_, kBrickDepth, voxels_.log_odds[0]);
    return visitVoxels(0, kBrickDepth);
  }

  /// @param place  Of the first voxel, in the order of an octree.
  NodeState visitVoxels(std::uint32_t place, int depth) {
    const Cell min = brick_ + Cell{static_cast<std::int32_t>(gatherBits9(place)),
                                   static_cast<std::int32_t>(gatherBits9(place >> 1)),
                                   static_cast<std::int32_t>(gatherBits9(place >> 2))};
    if (depth == kOctreeDepth) {
      if (!voxels_.is_known[place]) return kUnknownNode;
      return makeLeaf(min, depth, voxels_.log_odds[place]);
    }
    const std::uint32_t step = 1U << (3 * (kOctreeDepth - depth - 1));
    // Found here, so that nothing has to be undone.
    if (isUniform(place, 8 * step)) return makeLeaf(min, depth, voxels_.log_odds[place]);
    return visitNode(min, depth, [&](int child) {
      return visitVoxels(place + static_cast<std::uint32_t>(child) * step, depth + 1);
    });
  }

  /// Whether so many voxels from a place on are all known, with one value.
  [[nodiscard]] bool isUniform(std::uint32_t place, std::uint32_t count) const {
    for (std::uint32_t i = place; i < place + count; ++i) {
      if (!voxels_.is_known[i] || voxels_.log_odds[i] != voxels_.log_odds[place]) return false;
    }
    return true;
  }

  static std::uint32_t gatherBits9(std::uint32_t place) {
    return (place & 1U) | (place >> 2 & 2U) | (place >> 4 & 4U);
  }

  const std::vector<Cuboid>& cuboids_;
  OctreeKind kind_;
  SinkT sink_;
  OctreeBricks sorted_;
  Cell brick_;
  OctreeVoxels voxels_;
};

}  // namespace

OctreeStream toOctreeStream(const std::vector<Cuboid>& cuboids, OctreeKind kind) {
  OctreeStream stream;
  const auto run = [&](auto sink) {
    OctreeWalk<decltype(sink)> walk(cuboids, kind, sink);
    walk.run();
    stream.num_left_out = walk.numLeftOut();
  };
  if (kind == OctreeKind::kFull) {
    run(FullSink(stream));
  } else {
    run(BinarySink(stream));
  }
  return stream;
}

std::vector<OctreeLeaf> computeOctreeLeaves(const std::vector<Cuboid>& cuboids, OctreeKind kind) {
  std::vector<OctreeLeaf> leaves;
  OctreeWalk<LeafSink>(cuboids, kind, LeafSink(leaves)).run();
  return leaves;
}

}  // namespace cuboid_mapping
