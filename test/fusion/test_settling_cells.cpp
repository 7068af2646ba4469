// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/settling_cells.h"

#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <vector>

namespace cuboid_mapping {
namespace {

BrickMask maskOf(const std::vector<Cell>& cells) {
  BrickMask mask;
  for (const Cell& cell : cells) mask.set(voxelIndex(cell));
  return mask;
}

TEST(SettlingCells, letsGoAfterTheGivenClouds) {
  SettlingCells cells(3);
  cells.hold({0, 0, 0}, maskOf({{1, 2, 3}}), 10);
  EXPECT_EQ(cells.heldIn({0, 0, 0}), maskOf({{1, 2, 3}}));
  EXPECT_TRUE(cells.release(12).empty());
  EXPECT_EQ(cells.release(13), (std::vector<Cell>{{1, 2, 3}}));
  EXPECT_EQ(cells.heldIn({0, 0, 0}), BrickMask());
  EXPECT_TRUE(cells.release(100).empty());
}

TEST(SettlingCells, aChangeStartsTheTimeAnew) {
  SettlingCells cells(3);
  cells.hold({-8, 0, 0}, maskOf({{-1, 2, 3}}), 10);
  cells.noteChanges({-8, 0, 0}, maskOf({{-1, 2, 3}, {-2, 2, 3}}), 12);
  EXPECT_TRUE(cells.release(14).empty());
  EXPECT_EQ(cells.release(15), (std::vector<Cell>{{-1, 2, 3}}));
}

TEST(SettlingCells, holdNoneWithZeroClouds) {
  SettlingCells cells(0);
  cells.hold({0, 0, 0}, maskOf({{1, 2, 3}}), 10);
  EXPECT_EQ(cells.size(), 0U);
  EXPECT_TRUE(cells.release(10).empty());
}

TEST(SettlingCells, agreeWithAListOfTimes) {
  test::Random random(77);
  constexpr int kClouds = 4;
  SettlingCells cells(kClouds);
  std::map<Cell, std::uint64_t> due;
  std::size_t num_released = 0;
  for (std::uint64_t cloud = 1; cloud <= 3000; ++cloud) {
    const Cell brick{8 * random.integer(-1, 1), 0, 0};
    BrickMask changed;
    for (int i = 0; i < 3; ++i) changed.set(random.integer(0, 2));
    cells.noteChanges(brick, changed, cloud);
    forEachCell(brick, changed, [&](const Cell& cell) {
      if (due.count(cell) != 0) due[cell] = cloud + kClouds;
    });
    if (random.chance(0.3)) {
      cells.hold(brick, changed, cloud);
      forEachCell(brick, changed, [&](const Cell& cell) { due[cell] = cloud + kClouds; });
    }
    std::vector<Cell> released = cells.release(cloud);
    std::sort(released.begin(), released.end());
    std::vector<Cell> expected;
    for (const auto& [cell, at] : due) {
      if (at <= cloud) expected.push_back(cell);
    }
    for (const Cell& cell : expected) due.erase(cell);
    ASSERT_EQ(released, expected) << "cloud " << cloud;
    ASSERT_EQ(cells.size(), due.size());
    num_released += released.size();
  }
  EXPECT_GT(num_released, 300U);
}

}  // namespace
}  // namespace cuboid_mapping
