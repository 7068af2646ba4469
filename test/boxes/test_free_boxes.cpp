// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/boxes/free_boxes.h"

#include "boxes/small_boxes.h"
#include "support/random_bricks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace cuboid_mapping {
namespace {

using test::Bits;
using test::bitsOf;
using test::kSmall;
using test::Random;

constexpr CellBox kFreeArea{{-16, -16, -8}, {16, 16, 8}};

double countFree(const CuboidMap& map, const CellBox& region) {
  double count = 0.0;
  test::visitCells(intersect(region, kFreeArea), [&](const Cell& cell) {
    count += map.voxels().at(cell) == Occupancy::kFree ? 1.0 : 0.0;
  });
  return count;
}

TEST(FreeBoxes, areFreeAndCountedRight) {
  Random random(3931);
  for (std::size_t i = 0; i < 200; ++i) {
    SCOPED_TRACE(test::seedNote(i));
    const CuboidMap map = test::mapOfUpdates(random, 8);
    FreeBoxesTask task;
    task.max_boxes = static_cast<std::size_t>(random.integer(1, 40));
    task.may_overlap = random.chance(0.5);
    if (random.chance(0.5)) task.region = test::randomBoxInside(random, kFreeArea);
    const auto answer = findFreeBoxes(map, task, Budget::unlimited());
    ASSERT_TRUE(answer.isFound() || countFree(map, task.region) == 0.0);
    const FreeBoxes& found = answer.value;
    EXPECT_LE(found.boxes.size(), task.max_boxes);
    std::set<Cell> covered;
    for (const CellBox& box : found.boxes) {
      EXPECT_TRUE(task.region.contains(box)) << box;
      test::visitCells(box, [&](const Cell& cell) {
        ASSERT_EQ(map.voxels().at(cell), Occupancy::kFree) << cell;
        ASSERT_TRUE(covered.insert(cell).second || task.may_overlap) << cell << " lies in two";
      });
    }
    const double voxel = map.grid().voxelVolume();
    const double num_free = countFree(map, task.region);
    EXPECT_NEAR(found.covered_volume_m3 / voxel, static_cast<double>(covered.size()), 1e-6);
    EXPECT_NEAR(found.missing_volume_m3 / voxel, num_free - static_cast<double>(covered.size()),
                1e-6);
    EXPECT_TRUE(found.boxes.size() == task.max_boxes || found.missing_volume_m3 == 0.0);
  }
}

/// The most voxels that this number of boxes holds, over all choices.
int mostCovered(Bits covered, std::size_t num_boxes, const std::vector<Bits>& boxes,
                std::size_t first, bool may_overlap) {
  int most = __builtin_popcount(covered);
  for (std::size_t i = first; num_boxes > 0 && i < boxes.size(); ++i) {
    if (!may_overlap && (boxes[i] & covered) != 0) continue;
    most =
        std::max(most, mostCovered(covered | boxes[i], num_boxes - 1, boxes, i + 1, may_overlap));
  }
  return most;
}

TEST(FreeBoxes, areCloseToTheBestOnSmallCases) {
  Random random(3932);
  int num_covered = 0;
  int num_most = 0;
  for (int i = 0; i < 200; ++i) {
    CuboidMap map;
    Bits free = 0;
    const double share = random.real(0.3, 0.9);
    std::vector<UniformBox> voxels;
    test::visitCells(kSmall, [&](const Cell& cell) {
      if (!random.chance(share)) return;
      voxels.push_back({CellBox::ofCell(cell), -1.0F});
      free |= bitsOf(CellBox::ofCell(cell));
    });
    map.replace(kAllCells, voxels);
    std::vector<Bits> boxes;
    test::visitCells(kSmall, [&](const Cell& min) {
      test::visitCells({min, kSmall.max}, [&](const Cell& last) {
        const Bits box = bitsOf({min, last + Cell{1, 1, 1}});
        if ((box & ~free) == 0) boxes.push_back(box);
      });
    });
    FreeBoxesTask task;
    task.max_boxes = 1 + random.index(3);
    task.may_overlap = random.chance(0.5);
    Bits covered = 0;
    const auto found = findFreeBoxes(map, task, Budget::unlimited());
    for (const CellBox& box : found.value.boxes) covered |= bitsOf(box);
    const int most = mostCovered(0, task.max_boxes, boxes, 0, task.may_overlap);
    ASSERT_LE(__builtin_popcount(covered), most) << test::seedNote(static_cast<std::size_t>(i));
    num_covered += __builtin_popcount(covered);
    num_most += most;
  }
  std::cout << num_covered << " voxels covered, most " << num_most << std::endl;
  EXPECT_GE(num_covered, 0.9 * num_most);
}

/// Others fill the map while the searches let them in: the boxes are those of the map as it was.
TEST(FreeBoxes, andCoversAreOfOneRevisionOfTheMap) {
  const auto make_map = [] {
    Random random(3934);
    return test::mapOfUpdates(random, 8);
  };
  Random random(3935);
  const CuboidMap before = make_map();
  CuboidMap map = make_map();
  int num_turns = 0;
  MapUnlock unlock;
  unlock.period_s = 0.0;
  unlock.yield = [&] {
    const Cell min = test::randomCell(random, kFreeArea);
    const CellBox box{min, min + Cell{2, 2, 2}};
    ++num_turns;
    map.replace(box, {{box, random.chance(0.5) ? 1.0F : -1.0F}});
  };
  Budget free_budget(QueryLimits{}, unlock);
  FreeBoxesTask task;
  task.max_boxes = 12;
  EXPECT_EQ(findFreeBoxes(map, task, free_budget)->boxes,
            findFreeBoxes(before, task, Budget::unlimited())->boxes);
  EXPECT_GT(num_turns, 3);
  map = make_map();
  num_turns = 0;
  Budget cover_budget(QueryLimits{}, unlock);
  CoverTask cover_task;
  cover_task.max_boxes = 5;
  EXPECT_EQ(coverOccupied(map, cover_task, cover_budget)->boxes,
            coverOccupied(before, cover_task, Budget::unlimited())->boxes);
  EXPECT_GT(num_turns, 3);
}

TEST(FreeBoxes, refuseNoBoxesAndEmptyRegions) {
  CuboidMap map;
  FreeBoxesTask task;
  EXPECT_FALSE(findFreeBoxes(map, task, Budget::unlimited()).fault.empty());
  task.max_boxes = 4;
  EXPECT_TRUE(findFreeBoxes(map, task, Budget::unlimited()).isNotFound());
  task.region = {};
  EXPECT_FALSE(findFreeBoxes(map, task, Budget::unlimited()).fault.empty());
}

TEST(FreeBoxes, endWithAnyBudget) {
  Random random(3935);
  const CuboidMap map = test::mapOfUpdates(random, 8);
  FreeBoxesTask task;
  task.max_boxes = 3;
  const FreeBoxes all = *findFreeBoxes(map, task, Budget::unlimited());
  std::size_t num_spent = 0;
  for (QueryLimits limits{1e9, 0};; ++limits.max_bricks, ++num_spent) {
    Budget budget(limits);
    const auto found = findFreeBoxes(map, task, budget);
    if (found.status == AnswerStatus::kBudgetSpent) continue;
    EXPECT_EQ(found->boxes, all.boxes);
    break;
  }
  EXPECT_GT(num_spent, 50U);
}

TEST(FreeBoxes, sayThatTheBudgetIsSpent) {
  Random random(3933);
  const CuboidMap map = test::mapOfUpdates(random, 8);
  FreeBoxesTask task;
  task.max_boxes = 5;
  QueryLimits limits;
  limits.max_bricks = 3;
  Budget budget(limits);
  EXPECT_EQ(findFreeBoxes(map, task, budget).status, AnswerStatus::kBudgetSpent);
}

}  // namespace
}  // namespace cuboid_mapping
