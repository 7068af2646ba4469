// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/rtree/node_pool.h"

#include <optional>
#include <vector>

namespace cuboid_mapping {

/// Order (d, M) of an R-tree: bounds of the number of branches of a node (paper, Section III).
struct RTreeConfig {
  /// Greatest M: a set of slots is one word.
  static constexpr int kMaxBranchesLimit = kMaxSlots;

  int max_branches = 32;  ///< M: 2 to kMaxBranchesLimit.
  int min_branches = 12;  ///< d: 1 to M / 2. The root may have fewer.
};

/// Place of a cuboid in the tree; valid until the tree changes.
struct LeafSlot {
  NodeIndex leaf;  ///< At level 0, see RTree::node().
  int slot;        ///< Of the branch in that leaf.
};

/// Cuboids found by a window query, with their places.
struct Selection {
  std::vector<Cuboid> cuboids;  ///< In no particular order.
  std::vector<LeafSlot> slots;  ///< One for each of `cuboids`.

  /// Empties both lists, keeps their memory.
  void clear() {
    cuboids.clear();
    slots.clear();
  }
};

/// What is to change in a tree, part by part. A part is a brick, or something as compact; parts lie
/// along the Morton curve.
struct TreeChange {
  std::vector<LeafSlot> removed;  ///< From RTree::select, each once, with no change of it since.
  std::vector<Cuboid> added;      ///< None is empty.
  /// Where a part ends in both lists; it begins where the one before ends.
  struct Part {
    std::size_t removed_end;  ///< One beyond its last in `removed`.
    std::size_t added_end;    ///< One beyond its last in `added`.
  };
  std::vector<Part> parts;  ///< The last ends where both lists do.

  /// What was added to the lists since the last part becomes a part.
  void endPart() { parts.push_back({removed.size(), added.size()}); }

  /// Adds the parts of another change behind those here.
  void append(const TreeChange& other) {
    for (const Part& part : other.parts) {
      parts.push_back({removed.size() + part.removed_end, added.size() + part.added_end});
    }
    removed.insert(removed.end(), other.removed.begin(), other.removed.end());
    added.insert(added.end(), other.added.begin(), other.added.end());
  }
};

/// R-tree of cuboids (A. Guttman, "R-trees", 1984; paper, Section III): height balanced, insertion
/// by least expansion, quadratic split, removal with condensing and re-insertion.
///
/// Any cuboids can be held, overlapping ones, too; none may be empty. Searches are in traversal.h,
/// invariants in invariants.h. Const functions may run side by side; a change needs exclusive
/// access.
class RTree {
 public:
  /// @pre 2 <= max_branches <= 64 and 1 <= min_branches <= max_branches / 2.
  explicit RTree(const RTreeConfig& config = {});

  /// Inserts one cuboid through the root. @complexity O(M log n), a split O(M^2).
  void insert(const Cuboid& cuboid);

  /// Removes one cuboid with exactly this box. @return false when there is none.
  bool remove(const CellBox& box);

  /// Finds the cuboids that share a cell with the window, appended to `selection`.
  void select(const CellBox& window, Selection& selection) const;

  /// Removes cuboids and adds others in one go.
  ///
  /// Added cuboids take the places of removed ones of the same part, then free places in the leaf
  /// of these, which shares with a sibling or is divided when it gets too full; those of parts that
  /// lost nothing form whole new leaves in the order of the parts. The tree is condensed once; then
  /// new leaves and what is left are inserted.
  /// @throws std::bad_alloc  Then only clear() may be called.
  void replace(const TreeChange& change);

  /// Removes all cuboids.
  void clear() noexcept;

  /// Number of cuboids.
  [[nodiscard]] std::size_t size() const { return size_; }
  /// Whether there is no cuboid; there is a root nevertheless.
  [[nodiscard]] bool isEmpty() const { return size_ == 0; }
  /// Levels, at least 1; the root is at level height() - 1, leaves at level 0.
  [[nodiscard]] int height() const { return height_; }
  /// Minimum bounding box of all cuboids; nothing when there are none.
  [[nodiscard]] std::optional<CellBox> bounds() const;
  /// As given to the constructor.
  [[nodiscard]] const RTreeConfig& config() const { return config_; }

