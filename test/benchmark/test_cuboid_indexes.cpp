// SPDX-License-Identifier: BSD-3-Clause
#include "indexes/cuboid_index.h"
#include "indexes/index_queries.h"

#include "support/random.h"

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/cuboid_query.h"
#include "cuboid_mapping/query/point_query.h"
#include "cuboid_mapping/rtree/traversal.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <vector>

namespace cuboid_mapping::bench::test {
namespace {

using cuboid_mapping::test::Random;

Cell cellNear(Random& random, int distance) {
  return {random.integer(-distance, distance), random.integer(-distance, distance),
          random.integer(-distance / 4, distance / 4)};
}

/// Clusters of voxels of both classes with void space between them, so that a search of the nearest passes
/// empty bricks.
CuboidMap makeClusters(Random& random) {
  CuboidMap map(MapConfig{});
  for (int cluster = 0; cluster < 30; ++cluster) {
    const Cell corner = cellNear(random, 150);
    std::map<Cell, BrickUpdate> bricks;
    for (int voxel = 0; voxel < 600; ++voxel) {
      const Cell offset{random.integer(0, 11), random.integer(0, 11), random.integer(0, 11)};
      const Cell cell = corner + offset;
      BrickUpdate& brick = bricks[brickOf(cell)];
      brick.brick = brickOf(cell);
      (random.integer(0, 2) == 0 ? brick.hits : brick.misses).set(voxelIndex(cell));
    }
    ScanUpdate update;
    for (const auto& [cell, brick] : bricks) update.bricks.push_back(brick);
    map.apply(update);
  }
  return map;
}

std::vector<Cuboid> cuboidsIn(const CuboidIndex& index, const CellBox& box, CuboidFilter filter) {
  std::vector<Cuboid> cuboids;
  index.visitBox(box, filter, [&cuboids](const Cuboid& cuboid) {
    cuboids.push_back(cuboid);
    return Visit::kContinue;
  });
  std::sort(cuboids.begin(), cuboids.end(),
            [](const Cuboid& a, const Cuboid& b) { return a.box.min < b.box.min; });
  return cuboids;
}

TEST(CuboidIndexes, FindWhatThereIsInBoxesAtPointsAndNearThem) {
  Random random(1);
  const CuboidMap map = makeClusters(random);
  const std::size_t num_cuboids = countCuboids(map).total();
  const auto indexes = makeIndexes(map);
  ASSERT_EQ(indexes.size(), 3U);
  std::vector<Cuboid> all;
  visitAll(map, CuboidFilter::kAll, [&all](const Cuboid& cuboid) {
    all.push_back(cuboid);
    return Visit::kContinue;
  });
  for (int i = 0; i < 200; ++i) {
    const Cell min = cellNear(random, 180);
    const Cell size{random.integer(1, 120), random.integer(1, 120), random.integer(1, 120)};
    const CellBox box{min, min + size};
    const Eigen::Vector3d point = toVector(min) + Eigen::Vector3d(0.3, 0.0, 0.7);
    std::vector<double> distances;
    for (const Cuboid& cuboid : all) {
      if (cuboid.isOccupied()) distances.push_back(distanceTo(cuboid.box, point));
    }
    std::sort(distances.begin(), distances.end());
    distances.resize(5);
    const auto inside = cuboidsIn(*indexes.back(), box, CuboidFilter::kFree);
    for (const auto& index : indexes) {
      SCOPED_TRACE(index->name());
      EXPECT_EQ(cuboidsIn(*index, kAllCells, CuboidFilter::kAll).size(), num_cuboids);
      EXPECT_EQ(cuboidsIn(*index, box, CuboidFilter::kFree), inside);
      EXPECT_EQ(index->find(min), findCuboidOfCell(map, min));
      EXPECT_EQ(index->nearest(point, 5, CuboidFilter::kOccupied), distances);
    }
  }
}

TEST(CuboidIndexes, PortalsAreThoseOfTheFreeGraph) {
  Random random(2);
  const CuboidMap map = makeClusters(random);
  (void)countCuboids(map);  // Divides the bricks.
  const CellBox region{{-90, -80, -30}, {100, 70, 40}};
  const FreeGraph graph = buildFreeGraph(map, region, {0, 0, 0}, Budget::unlimited()).value;
  ASSERT_GT(graph.portals.size(), 100U);
  const auto indexes = makeIndexes(map);
  for (const auto& index : indexes) {
    EXPECT_EQ(findPortals(*index, region).count, graph.portals.size()) << index->name();
    EXPECT_EQ(findPortals(*index, region).sum, findPortals(*indexes.front(), region).sum);
  }
}

}  // namespace
}  // namespace cuboid_mapping::bench::test
