// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/rtree.h"

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

/// A rectangle in the x-y plane, one voxel high, as in the paper's figures.
Cuboid rectangle(int min_x, int min_y, int max_x, int max_y) {
  return {{{min_x, min_y, 0}, {max_x, max_y, 1}}, Occupancy::kFree};
}

/// The cuboids of a node's leaf child, sorted.
std::vector<Cuboid> cuboidsOfLeaf(const bench::RTree& tree, NodeIndex leaf) {
  std::vector<Cuboid> cuboids;
  const Node& node = tree.leaf(leaf);
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

TEST(RTreeEmpty, hasNoNode) {
  const bench::RTree tree;
  EXPECT_EQ(tree.size(), 0U);
  EXPECT_TRUE(tree.isEmpty());
  EXPECT_EQ(tree.height(), 0);
  EXPECT_EQ(tree.numLeafNodes(), 0U);
  EXPECT_EQ(tree.inner().size(), 0U);
  EXPECT_FALSE(tree.bounds().has_value());
  EXPECT_EQ(checkTree(tree), kNoViolations);
  EXPECT_TRUE(test::allCuboids(tree).empty());
}

TEST(RTreeEmpty, givesNothingToAnySearch) {
  const bench::RTree tree;
  const auto fail = [](const Cuboid&) {
    ADD_FAILURE();
    return Visit::kContinue;
  };
  visitBox(tree, {{-9, -9, -9}, {9, 9, 9}}, CuboidFilter::kAll, fail);
  visitCell(tree, {0, 0, 0}, fail);
  visitNearest(tree, {0.0, 0.0, 0.0}, 100.0, CuboidFilter::kAll,
               [&](const Cuboid& cuboid, double) { return fail(cuboid); });
}

TEST(RTreeEmpty, canBeChangedByNothing) {
  bench::RTree tree;
  EXPECT_FALSE(tree.remove(CellBox::ofCell({0, 0, 0})));
  EXPECT_FALSE(tree.replace(CellBox::ofCell({0, 0, 0}), rectangle(0, 0, 1, 1)));
  tree.clear();
  EXPECT_TRUE(tree.isEmpty());
  EXPECT_EQ(checkTree(tree), kNoViolations);
}

TEST(RTreeGrowth, isThatOfThePapersFigure2) {
  const Cuboid a = rectangle(0, 0, 2, 2);
  const Cuboid b = rectangle(3, 1, 5, 3);
  const Cuboid c = rectangle(20, 0, 22, 2);
  const Cuboid d = rectangle(23, 1, 25, 3);
  bench::RTree tree(RTreeConfig{2, 1});
  tree.insert(a);
  tree.insert(b);
  EXPECT_EQ(tree.height(), 1) << "A and B are in a single node";
  tree.insert(c);
  EXPECT_EQ(tree.height(), 2) << "C splits it";
  tree.insert(d);
  ASSERT_EQ(tree.height(), 2) << "D goes to C";
  const Node& root = tree.inner().node(tree.inner().root());
  ASSERT_EQ(root.count(), 2);
  const int first = root.box(0).min.x == 0 ? 0 : 1;
  EXPECT_EQ(root.box(first), (CellBox{{0, 0, 0}, {5, 3, 1}})) << "E";
  EXPECT_EQ(root.box(1 - first), (CellBox{{20, 0, 0}, {25, 3, 1}})) << "F";
  EXPECT_EQ(cuboidsOfLeaf(tree, root.child()[first]), test::sorted({a, b}));
  EXPECT_EQ(cuboidsOfLeaf(tree, root.child()[1 - first]), test::sorted({c, d}));
  EXPECT_EQ(checkTree(tree), kNoViolations);
}

TEST(RTreeGrowth, needsOneNodeForThatFigureWithFourBranches) {
  bench::RTree tree(RTreeConfig{4, 2});
  for (const int x : {0, 3, 20, 23}) tree.insert(rectangle(x, 0, x + 2, 2));
  EXPECT_EQ(tree.height(), 1);
  EXPECT_EQ(tree.numLeafNodes(), 1U);
  EXPECT_EQ(tree.inner().size(), 0U);
}

TEST(RTreeGrowth, splitsANodeWhenItHasMoreThanMBranches) {
  for (const RTreeConfig& order : {RTreeConfig{2, 1}, RTreeConfig{4, 2}, RTreeConfig{32, 12}}) {
    bench::RTree tree(order);
    const std::vector<Cuboid> cuboids = diagonal(order.max_branches + 1);
    for (int i = 0; i < order.max_branches; ++i) tree.insert(cuboids[static_cast<std::size_t>(i)]);
    EXPECT_EQ(tree.height(), 1) << "M = " << order.max_branches;
    tree.insert(cuboids.back());
    EXPECT_EQ(tree.height(), 2) << "M = " << order.max_branches;
    EXPECT_EQ(tree.numLeafNodes(), 2U);
    EXPECT_EQ(tree.inner().size(), 1U);
    EXPECT_EQ(checkTree(tree), kNoViolations);
    EXPECT_EQ(test::allCuboids(tree), test::sorted(cuboids));
  }
}

TEST(RTreeGrowth, staysAsLowAsItsOrderDemands) {
  const RTreeConfig order{8, 3};
  bench::RTree tree(order);
  for (const Cuboid& cuboid : diagonal(2000)) tree.insert(cuboid);
  // Every node except the root has d branches or more.
  EXPECT_LE(tree.height(), 1 + static_cast<int>(std::log(2000.0 / 2.0) / std::log(3.0)));
  EXPECT_GE(tree.height(), static_cast<int>(std::ceil(std::log(2000.0) / std::log(8.0))));
  EXPECT_EQ(checkTree(tree), kNoViolations);
}

TEST(RTreeInsert, goesToTheLeafThatExpandsLeast) {
  bench::RTree tree(RTreeConfig{4, 2});
  for (const int x : {0, 4, 100, 104, 108}) tree.insert(rectangle(x, 0, x + 2, 2));
  ASSERT_EQ(tree.height(), 2);
  const Cuboid near_first = rectangle(20, 0, 22, 2);
  tree.insert(near_first);
  const Node& root = tree.inner().node(tree.inner().root());
  const int first = root.box(0).min.x == 0 ? 0 : 1;
  EXPECT_EQ(root.box(first), (CellBox{{0, 0, 0}, {22, 2, 1}}));
  EXPECT_EQ(root.box(1 - first), (CellBox{{100, 0, 0}, {110, 2, 1}}));
}

TEST(RTreeInsert, goesToTheSmallerOfTwoLeavesThatNeedNotExpand) {
  // A large cuboid, a far one, and small ones in the large one. The comments show the leaves.
  const Cuboid large = rectangle(0, 0, 100, 100);
  bench::RTree tree(RTreeConfig{3, 1});
  for (const Cuboid& cuboid : {large, rectangle(500, 500, 510, 510), rectangle(50, 50, 51, 51),
                               rectangle(52, 52, 53, 53)}) {
    tree.insert(cuboid);  // {large, 50, 52} {500}
  }
  tree.insert(rectangle(54, 54, 55, 55));  // The first leaf is split: one half has the large one.
  ASSERT_EQ(tree.height(), 2);
  const Node& root = tree.inner().node(tree.inner().root());
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
  bench::RTree tree;
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
  bench::RTree tree(RTreeConfig{4, 2});
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
    bench::RTree tree(order);
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
    EXPECT_EQ(tree.height(), 0);
    EXPECT_EQ(tree.numLeafNodes(), 0U);
    EXPECT_EQ(tree.inner().size(), 0U);
  }
}

