// SPDX-License-Identifier: BSD-3-Clause
// Changes of a tree need no more memory than was reserved. This is a program of its own because it counts calls of
// operator new.
#include "cuboid_mapping/rtree/inner_tree.h"

#include "support/counted_memory.h"
#include "support/random_shapes.h"
#include "support/tree_invariants.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::Random;

/// Removes some leaf nodes, and adds others, of which many lie on a line: such trees split often.
class ChangedTree {
 public:
  explicit ChangedTree(const RTreeConfig& order) : tree_(order) {}

  void change(Random& random, std::size_t num_removals, std::size_t num_insertions) {
    num_removals = std::min(num_removals, leaves_.size());
    random.shuffle(leaves_);
    const std::size_t end = boxes_.size() + num_insertions;
    tree_.reserve(num_insertions, num_removals, end);
    boxes_.reserve(end);
    leaves_.reserve(leaves_.size() + num_insertions);
    const std::size_t requested_before = test::requested_bytes;
    for (std::size_t i = 0; i < num_removals; ++i) {
      tree_.remove(leaves_.back());
      leaves_.pop_back();
    }
    for (std::size_t i = 0; i < num_insertions; ++i) insert(random);
    EXPECT_EQ(test::requested_bytes, requested_before) << "not reserved";
    if (random.chance(0.5)) tree_.trim();
  }

  [[nodiscard]] std::vector<std::string> check() const {
    return checkNodes(tree_, [this](NodeIndex leaf) { return Branch{boxes_[leaf], false, leaf}; });
  }

 private:
  void insert(Random& random) {
    const std::int32_t at = static_cast<std::int32_t>(boxes_.size());
    boxes_.push_back(random.chance(0.5)
                         ? CellBox::ofCell({at, at, at})
                         : test::randomBox(random, {{-90, -90, -90}, {90, 90, 90}}, 20));
    leaves_.push_back(static_cast<NodeIndex>(at));
    tree_.insert({boxes_.back(), false, leaves_.back()});
  }

  InnerTree tree_;
  std::vector<CellBox> boxes_;  ///< By leaf node.
  std::vector<NodeIndex> leaves_;
};

TEST(InnerTree, needsNoMoreMemoryThanIsReserved) {
  Random random(65);
  for (const RTreeConfig& order : {RTreeConfig{2, 1}, RTreeConfig{3, 1}, RTreeConfig{4, 1},
                                   RTreeConfig{5, 1}, RTreeConfig{4, 2}, RTreeConfig{32, 12}}) {
    SCOPED_TRACE(testing::Message() << "d " << order.min_branches << ", M " << order.max_branches);
    ChangedTree tree(order);
    for (std::size_t i = 0; i < 150; ++i) {
      tree.change(random, random.index(60), random.index(i < 100 ? 80 : 40));
      ASSERT_EQ(tree.check(), std::vector<std::string>());
      ASSERT_FALSE(HasFailure()) << test::seedNote(i);
    }
  }
}

}  // namespace
}  // namespace cuboid_mapping
