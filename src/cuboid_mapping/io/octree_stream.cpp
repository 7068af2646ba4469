// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/octree_stream.h"

#include "cuboid_mapping/scan/morton.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

namespace cuboid_mapping {
namespace {

/// Levels of the octree above the bricks.
constexpr int kBrickDepth = 13;

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

constexpr std::int32_t kCenter = 32768;

std::uint64_t orderOf(const Cell& brick) {
  const auto number = [](std::int32_t v) { return static_cast<std::uint32_t>((v + kCenter) >> 3); };
  return spreadBits(number(brick.x)) | spreadBits(number(brick.y)) << 1 |
         spreadBits(number(brick.z)) << 2;
}

/// Indices of the voxels of a brick in the order of an octree.
constexpr std::array<std::uint16_t, kBrickVoxels> makePlaces() {
  std::array<std::uint16_t, kBrickVoxels> places{};
  for (std::uint32_t voxel = 0; voxel < kBrickVoxels; ++voxel) {
    std::uint32_t place = 0;
    for (std::uint32_t bit = 0; bit < 9; ++bit) {  // Bits x, y, z of three each, low ones first.
      place |= (voxel >> bit & 1U) << (3 * (bit % 3) + bit / 3);
    }
    places[voxel] = static_cast<std::uint16_t>(place);
  }
  return places;
}

constexpr std::array<std::uint16_t, kBrickVoxels> kPlaces = makePlaces();

OctreeBricks sortForOctree(const std::vector<VoxelBrick>& bricks) {
  OctreeBricks sorted;
  sorted.bricks.reserve(bricks.size());
  for (const VoxelBrick& brick : bricks) {
    if (kOctreeCells.contains(brick.brick)) {
      sorted.bricks.push_back({orderOf(brick.brick), &brick.voxels});
    } else {
      sorted.num_left_out += brick.voxels.known().count();
    }
  }
  std::sort(sorted.bricks.begin(), sorted.bricks.end(),
            [](const OctreeBrick& a, const OctreeBrick& b) { return a.order < b.order; });
  return sorted;
}

/// Least cell of the brick at a place.
Cell brickAt(std::uint64_t order) {
  const auto coordinate = [&](int axis) {
    return static_cast<std::int32_t>(gatherBits(order >> axis) << 3) - kCenter;
  };
  return {coordinate(0), coordinate(1), coordinate(2)};
}

/// @param kind  For kBinary, values are 1 (occupied) and -1 (free).
void fillVoxels(const PackedVoxels& from, OctreeKind kind, OctreeVoxels& voxels) {
  voxels.known.fill(0);
  from.forEachValue([&](float log_odds, const BrickMask& of_value) {
    const float value = kind == OctreeKind::kFull ? log_odds : (log_odds >= 0.0F ? 1.0F : -1.0F);
    of_value.forEach([&](int voxel) {
      const unsigned place = kPlaces[static_cast<std::size_t>(voxel)];
      voxels.log_odds[place] = value;
      voxels.known[place / 64] |= 1ULL << (place & 63U);
    });
  });
}

/// State of a node.
struct NodeState {
  enum class Kind : unsigned char { kUnknown, kLeaf, kInner } kind;
  float log_odds;  ///< An inner node has the greatest below it.
};

constexpr NodeState kUnknownNode{NodeState::Kind::kUnknown, 0.0F};

/// Writes full trees: log-odds, then a bit for each child. The bytes have spare room at their end until finish(): to append
/// each node to them took 5 % longer.
class FullSink {
 public:
  struct Mark {
    std::size_t num_bytes;
    std::size_t num_nodes;
  };

  explicit FullSink(OctreeStream& stream) : stream_(stream) {}

