// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/rtree.h"

#include "cuboid_mapping/rtree/traversal.h"
#include "support/cuboid_set.h"
#include "support/random_shapes.h"
#include "support/tree_invariants.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace cuboid_mapping {
namespace {

const std::vector<std::string> kNoViolations;

/// A rectangle of the x-y plane, one voxel high, as the paper draws them.
Cuboid rectangle(int min_x, int min_y, int max_x, int max_y) {
  return {{{min_x, min_y, 0}, {max_x, max_y, 1}}, Occupancy::kFree};
}

/// The cuboids of a node's leaf child, sorted.
std::vector<Cuboid> cuboidsOfLeaf(const RTree& tree, NodeIndex leaf) {
  std::vector<Cuboid> cuboids;
  const Node& node = tree.node(0, leaf);
  for (int slot = 0; slot < node.count(); ++slot) cuboids.push_back(node.cuboid(slot));
  return test::sorted(std::move(cuboids));
}

/// Cubes of one voxel along a diagonal, with a gap.
std::vector<Cuboid> diagonal(int count) {
  std::vector<Cuboid> cuboids;
  for (int i = 0; i < count; ++i) {
    cuboids.push_back({CellBox::ofCell({2 * i, 2 * i, 2 * i}), Occupancy::kFree});
  }
  return cuboids;
}

/// Removes and adds cuboids in one part.
void replace(RTree& tree, std::vector<LeafSlot> removed, std::vector<Cuboid> added) {
  TreeChange change{std::move(removed), std::move(added), {}};
  change.endPart();
  tree.replace(change);
}

TEST(RTreeEmpty, holdsNothingInOneLeaf) {
  const RTree tree;
  EXPECT_EQ(tree.size(), 0U);
  EXPECT_TRUE(tree.isEmpty());
  EXPECT_EQ(tree.height(), 1);
  EXPECT_EQ(tree.numLeafNodes(), 1U);
  EXPECT_EQ(tree.numInnerNodes(), 0U);
  EXPECT_FALSE(tree.bounds().has_value());
  EXPECT_EQ(checkTree(tree), kNoViolations);
  EXPECT_TRUE(test::allCuboids(tree).empty());
}

TEST(RTreeEmpty, givesNothingToAnySearch) {
  const RTree tree;
  const auto fail = [](const Cuboid&) {
    ADD_FAILURE();
    return Visit::kContinue;
  };
  visitBox(tree, {{-9, -9, -9}, {9, 9, 9}}, CuboidFilter::kAll, fail);
  visitCell(tree, {0, 0, 0}, fail);
  visitNearest(tree, {0.0, 0.0, 0.0}, 100.0, CuboidFilter::kAll,
               [&](const Cuboid& cuboid, double) { return fail(cuboid); });
  Selection selection;
  tree.select({{-9, -9, -9}, {9, 9, 9}}, selection);
  EXPECT_TRUE(selection.cuboids.empty());
}

TEST(RTreeEmpty, canBeChangedByNothing) {
  RTree tree;
  EXPECT_FALSE(tree.remove(CellBox::ofCell({0, 0, 0})));
  tree.replace({});
  replace(tree, {}, {});
  tree.clear();
  EXPECT_TRUE(tree.isEmpty());
  EXPECT_EQ(checkTree(tree), kNoViolations);
}

TEST(RTreeGrowth, isThatOfThePapersFigure2) {
  const Cuboid a = rectangle(0, 0, 2, 2);
  const Cuboid b = rectangle(3, 1, 5, 3);
  const Cuboid c = rectangle(20, 0, 22, 2);
  const Cuboid d = rectangle(23, 1, 25, 3);
  RTree tree(RTreeConfig{2, 1});
  tree.insert(a);
  tree.insert(b);
  EXPECT_EQ(tree.height(), 1) << "A and B are in a single node";
  tree.insert(c);
  EXPECT_EQ(tree.height(), 2) << "C splits it";
  tree.insert(d);
  ASSERT_EQ(tree.height(), 2) << "D goes to C";
  const Node& root = tree.node(1, tree.root());
  ASSERT_EQ(root.count(), 2);
  const int first = root.box(0).min.x == 0 ? 0 : 1;
  EXPECT_EQ(root.box(first), (CellBox{{0, 0, 0}, {5, 3, 1}})) << "E";
  EXPECT_EQ(root.box(1 - first), (CellBox{{20, 0, 0}, {25, 3, 1}})) << "F";
  EXPECT_EQ(cuboidsOfLeaf(tree, root.child()[first]), test::sorted({a, b}));
  EXPECT_EQ(cuboidsOfLeaf(tree, root.child()[1 - first]), test::sorted({c, d}));
  EXPECT_EQ(checkTree(tree), kNoViolations);
}

TEST(RTreeGrowth, needsOneNodeForThatFigureWithFourBranches) {
  RTree tree(RTreeConfig{4, 2});
  for (const int x : {0, 3, 20, 23}) tree.insert(rectangle(x, 0, x + 2, 2));
  EXPECT_EQ(tree.height(), 1);
  EXPECT_EQ(tree.numLeafNodes(), 1U);
  EXPECT_EQ(tree.numInnerNodes(), 0U);
}

TEST(RTreeGrowth, splitsANodeWhenItHasMoreThanMBranches) {
  for (const RTreeConfig& order : {RTreeConfig{2, 1}, RTreeConfig{4, 2}, RTreeConfig{32, 12}}) {
    RTree tree(order);
    const std::vector<Cuboid> cuboids = diagonal(order.max_branches + 1);
    for (int i = 0; i < order.max_branches; ++i) tree.insert(cuboids[static_cast<std::size_t>(i)]);
    EXPECT_EQ(tree.height(), 1) << "M = " << order.max_branches;
    tree.insert(cuboids.back());
    EXPECT_EQ(tree.height(), 2) << "M = " << order.max_branches;
    EXPECT_EQ(tree.numLeafNodes(), 2U);
    EXPECT_EQ(tree.numInnerNodes(), 1U);
    EXPECT_EQ(checkTree(tree), kNoViolations);
    EXPECT_EQ(test::allCuboids(tree), test::sorted(cuboids));
  }
}

TEST(RTreeGrowth, staysAsLowAsItsOrderDemands) {
  const RTreeConfig order{8, 3};
  RTree tree(order);
  for (const Cuboid& cuboid : diagonal(2000)) tree.insert(cuboid);
  // Every node but the root has d branches or more.
  EXPECT_LE(tree.height(), 1 + static_cast<int>(std::log(2000.0 / 2.0) / std::log(3.0)));
  EXPECT_GE(tree.height(), static_cast<int>(std::ceil(std::log(2000.0) / std::log(8.0))));
  EXPECT_EQ(checkTree(tree), kNoViolations);
}

TEST(RTreeInsert, goesToTheLeafThatExpandsLeast) {
  RTree tree(RTreeConfig{4, 2});
  for (const int x : {0, 4, 100, 104, 108}) tree.insert(rectangle(x, 0, x + 2, 2));
  ASSERT_EQ(tree.height(), 2);
  const Cuboid near_first = rectangle(20, 0, 22, 2);
  tree.insert(near_first);
  const Node& root = tree.node(1, tree.root());
  const int first = root.box(0).min.x == 0 ? 0 : 1;
  EXPECT_EQ(root.box(first), (CellBox{{0, 0, 0}, {22, 2, 1}}));
  EXPECT_EQ(root.box(1 - first), (CellBox{{100, 0, 0}, {110, 2, 1}}));
}

TEST(RTreeInsert, goesToTheSmallerOfTwoLeavesThatNeedNotExpand) {
  // A large cuboid, a far one, and small ones in the large one. See the comments for the leaves.
  const Cuboid large = rectangle(0, 0, 100, 100);
  RTree tree(RTreeConfig{3, 1});
  for (const Cuboid& cuboid : {large, rectangle(500, 500, 510, 510), rectangle(50, 50, 51, 51),
                               rectangle(52, 52, 53, 53)}) {
    tree.insert(cuboid);  // {large, 50, 52} {500}
  }
  tree.insert(rectangle(54, 54, 55, 55));  // The first leaf is split: one half has the large one.
  ASSERT_EQ(tree.height(), 2);
  const Node& root = tree.node(1, tree.root());
  ASSERT_EQ(root.count(), 3);
  for (int slot = 0; slot < root.count(); ++slot) {
    const std::vector<Cuboid> cuboids = cuboidsOfLeaf(tree, root.child()[slot]);
    if (!large.box.contains(root.box(slot)) || root.box(slot) == large.box) continue;
    ASSERT_LT(cuboids.size(), 3U) << "there is a free place";
    tree.insert(cuboids.front());
    EXPECT_EQ(cuboidsOfLeaf(tree, root.child()[slot]).size(), cuboids.size() + 1);
    return;
  }
  ADD_FAILURE() << "no leaf inside the box of another";
}

TEST(RTreeRemove, findsExactlyTheBox) {
  RTree tree;
  tree.insert(rectangle(0, 0, 4, 4));
  EXPECT_FALSE(tree.remove({{0, 0, 0}, {4, 4, 2}})) << "larger";
  EXPECT_FALSE(tree.remove({{0, 0, 0}, {4, 3, 1}})) << "smaller";
  EXPECT_FALSE(tree.remove({{8, 8, 0}, {9, 9, 1}})) << "elsewhere";
  EXPECT_EQ(tree.size(), 1U);
  EXPECT_TRUE(tree.remove({{0, 0, 0}, {4, 4, 1}}));
  EXPECT_TRUE(tree.isEmpty());
  EXPECT_FALSE(tree.remove({{0, 0, 0}, {4, 4, 1}})) << "gone";
}

TEST(RTreeRemove, removesOneOfEqualBoxesAtATime) {
  RTree tree(RTreeConfig{4, 2});
  for (int i = 0; i < 20; ++i) tree.insert(rectangle(0, 0, 4, 4));
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(tree.size(), static_cast<std::size_t>(20 - i));
    EXPECT_TRUE(tree.remove(rectangle(0, 0, 4, 4).box));
    EXPECT_EQ(checkTree(tree), kNoViolations);
  }
  EXPECT_FALSE(tree.remove(rectangle(0, 0, 4, 4).box));
}