  /// At level height() - 1; a leaf while height() is 1.
  [[nodiscard]] NodeIndex root() const { return root_; }
  /// A node; leaves and inner nodes have indices of their own.
  /// @param level  0 for leaves, up to height() - 1.
  [[nodiscard]] const Node& node(int level, NodeIndex index) const {
    return level == 0 ? leaves_[index] : inner_nodes_[index];
  }

  /// Asks the processor to fetch the children in these slots of a node of this level, > 0.
  [[gnu::always_inline]] void prefetchChildren(int level, const Node& node, SlotSet slots) const {
    const NodePool& pool = level == 1 ? leaves_ : inner_nodes_;
    for (; slots != 0; slots = withoutFirst(slots)) pool.prefetch(node.child()[firstSlot(slots)]);
  }

  /// Leaves, the root included while it is one.
  [[nodiscard]] std::size_t numLeafNodes() const { return leaves_.numNodes(); }
  /// Leaves that extend over more than 255 voxels along an axis, and need more memory for it.
  [[nodiscard]] std::size_t numWideLeaves() const { return leaves_.numWideLeaves(); }
  /// Nodes above the leaves; 0 while the root is a leaf.
  [[nodiscard]] std::size_t numInnerNodes() const { return inner_nodes_.numNodes(); }
  /// Bytes held from the allocator for the nodes.
  [[nodiscard]] std::size_t numBytes() const {
    return leaves_.numBytes() + inner_nodes_.numBytes();
  }

 private:
  /// Nodes and cuboids that wait to be inserted.
  struct Orphans {
    /// A node with all that is below it.
    struct Subtree {
      NodeIndex index;  ///< Of the node.
      int level;        ///< Of the node, 0 for a leaf.
    };
    std::vector<Subtree> subtrees;
    std::vector<Branch> cuboids;
  };
  struct ReplacePlan;

  NodePool& poolOf(int level) { return level == 0 ? leaves_ : inner_nodes_; }
  /// Puts a branch after the last one of a node; tells a child whose it is now.
  void append(NodeIndex index, int level, const Branch& branch);
  [[nodiscard]] NodeIndex chooseNode(const CellBox& box, int target_level) const;
  void insertBranch(const Branch& branch, int level);
  void addBranch(NodeIndex index, int level, const Branch& branch);
  void splitNode(NodeIndex index, int level, const Branch& extra);
  void growRoot(const Branch& first, const Branch& second);
  void growAncestors(NodeIndex index, int level, const Branch& grown);
  void fillNode(NodeIndex index, int level, const std::vector<Branch>& branches);
  [[nodiscard]] static ReplacePlan planReplace(const TreeChange& change);
  void refill(ReplacePlan& plan, std::vector<NodeIndex>& touched, Orphans& orphans);
  /// Sibling that can share the branches of a leaf that gets too full; kNoNode when there is none.
  [[nodiscard]] NodeIndex findSharingSibling(NodeIndex leaf, int num_wanted) const;
  [[nodiscard]] std::size_t numLeavesFor(std::size_t num_branches) const;
  void fillNewLeaves(const std::vector<Branch>& branches, Orphans& orphans);
  void packLeaves(std::vector<Branch> branches, const std::vector<NodeIndex>& reused,
                  Orphans& orphans);
  void fillLeaves(const std::vector<Branch>& branches, const std::vector<std::size_t>& ends,
                  const std::vector<NodeIndex>& reused, Orphans& orphans);
  void condense(std::vector<NodeIndex> touched, Orphans& orphans);
  void updateOrDetach(NodeIndex index, int level, std::vector<NodeIndex>& parents,
                      Orphans& orphans);
  void shrinkRoot();
  void reinsert(const Orphans& orphans);
  void dissolve(NodeIndex index, int level);

  RTreeConfig config_;
  NodePool leaves_;
  NodePool inner_nodes_;
  NodeIndex root_;
  int height_ = 1;
  std::size_t size_ = 0;
};

}  // namespace cuboid_mapping
