// SPDX-License-Identifier: BSD-3-Clause
#include "support/tree_invariants.h"

#include "evaluation/rtree.h"

#include <sstream>

namespace cuboid_mapping {
namespace {

std::string describe(const char* text, int level, NodeIndex index) {
  std::ostringstream out;
  out << text << " (level " << level << ", node " << index << ")";
  return out.str();
}

/// Walks inner nodes and collects violations.
class NodeChecker {
 public:
  NodeChecker(const InnerTree& tree, const std::function<Branch(NodeIndex)>& leaf_summary)
      : tree_(tree), leaf_summary_(leaf_summary) {}

  std::vector<std::string> check() {
    if (tree_.height() == 1) {
      checkBranch(tree_.onlyLeaf(), leaf_summary_(tree_.root()), 0, tree_.root());
      expect(tree_.parentOf(tree_.root()) == kNoNode, "root with a parent", 0, tree_.root());
    }
    if (tree_.height() > 1) checkNode(tree_.root(), tree_.height() - 1);
    expect(num_nodes_ == tree_.size(), "inner nodes are lost", 0, 0);
    return std::move(violations_);
  }

 private:
  void expect(bool holds, const char* text, int level, NodeIndex index) {
    if (!holds) violations_.push_back(describe(text, level, index));
  }

  void checkNode(NodeIndex index, int level) {
    const Node& node = tree_.node(index);
    const bool is_root = level == tree_.height() - 1;
    const int fewest = is_root ? 2 : tree_.config().min_branches;
    expect(node.count() >= fewest, "too few branches", level, index);
    expect(node.count() <= tree_.config().max_branches, "too many branches", level, index);
    ++num_nodes_;
    for (int slot = 0; slot < node.count(); ++slot) checkChild(node.branch(slot), level, index);
  }

  void checkChild(const Branch& branch, int level, NodeIndex index) {
    expect(!branch.box.isEmpty(), "empty box", level, index);
    if (level == 1) {
      expect(tree_.parentOf(branch.child) == index, "child with another parent", level, index);
      checkBranch(branch, leaf_summary_(branch.child), level, index);
      return;
    }
    const Node& child = tree_.node(branch.child);
    expect(child.parent == index, "child with another parent", level, index);
    expect(child.count() > 0, "child without branches", level, index);
    if (child.count() == 0) return;
    checkBranch(branch, child.summary(), level, index);
    checkNode(branch.child, level - 1);
  }

  void checkBranch(const Branch& branch, const Branch& summary, int level, NodeIndex index) {
    expect(branch.box == summary.box, "box is not the minimum bounding box", level, index);
    expect(branch.has_occupied == summary.has_occupied, "occupied cuboids are told wrongly", level,
           index);
  }

  const InnerTree& tree_;
  const std::function<Branch(NodeIndex)>& leaf_summary_;
  std::size_t num_nodes_ = 0;
  std::vector<std::string> violations_;
};

}  // namespace

std::vector<std::string> checkNodes(const InnerTree& tree,
                                    const std::function<Branch(NodeIndex)>& leaf_summary) {
  return NodeChecker(tree, leaf_summary).check();
}

std::vector<std::string> checkTree(const bench::RTree& tree) {
  const InnerTree& inner = tree.inner();
  std::vector<std::string> violations =
      checkNodes(inner, [&tree](NodeIndex leaf) { return tree.leaf(leaf).summary(); });
  std::size_t num_cuboids = 0;
  std::size_t num_leaves = 0;
  visitLeaves(
      inner, kEverywhere, CuboidFilter::kAll, [](NodeIndex, int) {},
      [&](NodeIndex index) {
        const int count = tree.leaf(index).count();
        const int fewest = inner.height() == 1 ? 1 : inner.config().min_branches;
        if (count < fewest) violations.push_back(describe("too few cuboids", 0, index));
        num_cuboids += static_cast<std::size_t>(count);
        ++num_leaves;
        return Visit::kContinue;
      });
  if (num_cuboids != tree.size()) violations.emplace_back("size() is not the number of cuboids");
  if (num_leaves != tree.numLeafNodes()) violations.emplace_back("leaf nodes are lost");
  return violations;
}

std::vector<std::string> checkDisjoint(const bench::RTree& tree) {
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
