// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/cuboid_history.h"

#include "cuboid_mapping/map/cuboid_map.h"

#include <gtest/gtest.h>

namespace cuboid_mapping::bench::test {
namespace {

constexpr CellBox kCube{{0, 0, 0}, {4, 4, 4}};
constexpr CellBox kCorner{{3, 3, 3}, {4, 4, 4}};

class CuboidHistoryTest : public testing::Test {
 protected:
  void set(const CellBox& box, float log_odds) {
    map_.replace(box, {UniformBox{box, log_odds}});
    history_.note(map_);
  }

  CuboidMap map_{MapConfig()};
  CuboidHistory history_;
};

TEST_F(CuboidHistoryTest, CountsACuboidThatBreaksAndTheVoxelThatComesBack) {
  set(kCube, -1.0F);
  EXPECT_EQ(history_.numSplits(), 0U);
  set(kCorner, 1.0F);
  EXPECT_EQ(history_.numSplits(), 1U);
  EXPECT_EQ(history_.numFusedAgain(), 0U);
  set(kCorner, -1.0F);
  EXPECT_EQ(history_.numSplits(), 1U) << "what is absorbed is not split";
  EXPECT_EQ(history_.numFusedAgain(), 1U);
  set(kCorner, 1.0F);
  set(kCorner, -1.0F);
  EXPECT_EQ(history_.numSplits(), 2U);
  EXPECT_EQ(history_.numFusedAgain(), 2U);
}

TEST_F(CuboidHistoryTest, ACuboidThatGrowsIsNotSplit) {
  set({{0, 0, 0}, {2, 1, 1}}, -1.0F);
  set({{2, 0, 0}, {4, 1, 1}}, -1.0F);
  EXPECT_EQ(countCuboids(map_).total(), 1U);
  EXPECT_EQ(history_.numSplits(), 0U);
}

}  // namespace
}  // namespace cuboid_mapping::bench::test
