// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/boxes/box_cover.h"

#include "boxes/cover_cells.h"
#include "boxes/small_boxes.h"
#include "cuboid_mapping/boxes/joined_cuboids.h"
#include "support/random_shapes.h"
#include "support/voxel_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace cuboid_mapping {
namespace {

using test::Bits;
using test::bitsOf;
using test::cellsOfBoxes;
using test::isAnyShared;
using test::kSmall;
using test::Random;

CuboidMap makeMap(const std::vector<CellBox>& occupied) {
  CuboidMap map;
  for (const CellBox& box : occupied) {
    map.replace(box, std::vector<UniformBox>{{box, 1.0F}});
  }
  return map;
}

std::vector<CellBox> randomBoxes(Random& random, const CellBox& area, int max_boxes) {
  std::vector<CellBox> boxes;
  const int count = random.integer(1, max_boxes);
  for (int i = 0; i < count; ++i) boxes.push_back(test::randomBox(random, area, 9));
  return boxes;
}

TEST(BoxCover, coversWhatIsOccupiedAndSaysWhatItAdds) {
  Random random(3911);
  std::size_t num_too_few = 0;
  for (std::size_t i = 0; i < 300; ++i) {
    SCOPED_TRACE(test::seedNote(i));
    const CellBox area{{-20, -20, -10}, {20, 20, 10}};
    const CuboidMap map = makeMap(randomBoxes(random, area, 40));
    CoverTask task;
    task.max_boxes = static_cast<std::size_t>(random.integer(1, 30));
    if (random.chance(0.5)) task.region = test::randomBoxInside(random, area);
    if (random.chance(0.5)) task.keep_free = randomBoxes(random, area, 3);
    std::vector<CellBox> joined;
    const auto cuboids =
        joinCuboids(map, task.region, CuboidFilter::kOccupied, Budget::unlimited());
    for (const Cuboid& c : cuboids.value) joined.push_back(c.box);
    std::set<Cell> expected = cellsOfBoxes(joined);
    const auto num_occupied = static_cast<double>(expected.size());
    for (const Cell& cell : cellsOfBoxes(task.keep_free)) expected.erase(cell);

    const auto answer = coverOccupied(map, task, Budget::unlimited());
    const BoxCover& cover = answer.value;
    const double voxel = map.grid().voxelVolume();
    const std::set<Cell> covered = cellsOfBoxes(cover.boxes);
    ASSERT_TRUE(std::includes(covered.begin(), covered.end(), expected.begin(), expected.end()));
    EXPECT_NEAR(cover.occupied_volume_m3 / voxel, static_cast<double>(expected.size()), 1e-6);
    EXPECT_NEAR(cover.added_volume_m3 / voxel,
                static_cast<double>(covered.size() - expected.size()), 1e-6);
    EXPECT_NEAR(cover.left_out_volume_m3 / voxel,
                num_occupied - static_cast<double>(expected.size()), 1e-6);
    for (const CellBox& box : cover.boxes) {
      EXPECT_FALSE(isAnyShared(box, task.keep_free)) << box;
      EXPECT_TRUE(task.region.contains(box)) << box;
    }
    const bool is_found = cover.boxes.size() <= task.max_boxes;
    EXPECT_EQ(answer.status, is_found ? AnswerStatus::kFound : AnswerStatus::kNotFound);
    EXPECT_TRUE(is_found || !task.keep_free.empty());
    num_too_few += is_found ? 0 : 1;
  }
  EXPECT_GT(num_too_few, 5U);
}

std::vector<Bits> allBoxes() {
  std::vector<Bits> boxes;
  test::visitCells(kSmall, [&](const Cell& min) {
    test::visitCells({min, kSmall.max}, [&](const Cell& last) {
      boxes.push_back(bitsOf({min, last + Cell{1, 1, 1}}));
    });
  });
  return boxes;
}

/// The fewest voxels that this number of boxes adds, over all choices.
int leastAdded(Bits occupied, Bits covered, std::size_t num_boxes, const std::vector<Bits>& boxes) {
  const Bits missing = occupied & ~covered;
  if (missing == 0) return __builtin_popcount(covered & ~occupied);
  if (num_boxes == 0) return 1000;
  const Bits first = missing & (~missing + 1);
  int least = 1000;
  for (const Bits box : boxes) {
    if ((box & first) != 0)
      least = std::min(least, leastAdded(occupied, covered | box, num_boxes - 1, boxes));
  }
  return least;
}

TEST(BoxCover, isCloseToTheBestOnSmallCases) {
  Random random(3912);
  const std::vector<Bits> boxes = allBoxes();
  int num_added = 0;
  int num_least = 0;
  int num_best = 0;
  constexpr int kCases = 200;
  for (int i = 0; i < kCases; ++i) {
    std::vector<CellBox> occupied;
    const double share = random.real(0.1, 0.6);
    test::visitCells(kSmall, [&](const Cell& cell) {
      if (random.chance(share)) occupied.push_back(CellBox::ofCell(cell));
    });
    Bits bits = 0;
    for (const CellBox& box : occupied) bits |= bitsOf(box);
    CoverTask task;
    task.max_boxes = 1 + random.index(3);
    const CuboidMap map = makeMap(occupied);
    const BoxCover cover = *coverOccupied(map, task, Budget::unlimited());
    Bits covered = 0;
    for (const CellBox& box : cover.boxes) covered |= bitsOf(box);
    const int added = __builtin_popcount(covered & ~bits);
    const int least = leastAdded(bits, 0, task.max_boxes, boxes);
    ASSERT_GE(added, least) << test::seedNote(static_cast<std::size_t>(i));
    num_added += added;
    num_least += least;
    num_best += added == least ? 1 : 0;
  }
  std::cout << num_added << " voxels added, least " << num_least << "; " << num_best << " of "
            << kCases << " cases are the best" << std::endl;
  EXPECT_LE(num_added, 1.15 * num_least);
  EXPECT_GE(num_best, kCases * 2 / 3);
}

TEST(BoxCover, addsNothingWhereThereAreBoxesEnough) {
  const CuboidMap map = makeMap({{{0, 0, 0}, {50, 1, 20}}, {{0, 0, 0}, {1, 50, 20}}});
  CoverTask task;
  task.max_boxes = 2;
  const auto cover = coverOccupied(map, task, Budget::unlimited());
  ASSERT_TRUE(cover.isFound());
  EXPECT_EQ(cover->boxes.size(), 2U);
  EXPECT_EQ(cover->added_volume_m3, 0.0);
}

TEST(BoxCover, doesNotUniteVoxelsThatAreFarApart) {
  const std::int32_t far = 1 << 29;
  const CuboidMap map = makeMap({{{0, 0, 0}, {5, 5, 5}},
                                 {{50, 0, 0}, {51, 5, 5}},
                                 {{far, far, far}, {far + 1, far + 1, far + 1}}});
  CoverTask task;
  task.max_boxes = 1;
  const auto cover = coverOccupied(map, task, Budget::unlimited());
  EXPECT_TRUE(cover.isNotFound());
  EXPECT_EQ(cover.value.boxes.size(), 2U);
}

TEST(BoxCover, isTheSameAgain) {
  Random random(3913);
  const CuboidMap map = makeMap(randomBoxes(random, {{-60, -60, -10}, {60, 60, 10}}, 400));
  CoverTask task;
  task.max_boxes = 25;
  const auto cover = coverOccupied(map, task, Budget::unlimited());
  EXPECT_EQ(coverOccupied(map, task, Budget::unlimited())->boxes, cover->boxes);
}

TEST(BoxCover, refusesNoBoxesAndEmptyRegions) {
  const CuboidMap map = makeMap({{{0, 0, 0}, {5, 5, 5}}});
  CoverTask task;
  EXPECT_FALSE(coverOccupied(map, task, Budget::unlimited()).fault.empty());
  task.max_boxes = 1;
  EXPECT_TRUE(coverOccupied(map, task, Budget::unlimited()).isFound());
  task.region = {};
  EXPECT_FALSE(coverOccupied(map, task, Budget::unlimited()).fault.empty());
  task.region = kAllCells;
  for (const Eigen::Vector3d& edges :
       {Eigen::Vector3d(-1.0, -1.0, -1.0), Eigen::Vector3d(0.5, 0.0, 0.5),
        Eigen::Vector3d(0.5, 0.5, NAN)}) {
    task.keep_passages_m = edges;
    EXPECT_FALSE(coverOccupied(map, task, Budget::unlimited()).fault.empty()) << edges.transpose();
  }
  task.keep_passages_m.setConstant(0.5);
  task.region = {{100, 100, 100}, {200, 200, 200}};
  EXPECT_TRUE(coverOccupied(map, task, Budget::unlimited())->boxes.empty());
}

TEST(BoxCover, keepsBoxesThatDidNotChange) {
  Random random(3916);
  CuboidMap map = makeMap(randomBoxes(random, {{-60, -60, -10}, {60, 60, 10}}, 400));
  CoverTask task;
  task.max_boxes = 40;
  const std::vector<CellBox> before = coverOccupied(map, task, Budget::unlimited())->boxes;
  const CellBox more = CellBox::ofCell({200, 0, 0});
  map.replace(more, std::vector<UniformBox>{{more, 1.0F}});
  task.max_boxes = 41;
  task.previous = before;
  const std::vector<CellBox> after = coverOccupied(map, task, Budget::unlimited())->boxes;
  ASSERT_EQ(after.size(), 41U);
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(after[i], before[i]);
  EXPECT_EQ(after.back(), more);
}

TEST(BoxCover, saysThatItsBudgetIsSpent) {
  Random random(3914);
  const CuboidMap map = makeMap(randomBoxes(random, {{-60, -60, -10}, {60, 60, 10}}, 100));
  CoverTask task;
  task.max_boxes = 3;
  for (const std::uint64_t max_bricks : {1, 100, 1000}) {
    QueryLimits limits;
    limits.max_bricks = max_bricks;
    Budget budget(limits);
    const auto cover = coverOccupied(map, task, budget);
    EXPECT_EQ(cover.status, AnswerStatus::kBudgetSpent);
    EXPECT_TRUE(cover.value.boxes.empty());
  }
}

TEST(BoxCover, manyBoxesOfTheTaskCountAndTakeTurnsWithOthers) {
  Random random(3917);
  const CellBox area{{-60, -60, -10}, {60, 60, 10}};
  const CuboidMap map = makeMap(randomBoxes(random, area, 100));
  CoverTask kept;
  kept.max_boxes = 3;
  CoverTask begun = kept;
  kept.keep_free.assign(20000, {{500, 0, 0}, {501, 1, 1}});
  for (int i = 0; i < 20000; ++i) begun.previous.push_back(test::randomBox(random, area, 3));
  for (const CoverTask& task : {kept, begun}) {
    int num_turns = 0;
    Budget budget({INFINITY, 100000}, {[&num_turns] { ++num_turns; }, 0.0});
    EXPECT_EQ(coverOccupied(map, task, budget).status, AnswerStatus::kBudgetSpent);
    EXPECT_GT(num_turns, 200);
  }
}

}  // namespace
}  // namespace cuboid_mapping