TEST(RTreeRemove, shrinksTheRootUntilOneLeafIsLeft) {
  for (const RTreeConfig& order : {RTreeConfig{2, 1}, RTreeConfig{4, 2}, RTreeConfig{8, 3}}) {
    RTree tree(order);
    const std::vector<Cuboid> cuboids = diagonal(200);
    for (const Cuboid& cuboid : cuboids) tree.insert(cuboid);
    EXPECT_GE(tree.height(), 3);
    for (std::size_t i = 0; i < cuboids.size(); ++i) {
      ASSERT_TRUE(tree.remove(cuboids[i].box));
      ASSERT_EQ(checkTree(tree), kNoViolations) << i;
      if (i + 1 == cuboids.size()) break;
      const int next = 2 * static_cast<int>(i + 1);
      ASSERT_EQ(tree.bounds()->min, (Cell{next, next, next})) << "the bounds have not shrunk";
    }
    EXPECT_EQ(tree.height(), 1);
    EXPECT_EQ(tree.numLeafNodes(), 1U);
    EXPECT_EQ(tree.numInnerNodes(), 0U);
  }
}

TEST(RTreeClass, isOccupiedAboveAnOccupiedCuboidOnly) {
  RTree tree(RTreeConfig{4, 2});
  for (const Cuboid& cuboid : diagonal(50)) tree.insert(cuboid);
  const Cuboid occupied{CellBox::ofCell({7, 7, 7}), Occupancy::kOccupied};
  const auto hasOccupied = [&tree] {
    return tree.node(tree.height() - 1, tree.root()).summary().has_occupied;
  };
  EXPECT_FALSE(hasOccupied());
  tree.insert(occupied);
  EXPECT_TRUE(hasOccupied());
  EXPECT_EQ(test::allCuboids(tree, CuboidFilter::kOccupied), std::vector<Cuboid>{occupied});
  tree.remove(occupied.box);
  EXPECT_FALSE(hasOccupied());
  EXPECT_TRUE(test::allCuboids(tree, CuboidFilter::kOccupied).empty());
}

