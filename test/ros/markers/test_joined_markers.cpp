// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/ros/markers/marker_cache.h"
#include "ros/marker_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::CuboidMap;
using cuboid_mapping::UniformBox;
using test::MarkerViewer;
using test::ShownCube;

std::vector<ShownCube> showJoined(const std::vector<UniformBox>& boxes) {
  CuboidMap map;
  map.replace(cuboid_mapping::kAllCells, boxes);
  NodeParameters parameters;
  parameters.markers_are_joined = true;
  MarkerCache cache(cuboid_mapping::Grid(0.1), makeStyle(parameters, CuboidFilter::kOccupied));
  MarkerViewer viewer;
  viewer.apply(cache.update(map, {}));
  return viewer.cubes();
}

TEST(JoinedMarkers, AWallIsOneCubeWhereItIsWholeBricksLong) {
  const auto cubes = showJoined({{{{5, 0, 0}, {45, 1, 64}}, 1.0F}});
  ASSERT_EQ(cubes.size(), 1U);
  EXPECT_EQ(cubes[0].geometry_um, (std::array<long, 6>{2'500'000, 50'000, 3'200'000,  //
                                                       4'000'000, 100'000, 6'400'000}));
}

TEST(JoinedMarkers, OtherLengthsAreCutOnceAlongEachAxis) {
  const auto cubes = showJoined({{{{5, 10, 0}, {50, 11, 12}}, 1.0F}});
  std::vector<std::array<long, 2>> lengths;
  for (const ShownCube& cube : cubes) lengths.push_back({cube.geometry_um[3], cube.geometry_um[5]});
  std::sort(lengths.begin(), lengths.end());
  EXPECT_EQ(
      lengths,
      (std::vector<std::array<long, 2>>{
          {500'000, 400'000}, {500'000, 800'000}, {4'000'000, 400'000}, {4'000'000, 800'000}}));
}

TEST(JoinedMarkers, EndAtChunksOf64Voxels) {
  EXPECT_EQ(showJoined({{{{0, 0, 0}, {128, 1, 1}}, 1.0F}}).size(), 2U);
}

}  // namespace
}  // namespace cuboid_mapping_ros