TEST(RTreeClass, isOccupiedAboveAnOccupiedCuboidOnly) {
  bench::RTree tree(RTreeConfig{4, 2});
  for (const Cuboid& cuboid : diagonal(50)) tree.insert(cuboid);
  const Cuboid occupied{CellBox::ofCell({7, 7, 7}), Occupancy::kOccupied};
  const auto hasOccupied = [&tree] {
    return tree.inner().node(tree.inner().root()).summary().has_occupied;
  };
  EXPECT_FALSE(hasOccupied());
  tree.insert(occupied);
  EXPECT_TRUE(hasOccupied());
  EXPECT_EQ(test::allCuboids(tree, CuboidFilter::kOccupied), std::vector<Cuboid>{occupied});
  tree.remove(occupied.box);
  EXPECT_FALSE(hasOccupied());
  EXPECT_TRUE(test::allCuboids(tree, CuboidFilter::kOccupied).empty());
}

TEST(RTreeReplace, changesClassesInTheirPlaces) {
  bench::RTree tree(RTreeConfig{4, 2});
  for (const Cuboid& cuboid : diagonal(100)) tree.insert(cuboid);
  const std::size_t num_leaves = tree.numLeafNodes();
  std::vector<Cuboid> occupied = diagonal(100);
  for (Cuboid& cuboid : occupied) {
    cuboid.occupancy = Occupancy::kOccupied;
    EXPECT_TRUE(tree.replace(cuboid.box, cuboid));
  }
  EXPECT_EQ(test::allCuboids(tree), test::sorted(occupied));
  EXPECT_EQ(tree.numLeafNodes(), num_leaves);
  EXPECT_EQ(checkTree(tree), kNoViolations);
}

