// SPDX-License-Identifier: BSD-3-Clause
// Boxes of a cover leave ways open.
#include "boxes/cover_cells.h"
#include "cuboid_mapping/boxes/box_cover.h"
#include "cuboid_mapping/boxes/joined_cuboids.h"
#include "support/random_shapes.h"
#include "support/voxel_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

namespace cuboid_mapping {
namespace {

using test::cellsOfBoxes;
using test::isAnyShared;
using test::Random;

/// A storey of free voxels with two rooms, noise along the walls, and a door of 6 voxels between them.
CuboidMap makeRooms(Random& random) {
  CuboidMap map;
  const CellBox storey{{0, 0, 0}, {60, 30, 8}};
  map.replace(storey, std::vector<UniformBox>{{storey, -1.0F}});
  const auto fill = [&](const CellBox& box) {
    map.replace(box, std::vector<UniformBox>{{box, 1.0F}});
  };
  const std::int32_t door = random.integer(5, 19);
  fill({{30, 0, 0}, {31, door, 8}});
  fill({{30, door + 6, 0}, {31, 30, 8}});
  for (int i = 0; i < 40; ++i) {
    const std::int32_t y = random.integer(0, 29);
    if (y >= door - 1 && y <= door + 6) continue;
    fill(CellBox::ofCell({31 + random.integer(0, 2), y, random.integer(0, 7)}));
  }
  return map;
}

/// The places of a cube of five voxels between the free voxels beside a cover, in connected parts by brute force.
class PartsBesideCover {
 public:
  PartsBesideCover(const CuboidMap& map, const std::vector<CellBox>& cover) {
    const CellBox bounds = *map.bounds();
    test::visitCells({bounds.min, bounds.max - kRobot + Cell{1, 1, 1}}, [&](const Cell& place) {
      if (fits(map, {place, place + kRobot}, cover)) part_of_[place] = 0;
    });
    for (const auto& place : part_of_) {
      if (place.second == 0) fill(place.first, ++num_parts_);
    }
  }

  static constexpr Cell kRobot{5, 5, 5};

  [[nodiscard]] const std::map<Cell, int>& partOf() const { return part_of_; }
  [[nodiscard]] int numParts() const { return num_parts_; }

 private:
  static bool fits(const CuboidMap& map, const CellBox& robot, const std::vector<CellBox>& cover) {
    if (isAnyShared(robot, cover)) return false;
    bool is_free = true;
    test::visitCells(robot, [&](const Cell& cell) {
      is_free = is_free && map.voxels().at(cell) == Occupancy::kFree;
    });
    return is_free;
  }

  void fill(const Cell& first, int part) {
    std::vector<Cell> open{first};
    part_of_[first] = part;
    while (!open.empty()) {
      const Cell at = open.back();
      open.pop_back();
      for (const Cell& step : {Cell{1, 0, 0}, Cell{0, 1, 0}, Cell{0, 0, 1}}) {
        for (const Cell& next : {at + step, at - step}) {
          const auto found = part_of_.find(next);
          if (found == part_of_.end() || found->second != 0) continue;
          found->second = part;
          open.push_back(next);
        }
      }
    }
  }

