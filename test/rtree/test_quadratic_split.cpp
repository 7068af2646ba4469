// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/quadratic_split.h"

#include "support/modelled_tree.h"

#include <gtest/gtest.h>

#include <optional>
#include <set>
#include <vector>

namespace cuboid_mapping {
namespace {

/// Branches with numbered children, so that they can be distinguished.
BranchList toBranches(const std::vector<CellBox>& boxes) {
  BranchList branches;
  for (const CellBox& box : boxes) {
    branches.push({box, false, static_cast<NodeIndex>(branches.size())});
  }
  return branches;
}

std::set<NodeIndex> numbersOf(const BranchList& branches) {
  std::set<NodeIndex> numbers;
  for (const Branch& branch : branches) EXPECT_TRUE(numbers.insert(branch.child).second);
  return numbers;
}

/// The two groups as sets of numbers; the one with number 0 first.
struct Groups {
  std::set<NodeIndex> first;
  std::set<NodeIndex> second;
};

Groups split(const std::vector<CellBox>& boxes, int min_branches) {
  const SplitGroups groups = splitQuadratic(toBranches(boxes), min_branches);
  Groups result{numbersOf(groups.first), numbersOf(groups.second)};
  if (result.first.count(0) == 0) std::swap(result.first, result.second);
  return result;
}

CellBox cube(int x, int edge = 1) { return {{x, 0, 0}, {x + edge, edge, edge}}; }

TEST(QuadraticSplit, parts2BoxesIntoOneEach) {
  const Groups groups = split({cube(0), cube(1)}, 1);
  EXPECT_EQ(groups.first, (std::set<NodeIndex>{0}));
  EXPECT_EQ(groups.second, (std::set<NodeIndex>{1}));
}

TEST(QuadraticSplit, keepsClustersTogether) {
  const Groups groups = split({cube(0), cube(50), cube(2), cube(52), cube(4)}, 2);
  EXPECT_EQ(groups.first, (std::set<NodeIndex>{0, 2, 4}));
  EXPECT_EQ(groups.second, (std::set<NodeIndex>{1, 3}));
}

TEST(QuadraticSplit, startsWithThePairThatWastesMost) {
  // The pair farthest apart wastes less than the pair across the plane.
  const Groups groups =
      split({{{0, 0, 0}, {1, 1, 1}}, {{12, 0, 0}, {13, 1, 1}}, {{9, 9, 0}, {10, 10, 1}}}, 1);
  EXPECT_EQ(groups.first, (std::set<NodeIndex>{0, 1}));
  EXPECT_EQ(groups.second, (std::set<NodeIndex>{2}));
}

TEST(QuadraticSplit, givesTheRestToTheGroupThatNeedsIt) {
  // One far box: the nearest of the others must join it to make d of them.
  const Groups groups = split({cube(0), cube(2), cube(4), cube(6), cube(1000)}, 2);
  EXPECT_EQ(groups.first.size(), 3U);
  EXPECT_EQ(groups.second.size(), 2U);
  EXPECT_EQ(groups.second.count(4), 1U);
}

TEST(QuadraticSplit, dividesEqualBoxes) {
  for (const int min_branches : {1, 8, 16}) {
    const Groups groups = split(std::vector<CellBox>(33, cube(0)), min_branches);
    EXPECT_GE(groups.first.size(), static_cast<std::size_t>(min_branches));
    EXPECT_GE(groups.second.size(), static_cast<std::size_t>(min_branches));
    EXPECT_EQ(groups.first.size() + groups.second.size(), 33U);
  }
}

TEST(QuadraticSplit, keepsBoxClassAndChildOfEachBranch) {
  BranchList branches;
  for (const Branch& branch : toBranches({cube(0), cube(5, 3), cube(100)})) {
    branches.push({branch.box, branch.child == 1, branch.child});
  }
  const SplitGroups groups = splitQuadratic(branches, 1);
  std::vector<Branch> all(groups.first.begin(), groups.first.end());
  all.insert(all.end(), groups.second.begin(), groups.second.end());
  EXPECT_EQ(all.size(), 3U);
  for (const Branch& branch : all) {
    EXPECT_EQ(branch.box, branches[static_cast<int>(branch.child)].box);
    EXPECT_EQ(branch.has_occupied, branches[static_cast<int>(branch.child)].has_occupied);
  }
}

double waste(const CellBox& a, const CellBox& b) {
  return unite(a, b).numVoxels() - a.numVoxels() - b.numVoxels();
}

/// Guttman's algorithm in its own words; nothing if it leaves a choice open.
class Guttman {
 public:
  static std::optional<Groups> split(const std::vector<CellBox>& boxes, int min_branches) {
    Guttman guttman(boxes, static_cast<std::size_t>(min_branches));
    guttman.pickSeeds();
    while (guttman.is_clear_ && !guttman.rest_.empty()) guttman.distributeNext();
    if (!guttman.is_clear_) return std::nullopt;
    Groups groups{guttman.groups_[0], guttman.groups_[1]};
    if (groups.first.count(0) == 0) std::swap(groups.first, groups.second);
    return groups;
  }

