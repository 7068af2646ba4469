// SPDX-License-Identifier: BSD-3-Clause
// projected_map, compared with single voxels.
#include "cuboid_mapping/ros/octomap_server/projected_map.h"

#include "cuboid_mapping/ros/middleware/grid_publisher.h"
#include "ros/octomap_server/boxes_map.h"
#include "ros/parameter_groups.h"
#include "support/snapshots.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::CellBox;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::MapConfig;
using cuboid_mapping::Occupancy;
using cuboid_mapping::UniformBox;
using cuboid_mapping::test::Random;
using cuboid_mapping::test::seedNote;

TEST(OctomapServerParameters, arrive) {
  const auto read = readInto<OctomapServerParameters>({{"occupancy_min_z", -1.5},
                                                       {"occupancy_max_z", 2.5},
                                                       {"min_x_size", 10.0},
                                                       {"min_y_size", 20.0},
                                                       {"filter_speckles", true}});
  EXPECT_EQ(read.occupancy_min_z_m, -1.5);
  EXPECT_EQ(read.occupancy_max_z_m, 2.5);
  EXPECT_EQ(read.min_x_size_m, 10.0);
  EXPECT_EQ(read.min_y_size_m, 20.0);
  EXPECT_TRUE(read.filter_speckles);
}

nav_msgs::OccupancyGrid gridOf(const ProjectedMap& projection) {
  FarTiles far;
  return projection.makeGrid({}, 0.5, far);
}

/// Expected value of a grid's cell, from reading every voxel.
std::int8_t projectVoxels(const CuboidMap& map, std::int32_t x, std::int32_t y, std::int32_t min_z,
                          std::int32_t max_z) {
  std::int8_t value = -1;
  for (std::int32_t z = min_z; z < max_z; ++z) {
    const Occupancy occupancy = map.voxels().at({x, y, z});
    if (occupancy == Occupancy::kOccupied) return 100;
    if (occupancy == Occupancy::kFree) value = 0;
  }
  return value;
}