TEST(RTreeReplace, updatesTheBoxesAboveACuboidThatGrowsOrShrinks) {
  bench::RTree tree(RTreeConfig{4, 2});
  for (const Cuboid& cuboid : diagonal(50)) tree.insert(cuboid);
  const Cuboid grown{{{0, 0, 0}, {1, 1, 200}}, Occupancy::kFree};
  EXPECT_TRUE(tree.replace(CellBox::ofCell({0, 0, 0}), grown));
  EXPECT_EQ(tree.bounds()->max.z, 200);
  EXPECT_EQ(checkTree(tree), kNoViolations);
  EXPECT_TRUE(tree.replace(grown.box, {CellBox::ofCell({0, 0, 0}), Occupancy::kFree}));
  EXPECT_EQ(tree.bounds()->max.z, 99);
  EXPECT_EQ(checkTree(tree), kNoViolations);
}

TEST(RTreeClear, leavesATreeThatCanBeFilledAgain) {
  bench::RTree tree(RTreeConfig{4, 2});
  for (int round = 0; round < 3; ++round) {
    for (const Cuboid& cuboid : diagonal(100)) tree.insert(cuboid);
    EXPECT_EQ(tree.size(), 100U);
    EXPECT_EQ(checkTree(tree), kNoViolations);
    tree.clear();
    EXPECT_TRUE(tree.isEmpty());
    EXPECT_EQ(tree.height(), 0);
    EXPECT_FALSE(tree.bounds().has_value());
    EXPECT_EQ(checkTree(tree), kNoViolations);
  }
}

TEST(RTreeMemory, isUsedAgainAfterRemovals) {
  bench::RTree tree(RTreeConfig{8, 3});
  std::size_t bytes_after_two = 0;
  for (int round = 0; round < 20; ++round) {
    for (const Cuboid& cuboid : diagonal(500)) tree.insert(cuboid);
    for (const Cuboid& cuboid : diagonal(500)) ASSERT_TRUE(tree.remove(cuboid.box));
    tree.trim();
    if (round == 1) bytes_after_two = tree.numBytes();
  }
  EXPECT_GT(bytes_after_two, 0U);
  EXPECT_EQ(tree.numBytes(), bytes_after_two);
}

}  // namespace
}  // namespace cuboid_mapping
