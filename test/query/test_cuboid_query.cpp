// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/cuboid_query.h"

#include "support/modelled_map.h"
#include "support/tree_queries.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <tuple>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::Random;

TEST(CuboidQuery, selectsByRegionClassAndEdge) {
  Random random(91);
  std::size_t num_cases = 0;
  std::size_t num_truncated = 0;
  for (int m = 0; m < 5; ++m) {
    const test::ModelledMap model = test::randomMap(random, MapConfig{});
    const std::vector<Cuboid> all = test::allCuboids(model.map);
    for (int i = 0; i < 2000; ++i, ++num_cases) {
      const CellBox region = test::randomBox(random, {{-20, -20, -20}, {20, 20, 20}}, 12);
      CuboidSelection selection;
      selection.filter = test::kFilters[random.index(3)];
      selection.min_edge = random.integer(1, 3);
      selection.is_clipped = random.chance(0.5);
      std::vector<Cuboid> expected;
      for (const Cuboid& cuboid : test::findInBox(all, region, selection.filter)) {
        const Cell size = cuboid.box.size();
        if (std::min({size.x, size.y, size.z}) < selection.min_edge) continue;
        expected.push_back(cuboid);
        if (selection.is_clipped) expected.back().box = intersect(cuboid.box, region);
      }
      selection.max_cuboids = random.chance(0.5) ? expected.size() : random.index(20);
      const auto found = selectCuboids(model.map, region, selection, Budget::unlimited());
      const bool is_truncated = expected.size() > selection.max_cuboids;
      ASSERT_EQ(found.status == AnswerStatus::kBudgetSpent, is_truncated)
          << test::seedNote(num_cases);
      num_truncated += is_truncated ? 1 : 0;
      if (is_truncated) {
        ASSERT_EQ(found.value.size(), selection.max_cuboids) << test::seedNote(num_cases);
      } else {
        ASSERT_EQ(test::sorted(found.value), test::sorted(expected)) << test::seedNote(num_cases);
      }
    }
  }
  EXPECT_EQ(num_cases, 10000U);
  EXPECT_GT(num_truncated, 200U);
}

/// Name of a portal: least corners of its cuboids, and its face.
using PortalName = std::tuple<Cell, Cell, Cell, Cell>;

/// Portals found by checking each pair of neighbouring voxels.
std::vector<PortalName> findPortals(const std::vector<Cuboid>& cuboids, const Cell& passage) {
  std::map<Cell, Cell> owner;
  for (const Cuboid& cuboid : cuboids) {
    test::visitCells(cuboid.box, [&](const Cell& cell) { owner[cell] = cuboid.box.min; });
  }
  std::vector<PortalName> portals;
  for (int axis = 0; axis < 3; ++axis) {
    std::map<std::pair<Cell, Cell>, CellBox> faces;
    for (const auto& [cell, first] : owner) {
      Cell beyond = cell;
      ++beyond[axis];
      const auto second = owner.find(beyond);
      if (second == owner.end() || second->second == first) continue;
      const CellBox part = CellBox::ofCell(beyond);
      const auto [face, is_new] = faces.emplace(std::make_pair(first, second->second), part);
      if (!is_new) face->second = unite(face->second, part);
    }
    for (auto& [pair, face] : faces) {
      face.max[axis] = face.min[axis];
      bool is_passable = true;
      for (int other = 0; other < 3; ++other) {
        is_passable &= other == axis || face.max[other] - face.min[other] >= passage[other];
      }
      if (is_passable) portals.emplace_back(pair.first, pair.second, face.min, face.max);
    }
  }
  std::sort(portals.begin(), portals.end());
  return portals;
}

TEST(FreeGraph, hasTheSharedFacesThatABoxPasses) {
  Random random(92);
  std::size_t num_cases = 0;
  std::size_t num_portals = 0;
  for (int m = 0; m < 5; ++m) {
    const test::ModelledMap model = test::randomMap(random, MapConfig{});
    for (int i = 0; i < 2000; ++i, ++num_cases) {
      const CellBox region = test::randomBox(random, {{-18, -18, -18}, {14, 14, 14}}, 6);
      const Cell passage{random.integer(0, 3), random.integer(0, 3), random.integer(0, 3)};
      const FreeGraph graph = buildFreeGraph(model.map, region, passage, Budget::unlimited()).value;
      CuboidSelection selection;
      selection.filter = CuboidFilter::kFree;
      selection.is_clipped = true;
      ASSERT_EQ(
          test::sorted(graph.cuboids),
          test::sorted(selectCuboids(model.map, region, selection, Budget::unlimited()).value));
      std::vector<PortalName> portals;
      for (const FreeGraph::Portal& portal : graph.portals) {
        portals.emplace_back(graph.cuboids[portal.first].box.min,
                             graph.cuboids[portal.second].box.min, portal.face.min,
                             portal.face.max);
      }
      std::sort(portals.begin(), portals.end());
      ASSERT_EQ(portals, findPortals(graph.cuboids, passage)) << test::seedNote(num_cases);
      num_portals += portals.size();
    }
  }
  EXPECT_EQ(num_cases, 10000U);
  EXPECT_GT(num_portals, 5000U);
}

TEST(FreeGraph, saysWhenThereAreMoreCuboidsThanWanted) {
  CuboidMap map;
  const CellBox region{{6, 0, 0}, {18, 2, 2}};  // In three bricks: three cuboids.
  map.replace(kAllCells, {UniformBox{region, -1.0F}});
  const auto all = buildFreeGraph(map, region, {1, 2, 2}, Budget::unlimited(), 3);
  ASSERT_TRUE(all.isFound());
  EXPECT_EQ(all->portals.size(), 2U);
  EXPECT_TRUE(buildFreeGraph(map, region, {1, 2, 3}, Budget::unlimited(), 3)->portals.empty())
      << "too high by a voxel";
  const auto two = buildFreeGraph(map, region, {}, Budget::unlimited(), 2);
  EXPECT_EQ(two.status, AnswerStatus::kBudgetSpent);
  EXPECT_EQ(two.value.cuboids.size(), 2U);
  EXPECT_LE(two.value.portals.size(), 1U);
}

}  // namespace
}  // namespace cuboid_mapping
