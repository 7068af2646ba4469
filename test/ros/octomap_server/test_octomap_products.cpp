// SPDX-License-Identifier: BSD-3-Clause
// Messages of octomap_server, compared with OctoMap itself and with single voxels.
#include "cuboid_mapping/ros/octomap_server/octomap_products.h"

#include "cuboid_mapping/interop/octomap_parity.h"
#include "cuboid_mapping/ros/octomap_server/octomap_server_feature.h"
#include "ros/octomap_server/boxes_map.h"
#include "support/snapshots.h"

#include <gtest/gtest.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <array>
#include <cmath>
#include <set>
#include <sstream>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::Cell;
using cuboid_mapping::CellBox;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::MapConfig;
using cuboid_mapping::MapSnapshot;
using cuboid_mapping::Occupancy;
using cuboid_mapping::OctreeKind;
using cuboid_mapping::UniformBox;
using cuboid_mapping::VoxelBrick;
using cuboid_mapping::test::Random;
using cuboid_mapping::test::seedNote;
using cuboid_mapping::test::visitCells;

std::unique_ptr<octomap::OcTree> toTree(const octomap_msgs::Octomap& message) {
  auto tree = std::make_unique<octomap::OcTree>(message.resolution);
  std::stringstream data;
  data.write(reinterpret_cast<const char*>(message.data.data()),
             static_cast<std::streamsize>(message.data.size()));
  if (message.data.empty()) return tree;
  if (message.binary != 0) {
    tree->readBinaryData(data);
  } else {
    tree->readData(data);
  }
  return tree;
}

TEST(OctomapMessages, areTheTreeThatOctomapServerWouldSend) {
  Random random(91);
  MapConfig config;
  config.resolution_m = 0.1;
  cuboid_mapping::test::ScanShape shape;
  shape.num_points = 400;
  shape.num_no_returns = 0;
  for (int i = 0; i < 10; ++i) {
    CuboidMap map(config);
    cuboid_mapping::ScanUpdater updater(map.grid(), 2.5);
    octomap::OcTree theirs = cuboid_mapping::makeOctomap(config);
    for (int cloud = 0; cloud < 6; ++cloud) {
      const auto scan = randomScan(random, shape);
      map.apply(updater.compute(scan));
      insertIntoOctomap(scan, 2.5, theirs);
    }
    double num_left_out = -1.0;
    std_msgs::Header header;
    header.frame_id = "map";
    const MapSnapshot snapshot = takeSnapshot(map, "map");
    const auto full = toOctomapMessage(snapshot, OctreeKind::kFull, header, num_left_out);
    EXPECT_EQ(num_left_out, 0.0);
    EXPECT_EQ(full.id, "OcTree");
    EXPECT_EQ(full.header.frame_id, "map");
    const auto tree = toTree(full);
    EXPECT_TRUE(compareWithOctomap(map, *tree).isExact());
    EXPECT_TRUE(compareWithOctomap(map, theirs).isExact());
    theirs.updateInnerOccupancy();
    for (auto leaf = theirs.begin_leafs(); leaf != theirs.end_leafs(); ++leaf) {
      const auto* node = tree->search(leaf.getKey());
      ASSERT_NE(node, nullptr) << seedNote(i);
      ASSERT_NEAR(node->getLogOdds(), leaf->getLogOdds(), 1e-3) << seedNote(i);
    }
    // OctoMap writes the same bytes again.
    std::ostringstream again;
    tree->writeData(again);
    EXPECT_TRUE(again.str() == std::string(full.data.begin(), full.data.end()));
    const auto binary = toOctomapMessage(snapshot, OctreeKind::kBinary, header, num_left_out);
    const auto classes = toTree(binary);
    std::ostringstream binary_again;
    classes->writeBinaryData(binary_again);
    EXPECT_TRUE(binary_again.str() == std::string(binary.data.begin(), binary.data.end()));
    for (auto leaf = theirs.begin_leafs(); leaf != theirs.end_leafs(); ++leaf) {
      const auto* node = classes->search(leaf.getKey());
      ASSERT_NE(node, nullptr);
      ASSERT_EQ(classes->isNodeOccupied(node), theirs.isNodeOccupied(*leaf));
    }
  }
}

