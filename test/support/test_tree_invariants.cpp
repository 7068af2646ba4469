// SPDX-License-Identifier: BSD-3-Clause
// The checker finds every kind of damage: a checker that finds nothing would pass all other tests.
#include "support/tree_invariants.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace cuboid_mapping {
namespace {

/// A tree of three levels that a test may damage.
class CheckTree : public testing::Test {
 protected:
  CheckTree() : tree_(RTreeConfig{4, 2}) {
    for (int i = 0; i < 30; ++i)
      tree_.insert({CellBox::ofCell({3 * i, i % 5, 0}), Occupancy::kFree});
  }

  void SetUp() override {
    ASSERT_EQ(tree_.height(), 3);
    ASSERT_TRUE(checkTree(tree_).empty());
  }

  Node& node(NodeIndex index) { return const_cast<Node&>(tree_.inner().node(index)); }
  Node& root() { return node(tree_.inner().root()); }
  /// A node one level below the root, above leaf nodes.
  Node& child() { return node(root().child()[0]); }
  /// A leaf node.
  Node& leaf() { return const_cast<Node&>(tree_.leaf(child().child()[0])); }

  /// Whether one of the violations has this text.
  [[nodiscard]] bool reports(const std::string& text) const {
    for (const std::string& violation : checkTree(tree_)) {
      if (violation.find(text) != std::string::npos) return true;
    }
    return false;
  }

  bench::RTree tree_;
};

TEST_F(CheckTree, seesABoxThatIsTooLarge) {
  Branch branch = root().branch(0);
  branch.box.max.z += 1;
  root().set(0, branch);
  EXPECT_TRUE(reports("minimum bounding box"));
}

TEST_F(CheckTree, seesABoxThatIsTooSmall) {
  Branch branch = child().branch(0);
  branch.box.min.x += 1;
  child().set(0, branch);
  EXPECT_TRUE(reports("minimum bounding box"));
}

TEST_F(CheckTree, seesABranchThatClaimsSomethingOccupied) {
  Branch branch = child().branch(0);
  branch.has_occupied = true;
  child().set(0, branch);
  EXPECT_TRUE(reports("occupied cuboids are told wrongly"));
}

TEST_F(CheckTree, seesABranchThatHidesSomethingOccupied) {
  Branch branch = leaf().branch(0);
  branch.has_occupied = true;
  leaf().set(0, branch);
  EXPECT_TRUE(reports("occupied cuboids are told wrongly"));
}

TEST_F(CheckTree, seesAWrongParent) {
  child().parent = kNoNode;
  EXPECT_TRUE(reports("parent"));
}

TEST_F(CheckTree, seesANodeWithTooFewBranches) {
  while (child().count() > 1) child().remove(1);
  EXPECT_TRUE(reports("too few branches"));
  EXPECT_TRUE(reports("number of cuboids"));
}

TEST_F(CheckTree, seesALeafNodeWithTooFewCuboids) {
  while (leaf().count() > 1) leaf().remove(0);
  EXPECT_TRUE(reports("too few cuboids"));
  EXPECT_TRUE(reports("number of cuboids"));
}

TEST_F(CheckTree, seesANodeWithoutBranches) {
  child().clear();
  EXPECT_TRUE(reports("without branches"));
}

TEST_F(CheckTree, seesARootWithOneBranch) {
  while (root().count() > 1) root().remove(1);
  EXPECT_TRUE(reports("too few branches"));
  EXPECT_TRUE(reports("nodes are lost"));
}

TEST_F(CheckTree, seesAnEmptyBox) {
  Branch branch = child().branch(0);
  branch.box.max.y = branch.box.min.y;
  child().set(0, branch);
  EXPECT_TRUE(reports("empty box"));
}

TEST(CheckTreeOfOneLeaf, seesABoxThatIsTooLarge) {
  bench::RTree tree(RTreeConfig{4, 2});
  for (const int x : {0, 5, 300}) tree.insert({CellBox::ofCell({x, 0, 0}), Occupancy::kFree});
  EXPECT_TRUE(checkTree(tree).empty());
  const_cast<Node&>(tree.leaf(tree.inner().root())).remove(2);
  const std::vector<std::string> violations = checkTree(tree);
  ASSERT_EQ(violations.size(), 2U);
  EXPECT_NE(violations[0].find("minimum bounding box"), std::string::npos);
  EXPECT_NE(violations[1].find("number of cuboids"), std::string::npos);
}

TEST(CheckDisjoint, seesTwoCuboidsThatShareACell) {
  bench::RTree tree;
  tree.insert({{{0, 0, 0}, {4, 4, 4}}, Occupancy::kOccupied});
  tree.insert({{{4, 0, 0}, {8, 4, 4}}, Occupancy::kOccupied});
  EXPECT_TRUE(checkDisjoint(tree).empty()) << "they have a face in common";
  tree.insert({{{3, 3, 3}, {4, 4, 4}}, Occupancy::kFree});
  EXPECT_FALSE(checkDisjoint(tree).empty());
}

TEST(CheckDisjoint, seesACuboidThatIsThereTwice) {
  bench::RTree tree;
  for (int i = 0; i < 2; ++i) tree.insert({{{0, 0, 0}, {4, 4, 4}}, Occupancy::kOccupied});
  EXPECT_FALSE(checkDisjoint(tree).empty());
}

}  // namespace
}  // namespace cuboid_mapping