/// All places of a tree.
Selection selectAll(const RTree& tree) {
  Selection selection;
  if (tree.bounds()) tree.select(*tree.bounds(), selection);
  return selection;
}

TEST(RTreeReplace, appendsToASelection) {
  RTree tree;
  tree.insert(rectangle(0, 0, 1, 1));
  Selection selection = selectAll(tree);
  tree.select({{0, 0, 0}, {1, 1, 1}}, selection);
  EXPECT_EQ(selection.cuboids.size(), 2U);
  selection.clear();
  EXPECT_TRUE(selection.cuboids.empty() && selection.slots.empty());
}

TEST(RTreeReplace, changesClassesInTheirPlaces) {
  RTree tree(RTreeConfig{4, 2});
  for (const Cuboid& cuboid : diagonal(100)) tree.insert(cuboid);
  const std::size_t num_leaves = tree.numLeafNodes();
  const Selection selection = selectAll(tree);
  std::vector<Cuboid> added = selection.cuboids;
  for (Cuboid& cuboid : added) cuboid.occupancy = Occupancy::kOccupied;
  replace(tree, selection.slots, added);
  EXPECT_EQ(test::allCuboids(tree), test::sorted(added));
  EXPECT_EQ(tree.numLeafNodes(), num_leaves);
  EXPECT_EQ(checkTree(tree), kNoViolations);
}

TEST(RTreeReplace, leavesAnEmptyTreeWhenItRemovesAll) {
  RTree tree(RTreeConfig{4, 2});
  for (const Cuboid& cuboid : diagonal(300)) tree.insert(cuboid);
  replace(tree, selectAll(tree).slots, {});
  EXPECT_TRUE(tree.isEmpty());
  EXPECT_EQ(tree.height(), 1);
  EXPECT_EQ(checkTree(tree), kNoViolations);
}

