// SPDX-License-Identifier: BSD-3-Clause
#include "support/tree_invariants.h"

#include "cuboid_mapping/rtree/traversal.h"

#include <algorithm>
#include <cstdint>
#include <sstream>

namespace cuboid_mapping {
namespace {

/// Walks the tree and collects violations.
class TreeChecker {
 public:
  explicit TreeChecker(const RTree& tree) : tree_(tree) {}

  std::vector<std::string> check() {
    checkNode(tree_.root(), tree_.height() - 1);
    expect(num_cuboids_ == tree_.size(), "size() is not the number of cuboids", 0, 0);
    expect(num_leaves_ == tree_.numLeafNodes(), "leaf nodes are lost", 0, 0);
    expect(num_wide_leaves_ == tree_.numWideLeaves(), "boxes of wide leaves are lost", 0, 0);
    expect(num_inner_ == tree_.numInnerNodes(), "inner nodes are lost", 0, 0);
    return std::move(violations_);
  }

 private:
  void expect(bool holds, const char* text, int level, NodeIndex index) {
    if (holds) return;
    std::ostringstream out;
    out << text << " (level " << level << ", node " << index << ")";
    violations_.push_back(out.str());
  }

  void checkNode(NodeIndex index, int level) {
    const Node& node = tree_.node(level, index);
    const bool is_root = index == tree_.root() && level == tree_.height() - 1;
    const int fewest = is_root ? (level == 0 ? 0 : 2) : tree_.config().min_branches;
    expect(node.count() >= fewest, "too few branches", level, index);
    expect(node.count() <= tree_.config().max_branches, "too many branches", level, index);
    expect(node.isLeaf() == (level == 0), "leaf at a wrong level", level, index);
    ++(level == 0 ? num_leaves_ : num_inner_);
    for (int slot = 0; slot < node.count(); ++slot) {
      expect(!node.box(slot).isEmpty(), "empty box", level, index);
      if (level > 0) checkChild(node, slot, level, index);
    }
    if (level == 0) checkLeaf(node, index);
  }

  void checkLeaf(const Node& leaf, NodeIndex index) {
    num_cuboids_ += static_cast<std::size_t>(leaf.count());
    if (leaf.kind() != NodeKind::kWideLeaf) return;
    ++num_wide_leaves_;
    if (leaf.count() == 0) return;
    const CellBox box = leaf.summary().box;
    std::int64_t longest = 0;
    for (int axis = 0; axis < 3; ++axis) {
      longest = std::max(longest, std::int64_t{box.max[axis]} - box.min[axis]);
    }
    expect(longest > Node::kMaxOffset, "leaf is wide without need", 0, index);
  }

  void checkChild(const Node& node, int slot, int level, NodeIndex index) {
    const Branch branch = node.branch(slot);
    const Node& child = tree_.node(level - 1, branch.child);
    expect(child.parent == index, "child with another parent", level, index);
    expect(child.count() > 0, "child without branches", level, index);
    if (child.count() == 0) return;
    const Branch summary = child.summary();
    expect(branch.box == summary.box, "box is not the minimum bounding box", level, index);
    expect(branch.has_occupied == summary.has_occupied, "occupied cuboids are told wrongly", level,
           index);
    checkNode(branch.child, level - 1);
  }

  const RTree& tree_;
  std::size_t num_cuboids_ = 0;
  std::size_t num_leaves_ = 0;
  std::size_t num_wide_leaves_ = 0;
  std::size_t num_inner_ = 0;
  std::vector<std::string> violations_;
};

}  // namespace

std::vector<std::string> checkTree(const RTree& tree) { return TreeChecker(tree).check(); }

std::vector<std::string> checkDisjoint(const RTree& tree) {
  std::vector<std::string> violations;
  visitAll(tree, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
    int num_same = 0;
    visitBox(tree, cuboid.box, CuboidFilter::kAll, [&](const Cuboid& other) {
      num_same += other.box == cuboid.box ? 1 : 0;
      if (other.box != cuboid.box || num_same > 1) {
        std::ostringstream out;
        out << "cuboids overlap: " << cuboid.box << " and " << other.box;
        violations.push_back(out.str());
      }
      return Visit::kContinue;
    });
    return Visit::kContinue;
  });
  return violations;
}

}  // namespace cuboid_mapping
