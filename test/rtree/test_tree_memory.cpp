// SPDX-License-Identifier: BSD-3-Clause
// Compares a tree's own size with its memory from the allocator. This is a program of its own because
// it counts calls of operator new.
#include "support/counted_memory.h"
#include "support/modelled_tree.h"

#include <gtest/gtest.h>

#include <memory>

namespace cuboid_mapping {
namespace {

using test::allocated_bytes;

/// A tree on the heap, so that only the tree is counted.
class TreeMemory : public testing::Test {
 protected:
  TreeMemory() : before_(allocated_bytes), tree_(std::make_unique<bench::RTree>()) {}

  [[nodiscard]] double heapBytes() const {
    return static_cast<double>(allocated_bytes - before_ - sizeof(bench::RTree));
  }
  void expectExact() const {
    EXPECT_NEAR(static_cast<double>(tree_->numBytes()), heapBytes(), 0.05 * heapBytes());
  }
  /// Fills the tree with groups of cuboids, in layers of 20 x 20 groups.
  void fill(int num_groups, int edge) {
    for (int group = 0; group < num_groups; ++group) {
      const Cell corner{group % 20 * edge, group / 20 % 20 * edge, group / 400 * edge};
      for (int i = 0; i < 48; ++i) {
        const Cell min = corner + Cell{2 * (i % 8), 2 * (i / 8), 0};
        tree_->insert({{min, min + Cell{1, 1, edge}}, Occupancy::kFree});
      }
    }
  }
  void removeAbove(int min_z) {
    std::vector<CellBox> boxes;
    visitBox(*tree_, {{-1, -1, min_z}, {1 << 20, 1 << 20, 1 << 20}}, CuboidFilter::kAll,
             [&boxes](const Cuboid& cuboid) {
               boxes.push_back(cuboid.box);
               return Visit::kContinue;
             });
    for (const CellBox& box : boxes) tree_->remove(box);
    tree_->trim();
  }

  std::size_t before_;
  std::unique_ptr<bench::RTree> tree_;
};

TEST_F(TreeMemory, isExactForAnEmptyTree) {
  EXPECT_EQ(heapBytes(), 0.0);
  expectExact();
}

TEST_F(TreeMemory, isExactForASmallTree) {
  fill(10, 16);
  expectExact();
}

TEST_F(TreeMemory, isExactForALargeTreeAndGoesBackWithIt) {
  fill(2000, 16);
  const double full_bytes = heapBytes();
  EXPECT_EQ(tree_->size(), 96000U);
  EXPECT_LT(full_bytes / static_cast<double>(tree_->size()), 60.0);
  expectExact();
  removeAbove(16);
  EXPECT_EQ(tree_->size(), 19200U);
  expectExact();
  EXPECT_LT(heapBytes(), 0.4 * full_bytes) << "the removed cuboids keep their memory";
  tree_->clear();
  expectExact();
}

}  // namespace
}  // namespace cuboid_mapping
