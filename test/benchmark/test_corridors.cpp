// SPDX-License-Identifier: BSD-3-Clause
#include "corridors/leaf_corridor.h"
#include "corridors/voxel_path.h"
#include "octomap_update.h"

#include "support/random.h"

#include "cuboid_mapping/interop/octomap_parity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace cuboid_mapping::bench::test {
namespace {

using cuboid_mapping::test::Random;
using cuboid_mapping::test::seedNote;

constexpr CellBox kRoom{{-3, -3, -1}, {5, 4, 3}};

/// Calls visit(cell) for all cells of a box.
template <typename VisitorT>
void forEachCellOf(const CellBox& box, VisitorT visit) {
  for (std::int32_t z = box.min.z; z < box.max.z; ++z) {
    for (std::int32_t y = box.min.y; y < box.max.y; ++y) {
      for (std::int32_t x = box.min.x; x < box.max.x; ++x) visit(Cell{x, y, z});
    }
  }
}

/// The same free and occupied voxels as a map and as an octree.
struct Scene {
  CuboidMap map{MapConfig()};
  octomap::OcTree octomap = makeOctomap(MapConfig());

  void set(const CellBox& box, float log_odds) {
    map.replace(box, {UniformBox{box, log_odds}});
    forEachCellOf(box, [&](const Cell& cell) { octomap.setNodeValue(toKey(cell), log_odds); });
  }
  [[nodiscard]] bool isFree(const CellBox& box) const {
    bool is_free = true;
    forEachCellOf(box, [&](const Cell& cell) {
      is_free = is_free && map.voxels().at(cell) == Occupancy::kFree;
    });
    return is_free;
  }
};

/// Length of the shortest path, by relaxing all steps until none is shorter; infinity without one.
double shortestLength(const Scene& scene, const Cell& start, const Cell& goal) {
  std::map<Cell, double> lengths{{start, 0.0}};
  for (bool is_shorter = true; is_shorter;) {
    is_shorter = false;
    for (const auto& [from, length] : std::map<Cell, double>(lengths)) {
      forEachCellOf({from - Cell{1, 1, 1}, from + Cell{2, 2, 2}},
                    [&, &from = from, &length = length](const Cell& to) {
                      if (!scene.isFree(unite(CellBox::ofCell(from), CellBox::ofCell(to)))) return;
                      const Cell step = to - from;
                      const double reached =
                          length + std::sqrt(step.x * step.x + step.y * step.y + step.z * step.z);
                      const auto known = lengths.find(to);
                      if (known != lengths.end() && known->second <= reached + 1e-9) return;
                      lengths[to] = reached;
                      is_shorter = true;
                    });
    }
  }
  const auto found = lengths.find(goal);
  return found == lengths.end() ? std::numeric_limits<double>::infinity() : found->second;
}

TEST(VoxelPath, CutsNoCorner) {
  Scene scene;
  scene.set({{0, 0, 0}, {2, 1, 1}}, -1.0F);
  scene.set({{1, 1, 0}, {2, 2, 1}}, -1.0F);
  EXPECT_DOUBLE_EQ(findVoxelPath(scene.map.voxels(), {0, 0, 0}, {1, 1, 0}).length, 2.0);
  scene.set({{0, 1, 0}, {1, 2, 1}}, -1.0F);
  EXPECT_DOUBLE_EQ(findVoxelPath(scene.map.voxels(), {0, 0, 0}, {1, 1, 0}).length, std::sqrt(2.0));
}

TEST(LinkLeaves, LayersJoinLeavesOfAnySize) {
  EXPECT_EQ(linkLeaves({{{0, 0, 0}, {4, 4, 4}}, {{4, 2, 2}, {6, 4, 4}}}),
            (std::vector<CellBox>{
                {{0, 0, 0}, {4, 4, 4}}, {{3, 2, 2}, {5, 4, 4}}, {{4, 2, 2}, {6, 4, 4}}}));
  EXPECT_EQ(linkLeaves({{{0, 0, 0}, {4, 4, 4}}, {{1, 1, -1}, {2, 2, 0}}})[1],
            (CellBox{{1, 1, -1}, {2, 2, 1}}));
}

TEST(Corridors, PathIsTheShortestAndLeavesLeadWhereItDoes) {
  Random random(7);
  int num_found = 0;
  int num_none = 0;
  for (std::size_t i = 0; i < 60; ++i) {
    Scene scene;
    scene.set(kRoom, -1.0F);
    scene.octomap.prune();
    const Cell start = kRoom.min;
    const Cell goal = kRoom.max - Cell{1, 1, 1};
    const double density = random.real(0.2, 0.6);
    forEachCellOf(kRoom, [&](const Cell& cell) {
      if (cell != start && cell != goal && random.chance(density)) {
        scene.set(CellBox::ofCell(cell), 1.0F);
      }
    });
    const double shortest = shortestLength(scene, start, goal);
    const VoxelPath path = findVoxelPath(scene.map.voxels(), start, goal);
    const LeafCorridor corridor = findLeafCorridor(scene.octomap, start, goal);
    ASSERT_EQ(corridor.is_found, std::isfinite(shortest)) << seedNote(i);
    ASSERT_EQ(path.voxels.empty(), !std::isfinite(shortest)) << seedNote(i);
    ++(corridor.is_found ? num_found : num_none);
    if (!corridor.is_found) continue;
    ASSERT_NEAR(path.length, shortest, 1e-6) << seedNote(i);
    ASSERT_TRUE(corridor.leaves.front().contains(start) && corridor.leaves.back().contains(goal));
    const std::vector<CellBox> boxes = linkLeaves(corridor.leaves);
    for (std::size_t box = 0; box < boxes.size(); ++box) {
      ASSERT_TRUE(scene.isFree(boxes[box])) << seedNote(i);
      ASSERT_EQ(countFree(scene.octomap, boxes[box]), boxes[box].numVoxels());
      ASSERT_TRUE(box == 0 || boxes[box].intersects(boxes[box - 1])) << seedNote(i);
    }
  }
  EXPECT_GT(num_found, 10);
  EXPECT_GT(num_none, 10);
}

}  // namespace
}  // namespace cuboid_mapping::bench::test