TEST(OctomapProducts, leaveSpecklesOutWhenAsked) {
  // Two occupied voxels that touch in a corner, one alone, one alone beside free space.
  const CuboidMap map = makeMap({{CellBox::ofCell({0, 0, 0}), 1.0F},
                                 {CellBox::ofCell({1, 1, 1}), 1.0F},
                                 {CellBox::ofCell({7, 7, 7}), 1.0F},
                                 {CellBox::ofCell({20, 0, 0}), 1.0F},
                                 {{{21, 0, 0}, {24, 1, 1}}, -1.0F},
                                 {{{40, 0, 0}, {42, 1, 1}}, 1.0F}});
  std::vector<VoxelBrick> bricks = takeSnapshot(map, "").bricks;
  removeSpeckles(map.voxels(), bricks);
  std::set<Cell> left;
  for (const auto& [cell, log_odds] : cuboid_mapping::test::voxelsOf(bricks)) left.insert(cell);
  EXPECT_EQ(left,
            (std::set<Cell>{
                {0, 0, 0}, {1, 1, 1}, {21, 0, 0}, {22, 0, 0}, {23, 0, 0}, {40, 0, 0}, {41, 0, 0}}));
}

TEST(OctomapProducts, knowSpecklesFromNeighboursInOtherBricks) {
  Random random(94);
  std::size_t num_speckles = 0;
  for (int i = 0; i < 20; ++i) {
    MapConfig config;
    CuboidMap map(config);
    for (int update = 0; update < 3; ++update) {
      map.apply(cuboid_mapping::test::randomUpdate(random, {{-1, -1, -1}, {1, 1, 1}}, 8));
    }
    std::map<Cell, float> expected = cuboid_mapping::test::voxelsOf(map);
    const auto is_speckle = [&map](const Cell& cell) {
      int num_occupied = 0;
      visitCells({cell - Cell{1, 1, 1}, cell + Cell{2, 2, 2}}, [&](const Cell& other) {
        num_occupied += map.voxels().at(other) == Occupancy::kOccupied ? 1 : 0;
      });
      return map.voxels().at(cell) == Occupancy::kOccupied && num_occupied == 1;
    };
    for (auto voxel = expected.begin(); voxel != expected.end();) {
      num_speckles += is_speckle(voxel->first) ? 1 : 0;
      voxel = is_speckle(voxel->first) ? expected.erase(voxel) : std::next(voxel);
    }
    std::vector<VoxelBrick> bricks = takeSnapshot(map, "").bricks;
    removeSpeckles(map.voxels(), bricks);
    ASSERT_EQ(cuboid_mapping::test::voxelsOf(bricks), expected) << seedNote(i);
  }
  EXPECT_GT(num_speckles, 20U);
}

std::vector<visualization_msgs::Marker> markersOf(const MapSnapshot& snapshot,
                                                  const OctomapServerParameters& parameters,
                                                  const std_msgs::Header& header) {
  double num_left_out = -1.0;
  auto markers =
      toCellMarkers(snapshot, ShownCells::kOccupied, parameters, header, num_left_out).markers;
  EXPECT_EQ(num_left_out, 0.0);
  return markers;
}

/// The map is far away, for example in UTM.
TEST(OctomapProducts, areExactFarAway) {
  const Cell far{1000001, 10000003, 5};
  const MapSnapshot snapshot = takeSnapshot(
      makeMap({{CellBox::ofCell(far), 1.0F}, {CellBox::ofCell(far + Cell{9, 0, 0}), 1.0F}}), "");
  const Eigen::Vector3d center = 0.5 * Eigen::Vector3d(far.x + 0.5, far.y + 0.5, far.z + 0.5);
  OctomapServerParameters parameters;
  const ShownLeaves shown =
      computeShownLeaves(snapshot, ShownCells::kOccupied, parameters, OctreeKind::kFull);
  ASSERT_EQ(shown.leaves.size(), 2U);
  EXPECT_EQ(shown.num_left_out, 0.0);
  sensor_msgs::PointCloud2 cloud = toCenters(shown.leaves, 0.5, {});
  EXPECT_EQ(cloud.fields.at(0).datatype, sensor_msgs::PointField::FLOAT64);
  const sensor_msgs::PointCloud2Iterator<double> xyz(cloud, "x");
  EXPECT_EQ(Eigen::Vector3d(xyz[0], xyz[1], xyz[2]), center);
  const auto marker = markersOf(snapshot, parameters, {}).at(16);
  ASSERT_EQ(marker.points.size(), 2U);
  EXPECT_LT(std::abs(marker.points[0].y), 1024.0) << "what is left fits into floats";
  EXPECT_EQ(marker.points[0].x + marker.pose.position.x, center.x());
  EXPECT_EQ(marker.points[0].y + marker.pose.position.y, center.y());
  EXPECT_EQ(marker.points[0].z + marker.pose.position.z, center.z());
}