  Mark open() {
    const Mark mark{num_bytes_, stream_.num_nodes};
    leaf({}, 0, 0.0F);
    return mark;
  }
  void close(const Mark& mark, const std::array<NodeState, 8>& children, float log_odds) {
    unsigned bits = 0;
    for (unsigned i = 0; i < 8; ++i) {
      if (children[i].kind != NodeState::Kind::kUnknown) bits |= 1U << i;
    }
    write(mark.num_bytes, log_odds, bits);
  }
  void undo(const Mark& mark) {
    num_bytes_ = mark.num_bytes;
    stream_.num_nodes = mark.num_nodes;
  }
  void leaf(const Cell& /*min*/, int /*depth*/, float log_odds) {
    if (num_bytes_ + kNodeBytes > stream_.bytes.size()) {
      stream_.bytes.resize(2 * stream_.bytes.size() + 4096);
    }
    write(num_bytes_, log_odds, 0);
    num_bytes_ += kNodeBytes;
    ++stream_.num_nodes;
  }
  void finish() { stream_.bytes.resize(num_bytes_); }

 private:
  static constexpr std::size_t kNodeBytes = sizeof(float) + 1;

  void write(std::size_t place, float log_odds, unsigned children) {
    char* node = stream_.bytes.data() + place;
    std::memcpy(node, &log_odds, sizeof(log_odds));
    node[sizeof(log_odds)] = static_cast<char>(children);
  }

  OctreeStream& stream_;
  std::size_t num_bytes_ = 0;
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
  void finish() {}

 private:
  OctreeStream& stream_;
};

/// Collects leaves. Those that undo() takes back have one class.
class LeafSink {
 public:
  using Mark = std::size_t;

  LeafSink(std::vector<OctreeLeaf>& leaves, CuboidFilter classes)
      : leaves_(leaves), classes_(classes) {}

  Mark open() { return leaves_.size(); }
  void close(Mark /*mark*/, const std::array<NodeState, 8>& /*children*/, float /*log_odds*/) {}
  void undo(Mark mark) { leaves_.erase(leaves_.begin() + static_cast<long>(mark), leaves_.end()); }
  void leaf(const Cell& min, int depth, float log_odds) {
    const bool is_occupied = log_odds >= 0.0F;
    const bool is_left_out =
        classes_ != CuboidFilter::kAll && is_occupied != (classes_ == CuboidFilter::kOccupied);
    if (!is_left_out) leaves_.push_back({min, depth, log_odds});
  }
  void finish() {}

 private:
  std::vector<OctreeLeaf>& leaves_;
  CuboidFilter classes_;
};

/// Walks the octree of bricks depth first, and passes its nodes to a sink. Eight leaves of one value
/// are replaced by one leaf.
template <typename SinkT>
class OctreeWalk {
 public:
  OctreeWalk(const std::vector<VoxelBrick>& bricks, OctreeKind kind, SinkT sink)
      : kind_(kind), sink_(sink), sorted_(sortForOctree(bricks)) {}

  void run() {
    if (!sorted_.bricks.empty()) (void)visitBricks(sorted_.bricks.data(), end(), 0);
    sink_.finish();
  }
  [[nodiscard]] double numLeftOut() const { return sorted_.num_left_out; }

 private:
  [[nodiscard]] const OctreeBrick* end() const {
    return sorted_.bricks.data() + sorted_.bricks.size();
  }

  /// @param candidates  A bit for each possible child; the others are unknown.
  /// @param visit_child  (unsigned child) -> NodeState, called for each candidate in order.
  /// @param min  Least cell of the node.
  template <typename VisitT>
  NodeState visitNode(const Cell& min, int depth, unsigned candidates, const VisitT& visit_child) {
    const auto mark = sink_.open();
    std::array<NodeState, 8> children;
    children.fill(kUnknownNode);
    bool is_uniform = candidates == 0xFFU;
    float log_odds = -std::numeric_limits<float>::infinity();
    for (unsigned left = candidates; left != 0; left &= left - 1) {
      const auto i = static_cast<unsigned>(__builtin_ctz(left));
      const NodeState child = visit_child(i);
      children[i] = child;
      is_uniform &= child.kind == NodeState::Kind::kLeaf && child.log_odds == children[0].log_odds;
      log_odds = std::max(log_odds, child.log_odds);
    }
    if (!is_uniform) {
      sink_.close(mark, children, log_odds);
      return {NodeState::Kind::kInner, log_odds};
    }
    sink_.undo(mark);
    return makeLeaf(min, depth, log_odds);
  }

