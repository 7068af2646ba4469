// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/beam_marks.h"

#include "support/random.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <set>

namespace cuboid_mapping {
namespace {

/// Marks some bricks, and expects that they are kept.
void markBricks(BeamMarks& marks, test::Random& random, std::size_t count) {
  marks.clear();
  std::set<BrickKey> keys;
  while (keys.size() < count) {
    const BrickKey key = random.bits() >> 1;
    marks.findOrAdd(key).hits.set(static_cast<int>(key % kBrickVoxels));
    keys.insert(key);
  }
  ASSERT_EQ(marks.size(), count);
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const BrickKey key = marks.key(i);
    EXPECT_EQ(keys.count(key), 1U);
    EXPECT_EQ(&marks.findOrAdd(key), &marks[i]);
    EXPECT_EQ(marks[i].hits.count(), 1);
    EXPECT_TRUE(marks[i].hits.test(static_cast<int>(key % kBrickVoxels)));
    EXPECT_TRUE(marks[i].collectMisses().isEmpty());
  }
  ASSERT_EQ(marks.size(), count);
}

TEST(BeamMarks, keepTheBricksOfEachCloud) {
  test::Random random(71);
  BeamMarks marks;
  for (const std::size_t count : {0U, 1U, 1000U, 5000U, 1U, 1U, 3000U, 1U, 20000U, 0U, 0U, 7U}) {
    markBricks(marks, random, count);
  }
}

TEST(BeamMarks, giveTheMemoryOfALongCloudBackDuringShortOnes) {
  test::Random random(72);
  BeamMarks marks;
  markBricks(marks, random, 100);
  const std::size_t before = marks.numBytes();
  markBricks(marks, random, 50000);
  EXPECT_GT(marks.numBytes(), 20 * before);
  for (int i = 0; i < 12; ++i) markBricks(marks, random, 100);
  EXPECT_LE(marks.numBytes(), 3 * before);
}

TEST(BeamMarks, keepTheMemoryOfCloudsOfOneSize) {
  test::Random random(73);
  BeamMarks marks;
  markBricks(marks, random, 20000);
  const std::size_t before = marks.numBytes();
  for (int i = 0; i < 5; ++i) {
    markBricks(marks, random, 20000);
    EXPECT_EQ(marks.numBytes(), before);
  }
}

}  // namespace
}  // namespace cuboid_mapping