TEST(OctomapProducts, countsTheVoxelsThatAnOctreeHasNoRoomFor) {
  const MapSnapshot snapshot = takeSnapshot(
      makeMap({{CellBox::ofCell({0, 0, 0}), 1.0F}, {CellBox::ofCell({100000, 0, 0}), 1.0F}}), "");
  const ShownLeaves shown =
      computeShownLeaves(snapshot, ShownCells::kOccupied, {}, OctreeKind::kFull);
  EXPECT_GE(shown.num_left_out, 1.0);
  EXPECT_EQ(static_cast<double>(shown.leaves.size()) + shown.num_left_out, 2.0);
}

TEST(OctomapProducts, pointsAreThoseOfLeavesOfOneLogOdds) {
  // As in octomap_server, eight voxels of one class and two log-odds are no leaf.
  const MapSnapshot snapshot =
      takeSnapshot(makeMap({{{{0, 0, 0}, {2, 2, 1}}, 1.0F}, {{{0, 0, 1}, {2, 2, 2}}, 0.5F}}), "");
  OctomapServerParameters parameters;
  const auto count = [&](OctreeKind kind) {
    return computeShownLeaves(snapshot, ShownCells::kOccupied, parameters, kind).leaves.size();
  };
  EXPECT_EQ(count(OctreeKind::kFull), 8U);
  EXPECT_EQ(count(OctreeKind::kBinary), 1U);
}

TEST(OctomapProducts, showCellsOfOneClassBetweenTwoHeights) {
  const MapSnapshot snapshot = takeSnapshot(makeMap({{{{0, 0, 0}, {8, 8, 8}}, 1.0F},
                                                     {{{8, 0, 0}, {9, 1, 1}}, 1.0F},
                                                     {{{0, 0, 16}, {2, 2, 18}}, 1.0F},
                                                     {{{16, 0, 0}, {24, 8, 8}}, -1.0F}}),
                                            "");
  OctomapServerParameters parameters;
  const auto shown = [&](ShownCells cells) {
    return computeShownLeaves(snapshot, cells, parameters, OctreeKind::kBinary).leaves;
  };
  EXPECT_EQ(shown(ShownCells::kOccupied).size(), 3U);
  EXPECT_EQ(shown(ShownCells::kFree).size(), 1U);
  parameters.occupancy_max_z_m = 8.0;
  const auto low = shown(ShownCells::kOccupied);
  EXPECT_EQ(low.size(), 2U);
  parameters.occupancy_min_z_m = 0.5;
  double volume = 0.0;
  for (const auto& leaf : shown(ShownCells::kOccupied)) {
    EXPECT_GE(leaf.min.z, 1) << "what reaches out of the heights is divided";
    volume += std::pow(leaf.edge(), 3);
  }
  EXPECT_EQ(volume, 8 * 8 * 7);
  parameters.occupancy_min_z_m = -1.0;

  std_msgs::Header header;
  header.frame_id = "map";
  const auto markers = markersOf(snapshot, parameters, header);
  ASSERT_EQ(markers.size(), 17U);
  for (std::size_t depth = 0; depth < markers.size(); ++depth) {
    const auto& marker = markers[depth];
    EXPECT_EQ(marker.id, static_cast<int>(depth));
    EXPECT_EQ(marker.ns, "map");
    EXPECT_EQ(marker.header.frame_id, "map");
    EXPECT_EQ(marker.points.size(), depth == 13 || depth == 16 ? 1U : 0U) << depth;
    EXPECT_EQ(marker.action, marker.points.empty() ? visualization_msgs::Marker::DELETE
                                                   : visualization_msgs::Marker::ADD)
        << depth;
    EXPECT_EQ(marker.colors.size(), marker.points.size());
    EXPECT_EQ(marker.color.b, 1.0F);
  }
  EXPECT_EQ(markers[13].scale.x, 4.0);
  EXPECT_EQ(markers[13].points[0].x, 2.0);
  EXPECT_EQ(markers[16].points[0].x, 4.25);
  sensor_msgs::PointCloud2 cloud = toCenters(low, 0.5, header);
  EXPECT_EQ(cloud.width * cloud.height, 2U);
  const sensor_msgs::PointCloud2Iterator<float> x(cloud, "x");
  EXPECT_EQ(*x, 2.0F);
}