TEST(RTreeReplace, fillsAnEmptyTreeInOneGo) {
  for (const int count : {1, 31, 32, 33, 48, 1000, 5000}) {
    RTree tree;
    replace(tree, {}, diagonal(count));
    EXPECT_EQ(checkTree(tree), kNoViolations) << count;
    EXPECT_EQ(test::allCuboids(tree), test::sorted(diagonal(count))) << count;
  }
}

TEST(RTreeReplace, fillsNewLeavesInTheOrderOfTheParts) {
  const std::vector<Cuboid> cuboids = diagonal(1000);
  RTree tree(RTreeConfig{8, 3});
  TreeChange change;
  for (std::size_t i = 0; i < cuboids.size(); ++i) {
    change.added.push_back(cuboids[i]);
    if (i % 3 == 2) change.endPart();
  }
  change.endPart();
  tree.replace(change);
  EXPECT_EQ(checkTree(tree), kNoViolations);
  EXPECT_EQ(test::allCuboids(tree), test::sorted(cuboids));
  EXPECT_LE(tree.numLeafNodes(), 1000U / 7 + 1) << "they are not full";
  visitLeafSlots(tree, *tree.bounds(), CuboidFilter::kAll, [&](NodeIndex leaf, int /*slot*/) {
    const CellBox box = tree.node(0, leaf).summary().box;
    EXPECT_EQ(box.size().x, 2 * tree.node(0, leaf).count() - 1) << "there is one of others between";
    return Visit::kContinue;
  });
}

TEST(RTreeReplace, givesThePlacesOfAPartToCuboidsOfThatPart) {
  RTree tree(RTreeConfig{4, 2});
  const Cuboid old_left = rectangle(0, 0, 1, 1);
  const Cuboid old_right = rectangle(1000, 0, 1001, 1);
  for (const Cuboid& cuboid : {old_left, rectangle(2, 0, 3, 1), rectangle(4, 0, 5, 1), old_right,
                               rectangle(1002, 0, 1003, 1), rectangle(1004, 0, 1005, 1)}) {
    tree.insert(cuboid);
  }
  ASSERT_EQ(tree.height(), 2);
  const Cuboid left = rectangle(0, 0, 1, 2);
  const Cuboid right = rectangle(1000, 0, 1001, 2);
  const auto changeOf = [&tree](const Cuboid& before, const Cuboid& after) {
    Selection selection;
    tree.select(before.box, selection);
    TreeChange change{selection.slots, {after}, {}};
    change.endPart();
    return change;
  };
  TreeChange change = changeOf(old_right, right);
  change.append(changeOf(old_left, left));
  tree.replace(change);
  EXPECT_EQ(checkTree(tree), kNoViolations);
  const Node& root = tree.node(1, tree.root());
  ASSERT_EQ(root.count(), 2);
  for (int slot = 0; slot < root.count(); ++slot) {
    EXPECT_EQ(root.box(slot).size(), (Cell{5, 2, 1})) << "a cuboid went to the other side";
  }
}

TEST(RTreeClear, leavesATreeThatCanBeFilledAgain) {
  RTree tree(RTreeConfig{4, 2});
  for (int round = 0; round < 3; ++round) {
    for (const Cuboid& cuboid : diagonal(100)) tree.insert(cuboid);
    EXPECT_EQ(tree.size(), 100U);
    EXPECT_EQ(checkTree(tree), kNoViolations);
    tree.clear();
    EXPECT_TRUE(tree.isEmpty());
    EXPECT_EQ(tree.height(), 1);
    EXPECT_FALSE(tree.bounds().has_value());
    EXPECT_EQ(checkTree(tree), kNoViolations);
  }
}

TEST(RTreeMemory, isUsedAgainAfterRemovals) {
  RTree tree(RTreeConfig{8, 3});
  std::size_t bytes_after_two = 0;
  for (int round = 0; round < 20; ++round) {
    replace(tree, {}, diagonal(500));
    replace(tree, selectAll(tree).slots, {});
    for (const Cuboid& cuboid : diagonal(500)) tree.insert(cuboid);
    for (const Cuboid& cuboid : diagonal(500)) ASSERT_TRUE(tree.remove(cuboid.box));
    if (round == 1) bytes_after_two = tree.numBytes();
  }
  EXPECT_GT(bytes_after_two, 0U);
  EXPECT_EQ(tree.numBytes(), bytes_after_two);
}

}  // namespace
}  // namespace cuboid_mapping
