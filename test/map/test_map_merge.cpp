// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/map_merge.h"

#include "cuboid_mapping/voxels/uniform_boxes.h"
#include "support/random.h"
#include "support/snapshots.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <set>
#include <stdexcept>

namespace cuboid_mapping {
namespace {

using test::Random;
using test::randomSnapshot;
using test::seedNote;
using test::voxelsOf;

using Voxels = std::map<Cell, float>;

/// The 24 rotations that map axes to axes.
std::vector<Eigen::Matrix3d> makeWholeTurns() {
  std::vector<Eigen::Matrix3d> turns;
  for (int i = 0; i < 27 * 8; ++i) {
    Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
    const int columns[] = {i % 3, i / 3 % 3, i / 9 % 3};
    for (int row = 0; row < 3; ++row) turn(row, columns[row]) = (i / 27 >> row & 1) != 0 ? -1 : 1;
    if (std::abs(turn.determinant() - 1.0) < 0.1) turns.push_back(turn);
  }
  return turns;
}

Eigen::Vector3d centerOf(const Cell& cell) { return {cell.x + 0.5, cell.y + 0.5, cell.z + 0.5}; }

Cell cellOf(const Eigen::Vector3d& point) {
  return {static_cast<std::int32_t>(std::floor(point.x())),
          static_cast<std::int32_t>(std::floor(point.y())),
          static_cast<std::int32_t>(std::floor(point.z()))};
}

TEST(MoveMap, isExactForTurnsOfAxesAndShiftsByWholeVoxels) {
  const auto turns = makeWholeTurns();
  ASSERT_EQ(turns.size(), 24U);
  for (std::size_t i = 0; i < turns.size(); ++i) {
    Random random(i);
    MapSnapshot map = randomSnapshot(random);
    map.locked = {{{41, 0, 0}, {42, 1, 500}}, {{-7, 1, 2}, {40, 3, 4}}};  // By their least cells.
    const MapSnapshot before = map;
    const Cell shift{random.integer(-50, 50), random.integer(-50, 50), random.integer(-50, 50)};
    Eigen::Isometry3d T_target_map = Eigen::Isometry3d::Identity();
    // Rotations from degrees in a program: whole numbers up to 1e-16.
    T_target_map.linear() =
        turns[i] * Eigen::AngleAxisd(2e-10, Eigen::Vector3d::UnitX()).toRotationMatrix();
    T_target_map.translation() =
        map.resolution_m * Eigen::Vector3d(shift.x + 1e-8, shift.y, shift.z);
    EXPECT_TRUE(moveMap(T_target_map, map)) << seedNote(i);
    Voxels expected;
    for (const auto& [cell, log_odds] : voxelsOf(before.bricks)) {
      expected[cellOf(turns[i] * centerOf(cell)) + shift] = log_odds;
    }
    EXPECT_EQ(voxelsOf(map.bricks), expected) << seedNote(i);
    EXPECT_FALSE(findFault(map)) << seedNote(i);
    const Cell corner = cellOf(turns[i] * centerOf({41, 0, 499})) + shift;
    EXPECT_EQ(map.locked.size(), 2U) << seedNote(i);
    EXPECT_TRUE(map.locked[0].contains(corner) || map.locked[1].contains(corner)) << seedNote(i);
    EXPECT_TRUE(moveMap(T_target_map.inverse(), map, 3)) << seedNote(i);
    EXPECT_EQ(voxelsOf(map.bricks), voxelsOf(before.bricks)) << seedNote(i);
    EXPECT_EQ(map.locked, before.locked) << seedNote(i);
  }
}

TEST(MoveMap, givesEachVoxelWhatItsCentreWasInElsewhere) {
  for (std::size_t i = 0; i < 20; ++i) {
    Random random(i);
    MapSnapshot map = randomSnapshot(random);
    map.locked = {CellBox::ofCell({3, 4, 5}), {{4, 4, 5}, {9, 9, 9}}};
    const Voxels before = voxelsOf(map.bricks);
    const Eigen::Vector3d axis =
        Eigen::Vector3d(random.real(0.1, 1.0), random.real(-1.0, 1.0), random.real(-1.0, 1.0));
    Eigen::Isometry3d T_target_map = Eigen::Isometry3d::Identity();
    T_target_map.linear() =
        Eigen::AngleAxisd(random.real(-3.0, 3.0), axis.normalized()).toRotationMatrix();
    T_target_map.translation() =
        map.resolution_m * Eigen::Vector3d(random.real(-9.0, 9.0), 0.4, -3.0);
    EXPECT_FALSE(moveMap(T_target_map, map)) << seedNote(i);
    const Cell locked =
        cellOf(T_target_map * (map.resolution_m * centerOf({3, 4, 5})) / map.resolution_m);
    EXPECT_TRUE(std::any_of(map.locked.begin(), map.locked.end(), [&](const CellBox& box) {
      return box.contains(locked);
    })) << seedNote(i);
    EXPECT_FALSE(findFault(map)) << seedNote(i);
    const Voxels after = voxelsOf(map.bricks);
    EXPECT_FALSE(findFault(map)) << seedNote(i);
    CellBox around{after.begin()->first, after.begin()->first};
    for (const auto& [cell, log_odds] : after) around = unite(around, CellBox::ofCell(cell));
    std::size_t num_known = 0;
    const Eigen::Isometry3d T_map_target = T_target_map.inverse();
    for (Cell cell = around.min; cell.z < around.max.z; ++cell.z) {
      for (cell.y = around.min.y; cell.y < around.max.y; ++cell.y) {
        for (cell.x = around.min.x; cell.x < around.max.x; ++cell.x) {
          const Eigen::Vector3d from =
              T_map_target * (map.resolution_m * centerOf(cell)) / map.resolution_m;
          const Eigen::Vector3d in_voxel = from.array() - from.array().floor();
          // Near a border, rounding decides.
          if (in_voxel.minCoeff() < 1e-6 || in_voxel.maxCoeff() > 1.0 - 1e-6) continue;
          const auto was = before.find(cellOf(from));
          const auto is = after.find(cell);
          ASSERT_EQ(is == after.end(), was == before.end()) << cell << seedNote(i);
          if (is == after.end()) continue;
          EXPECT_EQ(is->second, was->second) << cell << seedNote(i);
          ++num_known;
        }
      }
    }
    EXPECT_GT(num_known, after.size() * 9 / 10) << seedNote(i);
  }
}

/// Whether a path of cells that are not in the map leads by faces from the origin to 30 voxels away.
bool isOpen(const Voxels& voxels) {
  std::deque<Cell> next{{0, 0, 0}};
  std::set<Cell> seen{{0, 0, 0}};
  while (!next.empty()) {
    const Cell cell = next.front();
    next.pop_front();
    if (std::abs(cell.x) > 30) return true;
    for (int side = 0; side < 6; ++side) {
      Cell neighbour = cell;
      neighbour[side / 2] += side % 2 == 0 ? 1 : -1;
      if (voxels.count(neighbour) == 0 && seen.insert(neighbour).second) next.push_back(neighbour);
    }
  }
  return false;
}

TEST(MoveMap, keepsWallsOfOneVoxelClosed) {
  std::vector<UniformBox> walls;
  for (const CellBox& wall :
       subtract({{-10, -10, -10}, {11, 11, 11}}, {{-9, -9, -9}, {10, 10, 10}})) {
    walls.push_back({wall, 1.0F});
  }
  MapSnapshot room;
  room.bricks = toBricks(walls).bricks;
  for (std::size_t i = 0; i < 30; ++i) {
    Random random(i);
    MapSnapshot map = room;
    const Eigen::Vector3d axis(random.real(0.1, 1.0), random.real(-1.0, 1.0),
                               random.real(-1.0, 1.0));
    Eigen::Isometry3d T_target_map = Eigen::Isometry3d::Identity();
    T_target_map.linear() =
        Eigen::AngleAxisd(random.real(-3.0, 3.0), axis.normalized()).toRotationMatrix();
    (void)moveMap(T_target_map, map);
    EXPECT_FALSE(isOpen(voxelsOf(map.bricks))) << seedNote(i);
  }
  room.bricks.pop_back();
  EXPECT_TRUE(isOpen(voxelsOf(room.bricks))) << "a hole is found";
}

TEST(MoveMap, refusesWhatIsNoTurnAndShiftAndLeavesTheMap) {
  Random random(4);
  MapSnapshot map = randomSnapshot(random);
  const Voxels before = voxelsOf(map.bricks);
  Eigen::Isometry3d mirror = Eigen::Isometry3d::Identity();
  mirror.linear()(0, 0) = -1.0;
  Eigen::Isometry3d stretch = Eigen::Isometry3d::Identity();
  stretch.linear()(1, 1) = 1.1;
  const Eigen::Isometry3d nowhere(
      Eigen::Translation3d(std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0));
  const Eigen::Isometry3d far(Eigen::Translation3d(0.0, 1e9 * map.resolution_m, 1.1e9));
  for (const Eigen::Isometry3d& T_target_map : {mirror, stretch, nowhere, far}) {
    EXPECT_THROW((void)moveMap(T_target_map, map), std::invalid_argument);
    EXPECT_EQ(voxelsOf(map.bricks), before);
  }
}

TEST(MoveMap, tellsHowFarItIsAndIsGivenUpByItsListener) {
  Random random(5);
  MapSnapshot map = randomSnapshot(random);
  const auto before = voxelsOf(map.bricks);
  const Eigen::Isometry3d T_target_map(Eigen::Translation3d(map.resolution_m, 0.0, 0.0));
  EXPECT_THROW(moveMap(T_target_map, map, 2,
                       [](std::uint64_t, std::uint64_t) { throw std::domain_error("given up"); }),
               std::domain_error);
  EXPECT_EQ(voxelsOf(map.bricks), before);
  std::uint64_t num_told = 0;
  moveMap(T_target_map, map, 2, [&](std::uint64_t done, std::uint64_t total) {
    EXPECT_EQ(done, ++num_told);
    EXPECT_LE(done, total);
  });
  EXPECT_GT(num_told, 0U);
}

TEST(MergeMaps, followsItsRuleInEachVoxel) {
  for (std::size_t i = 0; i < 30; ++i) {
    Random random(i);
    MapSnapshot first = randomSnapshot(random);
    MapSnapshot second = randomSnapshot(random, {8 * random.integer(-2, 2), 0, 8});
    second.resolution_m = first.resolution_m;
    const SensorModel model(first.sensor_model);
    for (const MergeRule rule : {MergeRule::kSum, MergeRule::kLater, MergeRule::kOccupied}) {
      Voxels expected = voxelsOf(first.bricks);
      MapOverlap counts;
      counts.only_in_first = static_cast<double>(expected.size());
      for (const auto& [cell, b] : voxelsOf(second.bricks)) {
        const auto found = expected.find(cell);
        if (found == expected.end()) {
          expected[cell] = b;
          ++counts.only_in_second;
          continue;
        }
        float& a = found->second;
        ++counts.known_to_both;
        --counts.only_in_first;
        if ((a < 0.0F) != (b < 0.0F)) ++counts.other_class;
        a = rule == MergeRule::kSum ? a + b : (rule == MergeRule::kLater ? b : std::max(a, b));
      }
      for (auto& [cell, value] : expected) value = std::clamp(value, model.min(), model.max());
      MapSnapshot merged = first;
      merged.cuboids = {Cuboid{}};
      const MapOverlap overlap = mergeMaps(merged, second, rule);
      EXPECT_TRUE(merged.cuboids.empty()) << "they were those of the first map";
      EXPECT_EQ(voxelsOf(merged.bricks), expected) << toString(rule) << seedNote(i);
      EXPECT_FALSE(findFault(merged)) << seedNote(i);
      EXPECT_EQ(overlap.known_to_both, counts.known_to_both) << seedNote(i);
      EXPECT_EQ(overlap.other_class, counts.other_class) << seedNote(i);
      EXPECT_EQ(overlap.only_in_first, counts.only_in_first) << seedNote(i);
      EXPECT_EQ(overlap.only_in_second, counts.only_in_second) << seedNote(i);
      EXPECT_GT(counts.known_to_both, 0.0) << seedNote(i);
      EXPECT_EQ(mergeRuleOfName(toString(rule)), rule);
    }
  }
  EXPECT_FALSE(mergeRuleOfName("mean"));
}

TEST(MergeMaps, refusesAnotherResolution) {
  Random random(5);
  MapSnapshot first = randomSnapshot(random);
  MapSnapshot second = first;
  second.resolution_m *= 1.5;
  EXPECT_THROW((void)mergeMaps(first, second, MergeRule::kSum), std::invalid_argument);
}

}  // namespace
}  // namespace cuboid_mapping
