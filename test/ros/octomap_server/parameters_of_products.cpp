// SPDX-License-Identifier: BSD-3-Clause
// Effects of octomap_server's parameters for published topics in the running node, with the values
// of octomap_parameters.test.
#include "cuboid_mapping/ros/conversions/marker_colors.h"
#include "ros/octomap_server/server_node.h"
#include "tools/run_program.h"

#include <algorithm>
#include <array>

namespace cuboid_mapping_ros::test {
namespace {

using nav_msgs::OccupancyGrid;
using sensor_msgs::PointCloud2;
using visualization_msgs::MarkerArray;

/// Two voxels side by side at each of three heights, and a single one.
struct Pairs {
  Points low{{1.05, 0.05, -0.45}, {1.15, 0.05, -0.45}};
  Points middle{{1.05, 0.05, 0.55}, {1.15, 0.05, 0.55}};
  Points high{{1.05, 0.05, 1.25}, {1.15, 0.05, 1.25}};
  Points speckle{{-1.05, 0.05, 0.55}};

  [[nodiscard]] Points all() const {
    Points points = speckle;
    for (const Points& pair : {low, middle, high}) {
      points.insert(points.end(), pair.begin(), pair.end());
    }
    return points;
  }
};

TEST(Products, LeaveOutHeightsAndSpeckles) {
  const Pairs pairs;
  ServerNode products("products");
  products.insert(pairs.all());
  EXPECT_EQ(products.occupied(), cellsOf(pairs.all())) << "nothing is left out of octrees";
  EXPECT_EQ(cellsOf(pointsOf(products.show<PointCloud2>("octomap_point_cloud_centers"))),
            cellsOf(pairs.middle));
  EXPECT_EQ(cellsOf(pointsOf(products.show<MarkerArray>("occupied_cells_vis_array"))),
            cellsOf(pairs.middle));
  EXPECT_EQ(cellsOf(products.show<OccupancyGrid>("projected_map"), 100),
            (std::set<Cell>{{10, 0, 0}, {11, 0, 0}}));
  std::size_t num_free = 0;
  for (const auto& marker : products.show<MarkerArray>("free_cells_vis_array").markers) {
    for (const auto& point : marker.points) {
      EXPECT_GT(point.z + 0.5 * marker.scale.z, 0.2);
      EXPECT_LT(point.z - 0.5 * marker.scale.z, 0.8);
      ++num_free;
    }
  }
  EXPECT_GT(num_free, 5U);
}

TEST(Products, ShowEverythingByDefault) {
  const Pairs pairs;
  ServerNode plain("plain");
  plain.insert(pairs.all());
  EXPECT_EQ(cellsOf(pointsOf(plain.show<PointCloud2>("octomap_point_cloud_centers"))),
            cellsOf(pairs.all()));
  EXPECT_EQ(cellsOf(pointsOf(plain.show<MarkerArray>("occupied_cells_vis_array"))),
            cellsOf(pairs.all()));
  EXPECT_EQ(cellsOf(plain.show<OccupancyGrid>("projected_map"), 100),
            (std::set<Cell>{{10, 0, 0}, {11, 0, 0}, {-11, 0, 0}}));
  EXPECT_GT(pointsOf(plain.show<MarkerArray>("free_cells_vis_array")).size(), 10U);
}

TEST(Products, TheProjectionIsAsWideAsAsked) {
  ServerNode products("products");
  products.insert(Pairs().all());
  const auto wide = products.show<OccupancyGrid>("projected_map");
  EXPECT_EQ(wide.info.width, 201U) << "as octomap_server: with the cells of both ends";
  EXPECT_EQ(wide.info.height, 101U);
  EXPECT_NEAR(wide.info.origin.position.x, -10.0, 1e-6);
  EXPECT_NEAR(wide.info.origin.position.y, -5.0, 1e-6);
  ServerNode plain("plain");
  plain.insert(Pairs().all());
  const auto grid = plain.show<OccupancyGrid>("projected_map");
  EXPECT_EQ(grid.info.width, 23U);
  EXPECT_EQ(grid.info.height, 1U);
}

void expectColor(const std_msgs::ColorRGBA& color, const std::array<float, 4>& rgba) {
  EXPECT_NEAR(color.r, rgba[0], 1e-6);
  EXPECT_NEAR(color.g, rgba[1], 1e-6);
  EXPECT_NEAR(color.b, rgba[2], 1e-6);
  EXPECT_NEAR(color.a, rgba[3], 1e-6);
}

TEST(Colors, FollowTheHeightAndFreeSpaceIsGreen) {
  ServerNode colors("colors");  // Has other colours, which are ignored.
  colors.insert(Pairs().all());
  std::size_t count = 0;
  // Known voxels reach from -0.5 to 1.3 m.
  for (const auto& marker : colors.show<MarkerArray>("occupied_cells_vis_array").markers) {
    ASSERT_EQ(marker.colors.size(), marker.points.size());
    for (std::size_t i = 0; i < marker.points.size(); ++i, ++count) {
      const auto expected = toHueColor((1.3 - marker.points[i].z) / 1.8 * 0.8);
      expectColor(marker.colors[i], {expected.r, expected.g, expected.b, 1.0F});
    }
  }
  EXPECT_EQ(count, 7U);
  for (const auto& marker : colors.show<MarkerArray>("free_cells_vis_array").markers) {
    EXPECT_TRUE(marker.colors.empty());
    expectColor(marker.color, {0.0F, 1.0F, 0.0F, 1.0F});
  }
}

TEST(ColoredMap, IsTakenWithAWarningAndWithoutEffect) {
  ServerNode colors("colors");
  colors.insert(Pairs().all());
  EXPECT_EQ(colors.show<PointCloud2>("octomap_point_cloud_centers").fields.size(), 3U);
  cuboid_mapping::test::Program node(
      {CUBOID_MAPPING_NODE, "__ns:=warned", "_colored_map:=true", "_color/r:=0.5"});
  EXPECT_TRUE(ros::service::waitForService("/warned/octomap_full", ros::Duration(kDeadline_s)));
  node.send(SIGINT);
  const auto end = node.finish();
  for (const std::string text :
       {"colored_map: is true and is ignored", "color: is a group of keys and is ignored"}) {
    EXPECT_NE((end.out + end.err).find(text), std::string::npos) << end.err;
  }
}

/// Sends clouds until a subscriber gets a message.
template <typename MessageT>
void insertUntilHeard(ServerNode& node, const TopicProbe<MessageT>& listener) {
  double distance_m = 1.05;
  EXPECT_TRUE(waitFor([&] {
    node.insert({pointAlong(1, distance_m += 0.1)});  // a change every time
    return listener.count() > 0;
  }));
}

TEST(Topics, GiveLateListenersTheMapAtOnce) {
  ServerNode plain("plain");
  plain.insert({pointAlong(0, 1.05)});
  // The last of the topics: once it is published, nothing of this change remains.
  (void)plain.show<OccupancyGrid>("projected_map");
  TopicProbe<octomap_msgs::Octomap> listener(plain.topic("octomap_full"));
  EXPECT_TRUE(waitFor([&] { return listener.count() > 0; })) << "though nothing has changed";
  EXPECT_EQ(listener.first().header.stamp, plain.stamp());
}

TEST(CompressMapAndIncrementalProjection, ChangeNothing) {
  std::vector<std::string> octrees;
  std::vector<OccupancyGrid> grids;
  for (const std::string name : {"plain", "late"}) {
    ServerNode node(name);
    TopicProbe<OccupancyGrid> grid(node.topic("projected_map"));
    insertUntilHeard(node, grid);
    node.reset();
    for (const double half_size_m : {1.0, 2.0}) {
      node.insert(makeRoom({half_size_m, half_size_m, 1.0}));
      ASSERT_TRUE(grid.waitForMessage(
          [&](const auto& message) { return message.header.stamp == node.stamp(); }));
    }
    octrees.push_back(bytesOf(node.octomap()));
    grids.push_back(grid.last());
  }
  EXPECT_GT(octrees[0].size(), 1000U);
  EXPECT_TRUE(octrees[0] == octrees[1]);
  EXPECT_GT(cellsOf(grids[0], 100).size(), 1000U);
  EXPECT_EQ(grids[0].info.width, grids[1].info.width);
  EXPECT_EQ(grids[0].data, grids[1].data);
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
