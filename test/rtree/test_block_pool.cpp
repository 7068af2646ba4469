// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/block_pool.h"

#include "support/random.h"

#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <set>

namespace cuboid_mapping {
namespace {

constexpr std::size_t kItemBytes = 20;

TEST(BlockPool, holdsNothingAtFirst) {
  const BlockPool pool(kItemBytes);
  EXPECT_EQ(pool.numItems(), 0U);
  EXPECT_EQ(pool.numBytes(), 0U);
}

TEST(BlockPool, keepsEachItemApartThroughRandomChanges) {
  test::Random random(1);
  BlockPool pool(kItemBytes);
  std::map<std::uint32_t, std::uint64_t> items;
  for (std::size_t i = 0; i < 100000; ++i) {
    const double growth = i / 20000 % 2 == 0 ? 0.7 : 0.3;  // Up to thousands, down to none.
    if (items.empty() || random.chance(growth)) {
      const std::uint32_t index = pool.allocate();
      const std::uint64_t content = random.bits();
      std::memcpy(pool[index] + kItemBytes - sizeof(content), &content, sizeof(content));
      ASSERT_TRUE(items.emplace(index, content).second) << "in use";
    } else {
      auto item = items.lower_bound(static_cast<std::uint32_t>(random.index(10000)));
      if (item == items.end()) item = items.begin();
      std::uint64_t content = 0;
      std::memcpy(&content, pool[item->first] + kItemBytes - sizeof(content), sizeof(content));
      ASSERT_EQ(content, item->second) << test::seedNote(i);
      pool.release(item->first);
      items.erase(item);
    }
    ASSERT_EQ(pool.numItems(), items.size());
  }
}

TEST(BlockPool, givesBackBlocksWithoutItems) {
  BlockPool pool(kItemBytes);
  std::vector<std::uint32_t> indices;
  for (int i = 0; i < 1000; ++i) indices.push_back(pool.allocate());
  const std::size_t bytes_of_all = pool.numBytes();
  EXPECT_GE(bytes_of_all, 1000 * kItemBytes);
  for (const std::uint32_t index : indices) pool.release(index);
  EXPECT_LT(pool.numBytes(), bytes_of_all / 20) << "only the list of blocks is left";
  for (int i = 0; i < 1000; ++i) (void)pool.allocate();
  EXPECT_LT(pool.numBytes(), bytes_of_all + bytes_of_all / 20) << "their indices are used again";
}

TEST(BlockPool, startsAnewInTheBlockThatItKeeps) {
  BlockPool pool(kItemBytes, true);
  std::vector<std::uint32_t> indices;
  for (int i = 0; i < 1000; ++i) indices.push_back(pool.allocate());
  for (const std::uint32_t index : indices) pool.release(index);
  pool.clear();
  EXPECT_EQ(pool.numItems(), 0U);
  const std::size_t bytes_of_one = pool.numBytes();
  EXPECT_GE(bytes_of_one, 64 * kItemBytes);
  std::set<std::uint32_t> again;
  for (int i = 0; i < 64; ++i) EXPECT_TRUE(again.insert(pool.allocate()).second);
  EXPECT_EQ(pool.numBytes(), bytes_of_one);
  (void)pool.allocate();
  EXPECT_GT(pool.numBytes(), bytes_of_one);
}

}  // namespace
}  // namespace cuboid_mapping