  std::map<Cell, int> part_of_;
  int num_parts_ = 0;
};

/// Whether a place of the map has a place of the largest part beside the cover less than the robot away, or at it.
bool isKept(const Cell& place, const std::set<Cell>& kept) {
  bool is_near = false;
  const Cell robot = PartsBesideCover::kRobot;
  test::visitCells({place - robot, place + robot + Cell{1, 1, 1}},
                   [&](const Cell& near) { is_near = is_near || kept.count(near) > 0; });
  return is_near;
}

TEST(CoverPassages, keepsTheDoorOpenOrNamesTheLostRoom) {
  Random random(3915);
  int num_closed = 0;
  int num_lost = 0;
  for (std::size_t i = 0; i < 24; ++i) {
    SCOPED_TRACE(test::seedNote(i));
    const CuboidMap map = makeRooms(random);
    CoverTask task;
    task.max_boxes = i % 2 == 0 ? 2 : 1;  // One box cannot leave a door.
    task.keep_passages_m.setZero();
    const auto closed = coverOccupied(map, task, Budget::unlimited());
    EXPECT_TRUE(closed.value.lost.empty());
    num_closed += PartsBesideCover(map, closed.value.boxes).numParts() > 1 ? 1 : 0;

    task.keep_passages_m.setConstant(5 * map.grid().resolution());
    const auto cover = coverOccupied(map, task, Budget::unlimited());
    const PartsBesideCover beside(map, cover.value.boxes);
    std::map<int, std::size_t> sizes;
    for (const auto& place : beside.partOf()) ++sizes[place.second];
    const int largest = std::max_element(sizes.begin(), sizes.end(), [](auto& a, auto& b) {
                          return a.second < b.second;
                        })->first;
    std::set<Cell> kept;
    for (const auto& place : beside.partOf()) {
      if (place.second == largest) kept.insert(place.first);
    }
    std::size_t num_not_kept = 0;
    const PartsBesideCover in_map(map, [&] {
      std::vector<CellBox> occupied;
      for (const Cuboid& c :
           joinCuboids(map, kAllCells, CuboidFilter::kOccupied, Budget::unlimited()).value) {
        occupied.push_back(c.box);
      }
      return occupied;
    }());
    ASSERT_EQ(in_map.numParts(), 1);
    for (const auto& place : in_map.partOf()) num_not_kept += isKept(place.first, kept) ? 0 : 1;
    EXPECT_EQ(num_not_kept == 0, cover.value.lost.empty()) << num_not_kept;
    for (const CellBox& lost : cover.value.lost) EXPECT_FALSE(isKept(lost.min, kept)) << lost;
    EXPECT_TRUE(i % 2 != 0 || cover.value.lost.empty());
    num_lost += cover.value.lost.empty() ? 0 : 1;
  }
  EXPECT_GT(num_closed, 0);
  EXPECT_GT(num_lost, 0);
}

TEST(CoverPassages, keepsALowPassageOpenForALowRobot) {
  CuboidMap map;
  const CellBox storey{{0, 0, 0}, {60, 30, 8}};
  map.replace(storey, std::vector<UniformBox>{{storey, -1.0F}});
  const auto fill = [&](const CellBox& box) {
    map.replace(box, std::vector<UniformBox>{{box, 1.0F}});
  };
  fill({{30, 0, 0}, {31, 12, 8}});
  fill({{30, 12, 3}, {31, 18, 8}});  // A lintel.
  fill({{30, 18, 0}, {31, 30, 8}});
  CoverTask task;
  task.max_boxes = 1;
  const double edge = map.grid().resolution();
  task.keep_passages_m.setConstant(5 * edge);
  EXPECT_TRUE(coverOccupied(map, task, Budget::unlimited()).value.lost.empty()) << "too high";
  task.keep_passages_m.z() = 3 * edge;
  EXPECT_EQ(coverOccupied(map, task, Budget::unlimited()).value.lost.size(), 1U);
  task.max_boxes = 3;
  const auto cover = coverOccupied(map, task, Budget::unlimited());
  EXPECT_TRUE(cover.isFound());
  EXPECT_TRUE(cover.value.lost.empty());
}

/// A storey of 16 rooms with things in them, and a door of 6 voxels in each wall.
CuboidMap makeStorey(Random& random) {
  CuboidMap map;
  const CellBox storey{{0, 0, 0}, {96, 64, 8}};
  map.replace(storey, std::vector<UniformBox>{{storey, -1.0F}});
  const auto fill = [&](const CellBox& box, float log_odds) {
    map.replace(box, std::vector<UniformBox>{{box, log_odds}});
  };
  for (int x = 24; x < 96; x += 24) fill({{x, 0, 0}, {x + 1, 64, 8}}, 1.0F);
  for (int y = 16; y < 64; y += 16) fill({{0, y, 0}, {96, y + 1, 8}}, 1.0F);
  for (int i = 0; i < 60; ++i) {
    const Cell corner{random.integer(0, 93), random.integer(0, 61), 0};
    const Cell size{random.integer(1, 3), random.integer(1, 3), random.integer(2, 8)};
    fill({corner, corner + size}, 1.0F);
  }
  for (int x = 24; x < 96; x += 24) {
    for (int y = 0; y < 64; y += 16) {
      const int door = y + random.integer(2, 7);
      fill({{x - 6, door, 0}, {x + 7, door + 6, 8}}, -1.0F);
    }
  }
  for (int y = 16; y < 64; y += 16) {
    for (int x = 0; x < 96; x += 24) {
      const int door = x + random.integer(2, 15);
      fill({{door, y - 6, 0}, {door + 6, y + 7, 8}}, -1.0F);
    }
  }
  return map;
}

TEST(CoverPassages, keepsTheDoorsOfManyRoomsOpenWithFewBoxes) {
  Random random(3917);
  for (std::size_t i = 0; i < 8; ++i) {
    SCOPED_TRACE(test::seedNote(i));
    const CuboidMap map = makeStorey(random);
    CoverTask task;
    task.max_boxes = 40;
    task.keep_passages_m.setConstant(5 * map.grid().resolution());
    const auto cover = coverOccupied(map, task, Budget::unlimited());
    EXPECT_TRUE(cover.isFound());
    EXPECT_LE(cover.value.boxes.size(), 40U);
    EXPECT_TRUE(cover.value.lost.empty()) << cover.value.lost.size();
    EXPECT_LT(cover.value.added_volume_m3, 1.6 * cover.value.occupied_volume_m3);
  }
}

TEST(CoverPassages, areInTheBestCoverSoFarWhenItsBudgetIsSpent) {
  Random random(3918);
  const CuboidMap map = makeStorey(random);
  std::set<Cell> occupied;
  map.voxels().forEachIn(kAllCells, [&](const VoxelBrick& brick) {
    forEachCell(brick.brick, brick.voxels.occupied(),
                [&](const Cell& cell) { occupied.insert(cell); });
  });
  CoverTask task;
  task.max_boxes = 40;
  task.keep_passages_m.setConstant(5 * map.grid().resolution());
  int num_without = 0;
  int num_cut = 0;
  for (std::uint64_t max_bricks = 1000;; max_bricks += max_bricks / 4) {
    SCOPED_TRACE(max_bricks);
    QueryLimits limits;
    limits.max_bricks = max_bricks;
    Budget budget(limits);
    const auto cover = coverOccupied(map, task, budget);
    if (cover.isFound()) break;
    EXPECT_EQ(cover.status, AnswerStatus::kBudgetSpent);
    num_without += cover.value.boxes.empty() ? 1 : 0;
    if (cover.value.boxes.empty()) continue;
    ++num_cut;
    EXPECT_LE(cover.value.boxes.size(), task.max_boxes);
    const std::set<Cell> covered = cellsOfBoxes(cover.value.boxes);
    EXPECT_TRUE(std::includes(covered.begin(), covered.end(), occupied.begin(), occupied.end()));
    EXPECT_NEAR(cover.value.added_volume_m3 / map.grid().voxelVolume(),
                static_cast<double>(covered.size() - occupied.size()), 1e-6);
  }
  EXPECT_GT(num_without, 3);
  EXPECT_GT(num_cut, 3);
}

}  // namespace
}  // namespace cuboid_mapping
