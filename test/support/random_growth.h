// SPDX-License-Identifier: BSD-3-Clause
// Growth on random grids, checked voxel by voxel.
#pragma once

#include "cuboid_mapping/fusion/growth_rules.h"
#include "support/growth_scene.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <vector>

namespace cuboid_mapping::test {

inline CellBox boxAt(const Cell& min, const Cell& size) { return {min, min + size}; }

inline std::vector<CellBox> boxesOf(const std::vector<Cuboid>& cuboids) {
  std::vector<CellBox> boxes;
  for (const Cuboid& cuboid : cuboids) boxes.push_back(cuboid.box);
  return boxes;
}

inline std::vector<Cell> cellsIn(const CellBox& box) {
  std::vector<Cell> cells;
  forEachBrick(box, [&](const Cell& brick) {
    const CellBox part = intersect(box, brickBox(brick));
    forEachCell(brick, BrickMask::ofBox(part), [&](const Cell& cell) { cells.push_back(cell); });
  });
  return cells;
}

/// Whether an expansion of a stable cuboid would succeed, checked voxel by voxel.
inline bool canExpand(const Cuboid& cuboid, const std::vector<Cuboid>& all,
                      const GrowthScene& scene) {
  if (!scene.isStable(cuboid.box.min)) return false;
  for (const SearchDirection direction : paperDirections(cuboid.box.size())) {
    const CellBox slab = slabOf(cuboid.box, direction, 1);
    double tiled = 0.0;
    for (const Cuboid& other : all) {
      const bool is_fusible = slab.contains(other.box) && scene.isStable(other.box.min) &&
                              other.occupancy == cuboid.occupancy;
      if (is_fusible) tiled += other.box.numVoxels();
    }
    if (tiled == slab.numVoxels()) return true;
  }
  return false;
}

/// A grid of stable and unstable boxes and voxels around the corner of eight bricks.
inline void paintRandomly(Random& random, GrowthScene& scene) {
  const CellBox area{{-3, -3, -2}, {4, 3, 2}};
  const float values[] = {scene.stableFree(), scene.stableFree(), scene.stableOccupied(),
                          scene.unstable()};
  const int num_boxes = random.integer(1, 6);
  for (int i = 0; i < num_boxes; ++i) {
    Cell min{random.integer(-3, 3), random.integer(-3, 2), random.integer(-2, 1)};
    const CellBox box{min,
                      min + Cell{random.integer(1, 7), random.integer(1, 6), random.integer(1, 4)}};
    scene.set(intersect(box, area), values[random.index(4)]);
  }
  for (const Cell& cell : cellsIn(area)) {
    if (random.chance(0.08)) scene.set(CellBox::ofCell(cell), values[random.index(4)]);
  }
}

/// Whether cuboids are disjoint, and cover the known voxels with their classes; cuboids of several voxels
/// are wholly stable.
inline testing::AssertionResult agree(const std::vector<Cuboid>& cuboids,
                                      const GrowthScene& scene) {
  std::set<Cell> covered;
  for (const Cuboid& cuboid : cuboids) {
    for (const Cell& cell : cellsIn(cuboid.box)) {
      if (!covered.insert(cell).second) {
        return testing::AssertionFailure() << cell << " is in two cuboids";
      }
      if (scene.voxels().at(cell) != cuboid.occupancy) {
        return testing::AssertionFailure() << cuboid << " has another class at " << cell;
      }
      if (cuboid.box.numVoxels() > 1.0 && !scene.isStable(cell)) {
        return testing::AssertionFailure() << cuboid << " is not stable at " << cell;
      }
    }
  }
  const double num_voxels = scene.voxels().numFreeVoxels() + scene.voxels().numOccupiedVoxels();
  if (static_cast<double>(covered.size()) != num_voxels) {
    return testing::AssertionFailure() << "a voxel is in no cuboid";
  }
  return testing::AssertionSuccess();
}

/// Grows cells of random grids; no cuboid can expand by a voxel afterwards. @param make_config  Rules with steps of one
/// voxel.
inline void checkRandomGrowth(std::size_t cases,
                              const std::function<GrowthConfig(Random&)>& make_config) {
  std::size_t num_cases = 0;
  std::size_t num_fused = 0;
  for (std::size_t i = 0; i < cases; ++i) {
    Random random(4000 + i);
    GrowthScene scene(make_config(random));
    paintRandomly(random, scene);
    const std::vector<Cuboid> before = scene.fuse({});
    ASSERT_TRUE(agree(before, scene)) << seedNote(i);
    std::vector<Cell> starters;
    for (const Cuboid& cuboid : before) starters.push_back(cuboid.box.min);
    random.shuffle(starters);
    const std::vector<Cuboid> after = scene.fuse(starters);
    ASSERT_TRUE(agree(after, scene)) << seedNote(i);
    for (const Cuboid& cuboid : after) {
      ASSERT_FALSE(canExpand(cuboid, after, scene)) << cuboid << seedNote(i);
    }
    num_fused += before.size() - after.size();
    ++num_cases;
  }
  EXPECT_EQ(num_cases, cases);
  EXPECT_GT(num_fused, 20 * cases);
}

}  // namespace cuboid_mapping::test