  NodeState makeLeaf(const Cell& min, int depth, float log_odds) {
    sink_.leaf(min, depth, log_odds);
    return {NodeState::Kind::kLeaf, log_odds};
  }

  /// The node at a depth above a range of bricks, which is not empty.
  NodeState visitBricks(const OctreeBrick* first, const OctreeBrick* last, int depth) {
    if (depth == kBrickDepth) return visitBrick(*first);
    const int shift = 3 * (kBrickDepth - depth - 1);
    const Cell min = brickAt(first->order >> (shift + 3) << (shift + 3));
    const auto child_of = [shift](const OctreeBrick& brick) {
      return static_cast<unsigned>(brick.order >> shift & 7U);
    };
    unsigned candidates = 0;
    for (const OctreeBrick* brick = first; brick != last;) {
      const unsigned child = child_of(*brick);
      candidates |= 1U << child;
      brick = std::upper_bound(brick, last, child, [&](unsigned wanted, const OctreeBrick& other) {
        return wanted < child_of(other);
      });
    }
    return visitNode(min, depth, candidates, [&](unsigned child) {
      const OctreeBrick* begin = first;
      first = std::upper_bound(first, last, child, [&](unsigned wanted, const OctreeBrick& other) {
        return wanted < child_of(other);
      });
      return visitBricks(begin, first, depth + 1);
    });
  }

  NodeState visitBrick(const OctreeBrick& brick) {
    brick_ = brickAt(brick.order);
    fillVoxels(*brick.voxels, kind_, voxels_);
    return visitVoxels(0, kBrickDepth);
  }

  /// A node inside a brick that has a known voxel.
  /// @param place  Place of its first voxel, in the order of an octree.
  NodeState visitVoxels(std::uint32_t place, int depth) {
    const Cell min = cellAt(place);
    if (depth == kOctreeDepth) return makeLeaf(min, depth, voxels_.log_odds[place]);
    const std::uint32_t step = 1U << (3 * (kOctreeDepth - depth - 1));
    unsigned candidates = 0;
    bool is_full = true;
    for (unsigned child = 0; child < 8; ++child) {
      const std::uint64_t known = voxels_.knownFrom(place + child * step, step);
      if (known != 0) candidates |= 1U << child;
      is_full &= known == (step == 64 ? ~0ULL : (1ULL << step) - 1);
    }
    // Checked before any node is written.
    if (is_full && isUniform(place, 8 * step)) {
      return makeLeaf(min, depth, voxels_.log_odds[place]);
    }
    return visitNode(min, depth, candidates,
                     [&](unsigned child) { return visitVoxels(place + child * step, depth + 1); });
  }

  /// Whether all `count` voxels from a place are known and have one value.
  [[nodiscard]] bool isUniform(std::uint32_t place, std::uint32_t count) const {
    const float* first = &voxels_.log_odds[place];
    return std::all_of(first, first + count, [first](float value) { return value == *first; });
  }

  [[nodiscard]] Cell cellAt(std::uint32_t place) const {
    const auto gather = [](std::uint32_t bits) {
      return static_cast<std::int32_t>((bits & 1U) | (bits >> 2 & 2U) | (bits >> 4 & 4U));
    };
    return brick_ + Cell{gather(place), gather(place >> 1), gather(place >> 2)};
  }

  OctreeKind kind_;
  SinkT sink_;
  OctreeBricks sorted_;
  Cell brick_;
  OctreeVoxels voxels_;
};

}  // namespace

OctreeStream toOctreeStream(const std::vector<VoxelBrick>& bricks, OctreeKind kind) {
  OctreeStream stream;
  // Near the usual size, so that it is seldom moved.
  if (kind == OctreeKind::kFull) stream.bytes.resize(512 * bricks.size());
  const auto run = [&](auto sink) {
    OctreeWalk<decltype(sink)> walk(bricks, kind, sink);
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

std::vector<OctreeLeaf> computeOctreeLeaves(const std::vector<VoxelBrick>& bricks, OctreeKind kind,
                                            CuboidFilter classes) {
  std::vector<OctreeLeaf> leaves;
  OctreeWalk<LeafSink>(bricks, kind, LeafSink(leaves, classes)).run();
  return leaves;
}

}  // namespace cuboid_mapping
