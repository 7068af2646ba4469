// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/node.h"

#include "support/random.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

namespace cuboid_mapping {
namespace {

constexpr int kCapacity = 4;

TEST(NodePool, holdsNothingAtFirst) {
  const NodePool pool(kCapacity);
  EXPECT_EQ(pool.numItems(), 0U);
  EXPECT_EQ(pool.numBytes(), 0U);
}

TEST(NodePool, keepsEachNodeApartThroughRandomChanges) {
  test::Random random(1);
  NodePool pool(kCapacity);
  std::map<NodeIndex, NodeIndex> nodes;  // With their parents.
  for (std::size_t i = 0; i < 100000; ++i) {
    const double growth = i / 20000 % 2 == 0 ? 0.7 : 0.3;  // Up to thousands, down to none.
    if (random.chance(0.001)) pool.trim();
    if (nodes.empty() || random.chance(growth)) {
      const NodeIndex index = pool.allocate();
      ASSERT_EQ(pool[index].count(), 0);
      pool[index].parent = static_cast<NodeIndex>(random.bits());
      ASSERT_TRUE(nodes.emplace(index, pool[index].parent).second) << "in use";
    } else {
      auto node = nodes.lower_bound(static_cast<NodeIndex>(random.index(10000)));
      if (node == nodes.end()) node = nodes.begin();
      ASSERT_EQ(pool[node->first].parent, node->second) << test::seedNote(i);
      pool.release(node->first);
      nodes.erase(node);
    }
    ASSERT_EQ(pool.numItems(), nodes.size());
  }
}

TEST(NodePool, givesBackTheMemoryOfUnusedNodesWhenItIsTrimmed) {
  NodePool pool(kCapacity);
  std::vector<NodeIndex> indices;
  for (int i = 0; i < 1000; ++i) indices.push_back(pool.allocate());
  const std::size_t bytes_of_all = pool.numBytes();
  EXPECT_GE(bytes_of_all, 1000 * Node::numBytes(kCapacity));
  for (const NodeIndex index : indices) pool.release(index);
  EXPECT_EQ(pool.numBytes(), bytes_of_all) << "they may be wanted again";
  pool.trim();
  EXPECT_LT(pool.numBytes(), bytes_of_all / 10) << "only the lists of nodes are left";
  for (int i = 0; i < 1000; ++i) (void)pool.allocate();
  EXPECT_EQ(pool.numBytes(), bytes_of_all) << "their indices are used again";
}

TEST(NodePool, needsNoMemoryForWhatIsReserved) {
  NodePool pool(kCapacity);
  for (int i = 0; i < 5; ++i) (void)pool.allocate();
  pool.reserve(1000);
  const std::size_t bytes = pool.numBytes();
  EXPECT_GE(pool.endIndex(), 1005U);
  std::set<NodeIndex> indices;
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(indices.insert(pool.allocate()).second);
  EXPECT_EQ(pool.numBytes(), bytes);
  EXPECT_LT(*indices.rbegin(), pool.endIndex());
}

}  // namespace
}  // namespace cuboid_mapping
