// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/statistics.h"

#include "support/modelled_tree.h"

#include <gtest/gtest.h>

namespace cuboid_mapping {
namespace {

Cuboid cuboidAt(int min_x, int max_x) { return {{{min_x, 0, 0}, {max_x, 2, 2}}, Occupancy::kFree}; }

TEST(Statistics, haveOneEmptyLevelForAnEmptyTree) {
  const RTree tree;
  const TreeStatistics statistics = computeStatistics(tree);
  ASSERT_EQ(statistics.levels.size(), 1U);
  EXPECT_EQ(statistics.levels[0].num_nodes, 1U);
  EXPECT_EQ(statistics.levels[0].num_branches, 0U);
  EXPECT_EQ(statistics.levels[0].fill_ratio, 0.0);
  EXPECT_EQ(statistics.levels[0].overlap_ratio, 0.0);
  EXPECT_EQ(statistics.num_cuboids, 0U);
  EXPECT_EQ(statistics.num_bytes, tree.numBytes());
}

TEST(Statistics, giveTheShareOfVolumeThatSiblingsHaveInCommon) {
  RTree tree(RTreeConfig{8, 3});
  tree.insert(cuboidAt(0, 4));    // 16 voxels
  tree.insert(cuboidAt(2, 6));    // 16 voxels, 8 of them in the first one, too
  tree.insert(cuboidAt(10, 14));  // 16 voxels, alone
  const TreeStatistics statistics = computeStatistics(tree);
  ASSERT_EQ(statistics.levels.size(), 1U);
  EXPECT_EQ(statistics.levels[0].num_branches, 3U);
  EXPECT_DOUBLE_EQ(statistics.levels[0].fill_ratio, 3.0 / 8.0);
  EXPECT_DOUBLE_EQ(statistics.levels[0].overlap_ratio, 8.0 / 48.0);
}

TEST(Statistics, giveEachLevelOfATreeLeavesFirst) {
  RTree tree(RTreeConfig{2, 1});
  for (const int x : {0, 3, 100, 103}) tree.insert(cuboidAt(x, x + 2));
  const TreeStatistics statistics = computeStatistics(tree);
  ASSERT_EQ(statistics.levels.size(), 2U);
  EXPECT_EQ(statistics.levels[0].num_nodes, 2U);
  EXPECT_EQ(statistics.levels[0].num_branches, 4U);
  EXPECT_DOUBLE_EQ(statistics.levels[0].fill_ratio, 1.0);
  EXPECT_EQ(statistics.levels[1].num_nodes, 1U);
  EXPECT_EQ(statistics.levels[1].num_branches, 2U);
  EXPECT_EQ(statistics.levels[1].overlap_ratio, 0.0);
}

TEST(Statistics, agreeWithTheTreeAfterRandomChanges) {
  test::Random random(1);
  test::ModelledTree model(RTreeConfig{4, 2}, test::World::kLattice, 300);
  for (std::size_t i = 0; i < 2000; ++i) {
    model.change(random);
    const RTree& tree = model.tree();
    const TreeStatistics statistics = computeStatistics(tree);
    ASSERT_EQ(statistics.levels.size(), static_cast<std::size_t>(tree.height()));
    ASSERT_EQ(statistics.num_cuboids, model.cuboids().size());
    ASSERT_EQ(statistics.num_bytes, tree.numBytes());
    ASSERT_EQ(statistics.levels.front().num_branches, tree.size());
    ASSERT_EQ(statistics.levels.front().num_nodes, tree.numLeafNodes());
    ASSERT_EQ(statistics.levels.front().overlap_ratio, 0.0) << "the cuboids are disjoint";
    ASSERT_EQ(statistics.levels.back().num_nodes, 1U);
    std::size_t num_inner_nodes = 0;
    for (std::size_t level = 1; level < statistics.levels.size(); ++level) {
      // Every node has one branch that leads to it.
      ASSERT_EQ(statistics.levels[level].num_branches, statistics.levels[level - 1].num_nodes);
      num_inner_nodes += statistics.levels[level].num_nodes;
    }
    ASSERT_EQ(num_inner_nodes, tree.numInnerNodes());
    for (const LevelStatistics& level : statistics.levels) {
      ASSERT_DOUBLE_EQ(level.fill_ratio, static_cast<double>(level.num_branches) /
                                             (4.0 * static_cast<double>(level.num_nodes)));
    }
  }
}

}  // namespace
}  // namespace cuboid_mapping