/// Colour of a height as octomap_server computes it: OctomapServer::publishAll, heightMapColor.
std_msgs::ColorRGBA theirHeightColor(double z_m, double min_m, double max_m, double color_factor) {
  double h = (1.0 - std::min(std::max((z_m - min_m) / (max_m - min_m), 0.0), 1.0)) * color_factor;
  h -= std::floor(h);
  h *= 6;
  const int i = static_cast<int>(std::floor(h));
  const double f = (i & 1) != 0 ? h - i : 1 - (h - i);
  const auto n = static_cast<float>(1 - f);
  const std::array<std::array<float, 3>, 6> by_sixth{
      {{1, n, 0}, {n, 1, 0}, {0, 1, n}, {0, n, 1}, {n, 0, 1}, {1, 0, n}}};
  const auto& rgb = by_sixth[static_cast<std::size_t>(i % 6)];
  std_msgs::ColorRGBA color;
  color.r = rgb[0];
  color.g = rgb[1];
  color.b = rgb[2];
  color.a = 1.0F;
  return color;
}

TEST(OctomapProducts, heightsHaveTheColoursOfOctomapServer) {
  // Ten occupied voxels one above the other, and free space that reaches further up and down.
  std::vector<UniformBox> boxes{{{{5, 0, -7}, {6, 1, 20}}, -1.0F}};
  for (std::int32_t z = 0; z < 20; z += 2) boxes.push_back({CellBox::ofCell({0, 0, z}), 1.0F});
  const MapSnapshot snapshot = takeSnapshot(makeMap(boxes), "");
  constexpr double kColorFactor = 0.8;  // Its default.
  double num_left_out = 0.0;
  const auto markers = toCellMarkers(snapshot, ShownCells::kOccupied, {}, {}, num_left_out).markers;
  ASSERT_EQ(markers[16].colors.size(), 10U);
  for (std::size_t i = 0; i < markers[16].colors.size(); ++i) {
    const double z_m = markers[16].points[i].z;
    const auto expected = theirHeightColor(z_m, -3.5, 10.0, kColorFactor);
    EXPECT_NEAR(markers[16].colors[i].r, expected.r, 1e-6) << z_m;
    EXPECT_NEAR(markers[16].colors[i].g, expected.g, 1e-6) << z_m;
    EXPECT_NEAR(markers[16].colors[i].b, expected.b, 1e-6) << z_m;
    EXPECT_EQ(markers[16].colors[i].a, 1.0F);
  }
}

TEST(ClearBox, freesKnownVoxelsInsideTheBoxAndNothingElse) {
  Random random(93);
  MapConfig config;
  config.resolution_m = 0.1;
  for (int i = 0; i < 10; ++i) {
    GuardedMap map(config);
    for (int update = 0; update < 6; ++update) {
      const auto bricks = cuboid_mapping::test::randomUpdate(random, {{-2, -2, -2}, {2, 2, 2}}, 8);
      map.change(ros::Time(7.0), [&](CuboidMap& content) { return content.apply(bricks); });
    }
    const auto voxels_of = [&map] {
      return map.read([](const CuboidMap& content, const ros::Time&) {
        return cuboid_mapping::test::voxelsOf(content);
      });
    };
    auto expected = voxels_of();
    const CellBox box =
        cuboid_mapping::test::randomBox(random, {{-12, -12, -12}, {12, 12, 12}}, 12);
    const float free = cuboid_mapping::SensorModel(config.sensor_model).min();
    for (auto& [cell, log_odds] : expected) {
      if (box.contains(cell)) log_odds = free;
    }
    const tf2::BufferCore tf;
    EXPECT_EQ(clearBox({map, "map", tf}, map.grid().toMetricBox(box)), "");
    EXPECT_EQ(voxels_of(), expected) << seedNote(i);
    map.read([](const CuboidMap&, const ros::Time& stamp) {
      EXPECT_EQ(stamp, ros::Time(7.0));
      return 0;
    });
  }
}

TEST(ClearBox, refusesBoxesThatAreNone) {
  GuardedMap map({});
  const tf2::BufferCore tf;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(clearBox({map, "map", tf}, {{0, 0, 0}, {-nan, 1, 1}})
                .rfind("box from (0, 0, 0) to (NaN, 1, 1): ", 0),
            0U);
  EXPECT_NE(clearBox({map, "map", tf}, {{1, 0, 0}, {0, 1, 1}}), "");
  EXPECT_NE(clearBox({map, "map", tf}, {{0, 0, 0}, {1, 1, 1e15}}), "");
  EXPECT_EQ(clearBox({map, "map", tf}, {{0, 0, 0}, {0, 1, 1}}), "") << "a box without thickness";
}

}  // namespace
}  // namespace cuboid_mapping_ros