 private:
  Guttman(const std::vector<CellBox>& boxes, std::size_t min_branches)
      : boxes_(boxes), min_branches_(min_branches) {}

  void pickSeeds() {
    NodeIndex seeds[2] = {0, 1};
    for (NodeIndex j = 0; j < boxes_.size(); ++j) {
      for (NodeIndex i = 0; i < j; ++i) {
        const double difference =
            waste(boxes_[i], boxes_[j]) - waste(boxes_[seeds[0]], boxes_[seeds[1]]);
        if (difference == 0.0 && (i != seeds[0] || j != seeds[1])) is_tied_ = true;
        if (difference <= 0.0) continue;
        is_tied_ = false;
        seeds[0] = i;
        seeds[1] = j;
      }
    }
    is_clear_ = !is_tied_;
    for (NodeIndex i = 0; i < boxes_.size(); ++i) rest_.insert(i);
    for (int group = 0; group < 2; ++group) add(group, seeds[group]);
  }

  void add(int group, NodeIndex number) {
    covers_[group] =
        groups_[group].empty() ? boxes_[number] : unite(covers_[group], boxes_[number]);
    groups_[group].insert(number);
    rest_.erase(number);
  }

  double expansion(int group, NodeIndex number) const {
    return unite(covers_[group], boxes_[number]).numVoxels() - covers_[group].numVoxels();
  }

  void distributeNext() {
    for (int group = 0; group < 2; ++group) {
      if (groups_[group].size() + rest_.size() > min_branches_) continue;
      while (!rest_.empty()) add(group, *rest_.begin());
      return;
    }
    NodeIndex next = *rest_.begin();
    const auto preference = [this](NodeIndex i) {
      return std::abs(expansion(0, i) - expansion(1, i));
    };
    for (const NodeIndex i : rest_) {
      if (i != next && preference(i) == preference(next)) is_tied_ = true;
      if (preference(i) <= preference(next)) continue;
      is_tied_ = false;
      next = i;
    }
    is_clear_ = !is_tied_ && expansion(0, next) != expansion(1, next);
    add(expansion(0, next) < expansion(1, next) ? 0 : 1, next);
  }

  const std::vector<CellBox>& boxes_;
  std::size_t min_branches_;
  std::set<NodeIndex> groups_[2];
  CellBox covers_[2];
  std::set<NodeIndex> rest_;
  bool is_tied_ = false;
  bool is_clear_ = true;
};

TEST(QuadraticSplit, isGuttmansWhereHeLeavesNoChoice) {
  test::Random random(1);
  std::size_t num_clear = 0;
  constexpr std::size_t kCases = 20000;
  for (std::size_t i = 0; i < kCases; ++i) {
    const int count = random.integer(3, 17);
    std::vector<CellBox> boxes;
    for (int b = 0; b < count; ++b) {
      boxes.push_back(test::randomBox(random, {{-50, -50, -50}, {50, 50, 50}}, 30));
    }
    const int min_branches = random.integer(1, count / 2);
    const std::optional<Groups> expected = Guttman::split(boxes, min_branches);
    if (!expected) continue;
    ++num_clear;
    const Groups groups = split(boxes, min_branches);
    ASSERT_EQ(groups.first, expected->first) << test::seedNote(i);
    ASSERT_EQ(groups.second, expected->second) << test::seedNote(i);
  }
  EXPECT_GT(num_clear, kCases / 2);
}

TEST(QuadraticSplit, makesTwoGroupsOfAtLeastDOfAnyBoxes) {
  test::Random random(2);
  constexpr std::size_t kCases = 10000;
  for (std::size_t i = 0; i < kCases; ++i) {
    const int max_branches = random.integer(2, 64);
    const int min_branches = random.integer(1, max_branches / 2);
    const auto world = i % 2 == 0 ? test::TreeWorld::kOverlapping : test::TreeWorld::kHuge;
    std::vector<CellBox> boxes;
    for (int b = 0; b <= max_branches; ++b) boxes.push_back(test::randomBoxIn(random, world));
    const Groups groups = split(boxes, min_branches);
    ASSERT_GE(groups.first.size(), static_cast<std::size_t>(min_branches)) << test::seedNote(i);
    ASSERT_GE(groups.second.size(), static_cast<std::size_t>(min_branches)) << test::seedNote(i);
    std::set<NodeIndex> all = groups.first;
    all.insert(groups.second.begin(), groups.second.end());
    ASSERT_EQ(all.size(), boxes.size()) << test::seedNote(i);
    ASSERT_EQ(groups.first.size() + groups.second.size(), boxes.size()) << test::seedNote(i);
  }
}

}  // namespace
}  // namespace cuboid_mapping
