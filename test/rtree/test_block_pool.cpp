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

TEST(BlockPool, givesBackBlocksWithoutItemsWhenItIsTrimmed) {
  BlockPool pool(kItemBytes);
  std::vector<std::uint32_t> indices;
  for (int i = 0; i < 1000; ++i) indices.push_back(pool.allocate());
  const std::size_t bytes_of_all = pool.numBytes();
  EXPECT_GE(bytes_of_all, 1000 * kItemBytes);
  for (const std::uint32_t index : indices) pool.release(index);
  EXPECT_EQ(pool.numBytes(), bytes_of_all) << "they may be wanted again";
  pool.trim();
  EXPECT_LT(pool.numBytes(), bytes_of_all / 4) << "only the lists of blocks are left";
  for (int i = 0; i < 1000; ++i) (void)pool.allocate();
  EXPECT_LT(pool.numBytes(), bytes_of_all + bytes_of_all / 20) << "their indices are used again";
}

TEST(BlockPool, needsNoMemoryForWhatIsReserved) {
  BlockPool pool(kItemBytes);
  for (int i = 0; i < 5; ++i) (void)pool.allocate();
  pool.reserve(1000);
  const std::size_t bytes = pool.numBytes();
  EXPECT_GE(pool.endIndex(), 1005U);
  std::set<std::uint32_t> indices;
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(indices.insert(pool.allocate()).second);
  EXPECT_EQ(pool.numBytes(), bytes);
  EXPECT_LT(*indices.rbegin(), pool.endIndex());
}

TEST(BlockPool, takesReservedMemoryOutOfTheBlocksInUseFirst) {
  BlockPool pool(kItemBytes);
  (void)pool.allocate();
  const std::size_t bytes_of_one = pool.numBytes();
  pool.reserve(1000);
  (void)pool.allocate();
  pool.trim();
  EXPECT_LT(pool.numBytes(), bytes_of_one + 2000) << "only the lists of blocks have grown";
}

}  // namespace
}  // namespace cuboid_mapping