TEST(ProjectedMap, isWhatEveryVoxelSaysAfterEveryChange) {
  Random random(92);
  MapConfig config;
  config.resolution_m = 0.5;
  CuboidMap map(config);
  OctomapServerParameters parameters;
  parameters.occupancy_min_z_m = -4.0;
  parameters.occupancy_max_z_m = 4.0;
  ProjectedMap projection(parameters);
  std::size_t num_cells = 0;
  for (int i = 0; i < 40; ++i) {
    if (i == 20) {
      projection.noteChanges(map.clear());
    } else if (i % 7 == 6) {
      const CellBox box =
          cuboid_mapping::test::randomBox(random, {{-20, -20, -20}, {20, 20, 20}}, 15);
      projection.noteChanges(map.replace(box, std::vector<UniformBox>{}));
    } else {
      projection.noteChanges(
          map.apply(cuboid_mapping::test::randomUpdate(random, {{-3, -3, -2}, {3, 3, 2}}, 5)));
    }
    projection.update(map);
    const auto grid = gridOf(projection);
    const auto x0 = static_cast<std::int32_t>(std::lround(grid.info.origin.position.x / 0.5));
    const auto y0 = static_cast<std::int32_t>(std::lround(grid.info.origin.position.y / 0.5));
    ASSERT_EQ(grid.data.size(), grid.info.width * grid.info.height);
    for (std::int32_t y = -30; y < 30; ++y) {
      for (std::int32_t x = -30; x < 30; ++x) {
        const bool is_inside = x >= x0 && x < x0 + static_cast<std::int32_t>(grid.info.width) &&
                               y >= y0 && y < y0 + static_cast<std::int32_t>(grid.info.height);
        const auto at =
            static_cast<std::size_t>((y - y0)) * grid.info.width + static_cast<std::size_t>(x - x0);
        const std::int8_t value = is_inside ? grid.data[at] : std::int8_t{-1};
        ASSERT_EQ(value, projectVoxels(map, x, y, -8, 8)) << seedNote(i) << ' ' << x << ' ' << y;
        num_cells += value >= 0 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(num_cells, 5000U);
}

TEST(ProjectedMap, isAtLeastSoWideAndEmptyWithoutAnything) {
  const CuboidMap map = makeMap({});
  OctomapServerParameters parameters;
  ProjectedMap empty(parameters);
  empty.update(map);
  EXPECT_EQ(gridOf(empty).data.size(), 0U);
  parameters.min_x_size_m = 3.0;
  parameters.min_y_size_m = 2.0;
  ProjectedMap wide(parameters);
  wide.update(map);
  const auto grid = gridOf(wide);
  // The cells with both ends are included, as in octomap_server.
  EXPECT_EQ(grid.info.width, 7U);
  EXPECT_EQ(grid.info.height, 5U);
  EXPECT_EQ(grid.info.origin.position.x, -1.5);
  EXPECT_EQ(std::count(grid.data.begin(), grid.data.end(), -1), 35);
}

TEST(ProjectedMap, isRefusedWhereItsLeastSizeIsTooLarge) {
  OctomapServerParameters parameters;
  parameters.min_x_size_m = 5000.0;
  parameters.min_y_size_m = 4000.0;
  parameters.max_projection_mb = 81;
  const CuboidMap map = makeMap({});
  ProjectedMap largest(parameters);
  largest.update(map);
  EXPECT_EQ(gridOf(largest).data.size(), 10001U * 8001U);
  parameters.max_projection_mb = 80;
  ProjectedMap larger(parameters);
  larger.update(map);
  EXPECT_THROW((void)gridOf(larger), std::length_error);
}

TEST(ProjectedMap, leavesOutAFarReturnAndSaysWhereItIs) {
  OctomapServerParameters parameters;
  parameters.max_projection_mb = 1;
  const CuboidMap map = makeMap(
      {{{{100, 100, 0}, {140, 140, 2}}, 1.0F}, {CellBox::ofCell({60000, -40000, 0}), 1.0F}});
  ProjectedMap projection(parameters);
  projection.update(map);
  FarTiles far;
  const auto grid = projection.makeGrid({}, 0.5, far);
  EXPECT_EQ(grid.info.width, 40U);
  EXPECT_EQ(grid.info.height, 40U);
  EXPECT_EQ(std::count(grid.data.begin(), grid.data.end(), 100), 1600);
  EXPECT_EQ(far.count, 1U);
  EXPECT_EQ(far.farthest_m, Eigen::Vector2d(30000.0, -20000.0));
}

/// Applies an update as costmap_2d's static layer does, which keeps the size of the whole map.
void applyUpdate(const map_msgs::OccupancyGridUpdate& update, nav_msgs::OccupancyGrid& grid) {
  ASSERT_EQ(update.header.frame_id, grid.header.frame_id);
  ASSERT_EQ(update.data.size(), std::size_t{update.width} * update.height);
  std::size_t next = 0;
  for (std::size_t y = 0; y < update.height; ++y) {
    for (std::size_t x = 0; x < update.width; ++x) {
      const std::size_t row = static_cast<std::size_t>(update.y) + y;
      grid.data.at(row * grid.info.width + static_cast<std::size_t>(update.x) + x) =
          update.data[next++];
    }
  }
}

TEST(ProjectedMap, isKeptUpWithUpdatesAsAStaticLayerTakesThem) {
  Random random(94);
  MapConfig config;
  config.resolution_m = 0.5;
  CuboidMap map(config);
  OctomapServerParameters parameters;
  parameters.min_x_size_m = parameters.min_y_size_m = 30.0;  // No cloud reaches farther.
  ProjectedMap projection(parameters);
  nav_msgs::OccupancyGrid layer;
  std::size_t num_sent = 0;
  std::size_t num_cells = 0;
  for (int i = 0; i < 200; ++i) {
    projection.noteChanges(
        map.apply(cuboid_mapping::test::randomUpdate(random, {{-3, -3, -2}, {2, 2, 2}}, 1)));
    projection.update(map);
    const auto grid = gridOf(projection);
    if (i == 0) layer = grid;
    const auto update = findGridUpdate(layer, grid);
    ASSERT_TRUE(update);
    applyUpdate(*update, layer);
    ASSERT_EQ(layer.data, grid.data) << seedNote(static_cast<std::size_t>(i));
    num_sent += update->data.empty() ? 0 : 1;
    num_cells += update->data.size();
    EXPECT_TRUE(findGridUpdate(layer, grid)->data.empty());
  }
  EXPECT_GT(num_sent, 50U);
  EXPECT_LT(num_cells, num_sent * layer.data.size() / 10)
      << "rectangles are as small as they can be";
}

TEST(ProjectedMap, cannotBeUpdatedWhenItsPlaceHasChanged) {
  nav_msgs::OccupancyGrid grid;
  grid.header.frame_id = "map";
  grid.info.width = grid.info.height = 2;
  grid.data.assign(4, 0);
  EXPECT_TRUE(findGridUpdate(grid, grid));
  auto other = grid;
  other.info.origin.position.y = 0.5;
  EXPECT_FALSE(findGridUpdate(grid, other));
  other = grid;
  other.header.frame_id = "odom";
  EXPECT_FALSE(findGridUpdate(grid, other));
  other = grid;
  other.info.height = 3;
  other.data.assign(6, 0);
  EXPECT_FALSE(findGridUpdate(grid, other));
}

}  // namespace
}  // namespace cuboid_mapping_ros
