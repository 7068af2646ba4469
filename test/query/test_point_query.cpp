// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/point_query.h"

#include "support/modelled_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace cuboid_mapping {
namespace {

using test::ModelledMap;
using test::Random;

/// A map at 1 m with voxel (0 0 0) free and voxel (1 0 0) occupied.
CuboidMap twoVoxels() {
  MapConfig config;
  config.resolution_m = 1.0;
  CuboidMap map(config);
  ScanUpdate update;
  update.bricks.emplace_back();
  test::markBox(update.bricks[0].misses, CellBox::ofCell({0, 0, 0}));
  test::markBox(update.bricks[0].hits, CellBox::ofCell({1, 0, 0}));
  map.apply(update);
  return map;
}

TEST(PointQuery, findsTheCuboidThatHoldsThePoint) {
  const CuboidMap map = twoVoxels();
  const auto cuboid = findCuboid(map, {1.5, 0.5, 0.5});
  ASSERT_TRUE(cuboid.has_value());
  EXPECT_EQ(*cuboid, (Cuboid{CellBox::ofCell({1, 0, 0}), Occupancy::kOccupied}));
  EXPECT_EQ(classifyPoint(map, {1.5, 0.5, 0.5}), Occupancy::kOccupied);
  EXPECT_EQ(classifyPoint(map, {0.5, 0.5, 0.5}), Occupancy::kFree);
}

TEST(PointQuery, givesAFaceToTheVoxelWithTheGreaterCoordinates) {
  const CuboidMap map = twoVoxels();
  EXPECT_EQ(classifyPoint(map, {0.0, 0.5, 0.5}), Occupancy::kFree);
  EXPECT_EQ(classifyPoint(map, {1.0, 0.5, 0.5}), Occupancy::kOccupied);
  EXPECT_EQ(classifyPoint(map, {2.0, 0.5, 0.5}), Occupancy::kUnknown);
  EXPECT_EQ(classifyPoint(map, {1.5, 1.0, 0.5}), Occupancy::kUnknown);
  EXPECT_EQ(classifyPoint(map, {1.5, 0.0, 0.0}), Occupancy::kOccupied);
}

TEST(PointQuery, findsNothingInUnknownSpaceOrOutsideTheGrid) {
  const CuboidMap map = twoVoxels();
  EXPECT_FALSE(findCuboid(map, {3.5, 0.5, 0.5}).has_value());
  EXPECT_FALSE(findCuboidOfCell(map, {3, 0, 0}).has_value());
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double bad : {std::nan(""), kInfinity, -kInfinity, 4294967296.5, -4294967295.5}) {
    const Eigen::Vector3d point(bad, 0.5, 0.5);  // Voxel (0 0 0), if it wrapped around.
    EXPECT_FALSE(findCuboid(map, point).has_value()) << bad;
    EXPECT_EQ(classifyPoint(map, point), Occupancy::kUnknown) << bad;
  }
}

TEST(PointQuery, findsNothingInAnEmptyMap) {
  EXPECT_FALSE(findCuboid(CuboidMap(), Eigen::Vector3d(0.0, 0.0, 0.0)).has_value());
}

TEST(PointQuery, agreesWithTheReferenceEverywhere) {
  Random random(1);
  std::size_t num_cases = 0;
  std::size_t num_by_class[3] = {0, 0, 0};
  for (const Cell& offset : {Cell{0, 0, 0}, Cell{10000000, -10000000, 800}}) {
    MapConfig config;
    config.resolution_m = 0.1;
    config.rtree = {8, 3};
    const ModelledMap model = randomMap(random, config, offset);
    const Eigen::Vector3d center = 0.1 * Eigen::Vector3d(offset.x, offset.y, offset.z);
    for (int i = 0; i < 10000; ++i, ++num_cases) {
      const Eigen::Vector3d point = center + test::randomPoint(random, 1.8);
      const auto cuboid = findCuboid(model.map, point);
      const auto expected = model.voxels.find({static_cast<int>(std::floor(point.x() / 0.1)),
                                               static_cast<int>(std::floor(point.y() / 0.1)),
                                               static_cast<int>(std::floor(point.z() / 0.1))});
      ASSERT_EQ(cuboid.has_value(), expected.has_value()) << test::seedNote(num_cases);
      const Occupancy occupancy = classifyPoint(model.map, point);
      ++num_by_class[static_cast<std::size_t>(occupancy)];
      ASSERT_EQ(occupancy, expected ? classify(*expected) : Occupancy::kUnknown);
      if (!expected) continue;
      ASSERT_EQ(cuboid->occupancy, occupancy) << test::seedNote(num_cases);
      const MetricBox box = model.map.grid().toMetricBox(cuboid->box);
      ASSERT_TRUE((box.min_m.array() <= point.array() + 1e-8).all() &&
                  (point.array() <= box.max_m.array() + 1e-8).all());
    }
  }
  EXPECT_EQ(num_cases, 20000U);
  for (const std::size_t count : num_by_class) EXPECT_GT(count, num_cases / 500);
}

}  // namespace
}  // namespace cuboid_mapping
