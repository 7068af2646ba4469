// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/pack.h"

#include "support/modelled_tree.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace cuboid_mapping {
namespace {

Branch cubeAt(int x, int y, NodeIndex number) {
  return {CellBox::ofCell({x, y, 0}), false, number};
}

TEST(Pack, leavesOneGroupAsItIs) {
  std::vector<Branch> branches{cubeAt(5, 0, 0), cubeAt(1, 0, 1)};
  EXPECT_EQ(packBranches(branches, {1, 1, 4}), (std::vector<std::size_t>{2}));
}

TEST(Pack, cutsBetweenClusters) {
  std::vector<Branch> branches{cubeAt(0, 0, 0), cubeAt(50, 0, 1), cubeAt(2, 0, 2), cubeAt(1, 1, 3),
                               cubeAt(51, 1, 4)};
  ASSERT_EQ(packBranches(branches, {2, 2, 4}).size(), 2U);
  EXPECT_LE(branches[1].box.max.x, 3);
}

TEST(Pack, cutsWhereTheTwoSidesShareNothing) {
  // A box across the middle, where an even cut would be.
  std::vector<Branch> branches;
  for (const int x : {0, 1, 2, 7, 8, 9}) branches.push_back(cubeAt(x, 0, kNoNode));
  branches.push_back({{{3, 0, 0}, {8, 1, 1}}, false, kNoNode});
  const std::vector<std::size_t> ends = packBranches(branches, {2, 2, 6});
  EXPECT_EQ(ends, (std::vector<std::size_t>{3, 7}));
}

TEST(Pack, makesGroupsOfAllowedSizesOfAnyBoxes) {
  test::Random random(1);
  for (std::size_t i = 0; i < 3000; ++i) {
    const auto world = static_cast<test::World>(random.integer(0, 3));
    const auto most = static_cast<std::size_t>(random.integer(2, 64));
    const auto fewest = static_cast<std::size_t>(random.integer(1, static_cast<int>(most) / 2));
    const auto num_groups = static_cast<std::size_t>(random.integer(1, 9));
    const auto count = static_cast<std::size_t>(
        random.integer(static_cast<int>(num_groups * fewest), static_cast<int>(num_groups * most)));
    std::vector<Branch> branches;
    for (NodeIndex number = 0; number < count; ++number) {
      branches.push_back({test::randomBoxIn(random, world), false, number});
    }
    const std::vector<std::size_t> ends = packBranches(branches, {num_groups, fewest, most});
    ASSERT_EQ(ends.size(), num_groups) << test::seedNote(i);
    ASSERT_EQ(ends.back(), count) << test::seedNote(i);
    std::size_t first = 0;
    for (const std::size_t end : ends) {
      ASSERT_GE(end, first + fewest) << test::seedNote(i);
      ASSERT_LE(end, first + most) << test::seedNote(i);
      first = end;
    }
    std::set<NodeIndex> numbers;
    for (const Branch& branch : branches) numbers.insert(branch.child);
    ASSERT_EQ(numbers.size(), count) << "a branch is lost; " << test::seedNote(i);
  }
}

}  // namespace
}  // namespace cuboid_mapping
