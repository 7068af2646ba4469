// SPDX-License-Identifier: BSD-3-Clause
// The running node as replacement of octomap_server: its topics and services, and files of maps.
#include "cuboid_mapping/LoadMap.h"
#include "cuboid_mapping/SaveMap.h"
#include "cuboid_mapping/ros/conversions/marker_colors.h"
#include "ros/node_probe.h"
#include "ros/octomap_server/octomap_probe.h"
#include "tools/run_program.h"

#include <dynamic_reconfigure/Reconfigure.h>
#include <map_msgs/OccupancyGridUpdate.h>
#include <nav_msgs/OccupancyGrid.h>
#include <topic_tools/shape_shifter.h>
#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::OctreeContent;
using cuboid_mapping::test::TemporaryFolder;

/// Voxels known from a room of 4 x 4 x 2 m: its inside, and a layer of one voxel at each face.
constexpr double kFreeVoxels = 40 * 40 * 20;
constexpr double kOccupiedVoxels = 2 * 40 * 40 + 4 * 40 * 20;

/// Share of the voxels of a box that are known, or occupied, in an octree.
struct BoxShares {
  double known;
  double occupied;
};

BoxShares sharesOf(const OctreeContent& content, const cuboid_mapping::CellBox& box) {
  BoxShares shares{0.0, 0.0};
  for (const auto& leaf : content.leaves) {
    const double share = intersect(leaf.box, box).numVoxels() / box.numVoxels();
    shares.known += share;
    if (leaf.log_odds >= 0.0F) shares.occupied += share;
  }
  return shares;
}

class OctomapServerTest : public NodeTest {
 protected:
  void SetUp() override {
    NodeTest::SetUp();
    const Eigen::Vector3d origin_map(0.05, 0.05, 0.05);  // the middle of a voxel
    publishStaticTf(makeTransform("map", "lidar", makeTranslation(0.05, 0.05, 0.05)));
    std::vector<Eigen::Vector3d> points = makeRoom({2.0, 2.0, 1.0});
    for (Eigen::Vector3d& point : points) point -= origin_map;
    cloud_publisher_.publish(makeCloud("lidar", ros::Time(101.5), points));
    ASSERT_TRUE(waitForInserted(1));
  }
};

TEST_F(OctomapServerTest, OctreesHoldTheRoom) {
  for (const std::string name : {"/octomap_full", "/octomap_binary"}) {
    TopicProbe<octomap_msgs::Octomap> topic(name);
    ASSERT_TRUE(topic.waitForMessage([](const auto& message) {
      return countVoxels(contentOf(message), true) == kOccupiedVoxels;
    })) << name;
    const octomap_msgs::Octomap& message = topic.last();
    EXPECT_EQ(message.binary, name == "/octomap_binary" ? 1 : 0);
    EXPECT_EQ(message.id, "OcTree");
    EXPECT_EQ(message.resolution, 0.1);
    EXPECT_EQ(message.header.frame_id, "map");
    EXPECT_EQ(message.header.stamp, ros::Time(101.5));
    EXPECT_EQ(countVoxels(contentOf(message), false), kFreeVoxels);
    EXPECT_TRUE(bytesOf(callOctomap(name)) == bytesOf(message)) << "the service gives the same";
  }
}

TEST_F(OctomapServerTest, OctreesAreThoseOfOctomapMsgsOnTheWire) {
  TopicProbe<topic_tools::ShapeShifter> topic("/octomap_full");
  ASSERT_TRUE(topic.waitForMessage([](const auto&) { return true; }));
  EXPECT_EQ(topic.last().getDataType(), "octomap_msgs/Octomap");
  EXPECT_EQ(topic.last().getMD5Sum(), "9a45536b45c5e409cd49f04bb2d9999f");
  EXPECT_NE(topic.last().getMessageDefinition().find("int8[] data"), std::string::npos);
}

TEST_F(OctomapServerTest, MarkersPointsAndGridShowTheRoomBelowTheGreatestHeight) {
  // occupancy_max_z is 0.5: 15 layers of the walls, and the floor.
  constexpr double kShown = 40 * 40 + 4 * 40 * 15;
  const auto volume = [](const visualization_msgs::MarkerArray& array) {
    double voxels = 0.0;
    for (const auto& marker : array.markers) {
      voxels += static_cast<double>(marker.points.size()) * std::pow(marker.scale.x / 0.1, 3);
    }
    return std::lround(voxels);
  };
  TopicProbe<visualization_msgs::MarkerArray> occupied("/occupied_cells_vis_array");
  EXPECT_TRUE(occupied.waitForMessage([&](const auto& array) { return volume(array) == kShown; }));
  EXPECT_EQ(occupied.last().markers.size(), 17U);
  TopicProbe<visualization_msgs::MarkerArray> free("/free_cells_vis_array");
  EXPECT_TRUE(free.waitForMessage([&](const auto& array) {
    return volume(array) >= 40 * 40 * 15 && volume(array) <= kFreeVoxels;
  }));
  TopicProbe<sensor_msgs::PointCloud2> centers("/octomap_point_cloud_centers");
  EXPECT_TRUE(centers.waitForMessage([&](const auto& cloud) { return cloud.width > 1000; }));
  TopicProbe<nav_msgs::OccupancyGrid> grid("/projected_map");
  ASSERT_TRUE(grid.waitForMessage([](const auto& message) { return !message.data.empty(); }));
  const nav_msgs::OccupancyGrid& map = grid.last();
  EXPECT_EQ(map.info.width, 42U);
  EXPECT_EQ(map.info.height, 42U);
  EXPECT_NEAR(map.info.origin.position.x, -2.1, 1e-6);
  EXPECT_EQ(std::count(map.data.begin(), map.data.end(), 100), 40 * 40 + 4 * 40)
      << "the floor is occupied, too";
  EXPECT_EQ(std::count(map.data.begin(), map.data.end(), -1), 4) << "the corners";
}

TEST_F(OctomapServerTest, ResetEmptiesEveryTopic) {
  TopicProbe<octomap_msgs::Octomap> full("/octomap_full");
  TopicProbe<octomap_msgs::Octomap> binary("/octomap_binary");
  TopicProbe<visualization_msgs::MarkerArray> occupied("/occupied_cells_vis_array");
  TopicProbe<sensor_msgs::PointCloud2> centers("/octomap_point_cloud_centers");
  TopicProbe<nav_msgs::OccupancyGrid> grid("/projected_map");
  const auto has_data = [](const auto& message) { return !message.data.empty(); };
  ASSERT_TRUE(full.waitForMessage(has_data));
  ASSERT_TRUE(binary.waitForMessage(has_data));
  ASSERT_TRUE(centers.waitForMessage(has_data));
  ASSERT_TRUE(grid.waitForMessage(has_data));
  reset();
  const auto is_empty = [](const auto& message) { return message.data.empty(); };
  EXPECT_TRUE(full.waitForMessage(is_empty));
  EXPECT_TRUE(binary.waitForMessage(is_empty));
  EXPECT_TRUE(centers.waitForMessage(is_empty));
  EXPECT_TRUE(grid.waitForMessage(is_empty));
  EXPECT_TRUE(occupied.waitForMessage([](const auto& array) {
    return std::all_of(array.markers.begin(), array.markers.end(), [](const auto& marker) {
      return marker.action == visualization_msgs::Marker::DELETE;
    });
  }));
}

TEST_F(OctomapServerTest, ProjectedMapIsSentWholeOnceAndThenInUpdates) {
  std::optional<TopicProbe<map_msgs::OccupancyGridUpdate>> updates("/projected_map_updates");
  ASSERT_TRUE(updates->waitForConnection());
  TopicProbe<nav_msgs::OccupancyGrid> grid("/projected_map");
  ASSERT_TRUE(grid.waitForMessage([](const auto& message) { return !message.data.empty(); }));
  // The grid to which a first update refers; it is sent whole before.
  const auto clear = [](double min_m, double max_m) {
    octomap_msgs::BoundingBoxQuery request;
    request.request.min = tf2::toMsg(Eigen::Vector3d(min_m, min_m, -2.5));
    request.request.max = tf2::toMsg(Eigen::Vector3d(max_m, max_m, 2.5));
    return callService(std::string(kNode) + "/clear_bbx", request);
  };
  ASSERT_TRUE(clear(0.05, 0.15));
  ASSERT_TRUE(grid.waitForMessage(
      [](const auto& message) { return message.data[21 * message.info.width + 21] == 0; }));
  const int num_whole = grid.count();
  ASSERT_TRUE(clear(0.61, 0.99));
  ASSERT_TRUE(updates->waitForMessage([](const auto& update) { return update.width == 4; }));
  EXPECT_EQ(updates->last().height, 4U);
  EXPECT_EQ(std::count(updates->last().data.begin(), updates->last().data.end(), 0), 16);
  EXPECT_EQ(updates->last().header.frame_id, grid.last().header.frame_id);
  EXPECT_EQ(grid.count(), num_whole);
  updates.reset();
  double side_m = 0.2;
  ASSERT_TRUE(waitFor([&] {  // Waits until the node knows.
    side_m += 0.1;
    EXPECT_TRUE(clear(-side_m, side_m));
    return grid.count() > num_whole;
  }));
}

TEST_F(OctomapServerTest, ClearBoxFreesWhatIsKnownInItAndNoMore) {
  octomap_msgs::BoundingBoxQuery clear;
  clear.request.min = tf2::toMsg(Eigen::Vector3d(1.95, -0.45, -0.45));
  clear.request.max = tf2::toMsg(Eigen::Vector3d(2.35, 0.45, 0.45));
  ASSERT_TRUE(callService(std::string(kNode) + "/clear_bbx", clear));
  const OctreeContent content = contentOf(callOctomap("/octomap_full"));
  // Voxels 19 to 23 along x and -5 to 4 along y and z are in the box; the wall is voxel 20.
  const BoxShares wall = sharesOf(content, {{20, -5, -5}, {21, 5, 5}});
  EXPECT_NEAR(wall.known, 1.0, 1e-9);
  EXPECT_EQ(wall.occupied, 0.0);
  EXPECT_EQ(sharesOf(content, {{21, -5, -5}, {30, 5, 5}}).known, 0.0) << "behind it";
  EXPECT_NEAR(sharesOf(content, {{20, 6, -5}, {21, 20, 5}}).occupied, 1.0, 1e-9) << "beside it";
  EXPECT_EQ(countVoxels(content, true), kOccupiedVoxels - 100);
  EXPECT_EQ(countVoxels(content, false), kFreeVoxels + 100);
  std::swap(clear.request.min, clear.request.max);
  EXPECT_FALSE(ros::service::call(std::string(kNode) + "/clear_bbx", clear)) << "min above max";
}

TEST_F(OctomapServerTest, ListenersWhoComeLateGetTheMap) {
  std::string bytes;
  {
    TopicProbe<octomap_msgs::Octomap> first("/octomap_full");
    ASSERT_TRUE(first.waitForMessage(
        [](const auto& message) { return countVoxels(contentOf(message), true) > 0.0; }));
    bytes = bytesOf(first.last());
  }
  // It starts after the first one ends: two subscribers in one process share a connection.
  ASSERT_TRUE(diagnostics_.waitForNextReport());
  const TopicProbe<octomap_msgs::Octomap> second("/octomap_full");
  ASSERT_TRUE(waitFor([&] { return second.count() > 0; })) << "though nothing has changed";
  EXPECT_TRUE(bytesOf(second.last()) == bytes);
}

TEST_F(OctomapServerTest, NothingIsBuiltWithoutListeners) {
  const std::string key = "octomap_server messages built";
  int num_clouds = 0;
  // Larger and larger rooms, so that every cloud changes the classes of voxels.
  const auto publish_change = [&] {
    const double half_size_m = 1.5 + kResolution_m * ++num_clouds;
    const ros::Time stamp(200.0 + num_clouds);
    cloud_publisher_.publish(makeCloud("lidar", stamp, makeRoom({half_size_m, half_size_m, 1.0})));
    return stamp;
  };
  // A topic that octomap_server does not have shows that the node has published.
  TopicProbe<visualization_msgs::MarkerArray> others("/occupied_cuboids");
  const auto is_none_built = [&] {
    const long num_before = diagnostics_.status().number(key);
    for (int i = 0; i < 3; ++i) {
      const ros::Time stamp = publish_change();
      EXPECT_TRUE(others.waitForMessage(
          [&](const auto& array) { return array.markers.front().header.stamp == stamp; }));
    }
    EXPECT_TRUE(diagnostics_.waitForNextReport());
    return diagnostics_.status().number(key) == num_before;
  };
  EXPECT_TRUE(waitFor(is_none_built)) << "once the listeners of earlier tests have gone";

  TopicProbe<octomap_msgs::Octomap> full("/octomap_full");
  ASSERT_TRUE(full.waitForMessage([](const auto&) { return true; }));
  startCounting();
  const int num_before = full.count();
  const ros::Time stamp = publish_change();
  ASSERT_TRUE(
      full.waitForMessage([&](const auto& message) { return message.header.stamp == stamp; }));
  EXPECT_TRUE(waitFor([&] { return countNew(key) == full.count() - num_before; }))
      << countNew(key) << " built, and the only listener has got " << full.count() - num_before;
}

/// Sends changes. @return The value of one of the numbers in force.
double reconfigure(const std::vector<std::pair<std::string, double>>& numbers,
                   const std::string& asked) {
  dynamic_reconfigure::Reconfigure change;
  for (const auto& [name, value] : numbers) {
    change.request.config.doubles.emplace_back();
    change.request.config.doubles.back().name = name;
    change.request.config.doubles.back().value = value;
  }
  EXPECT_TRUE(callService(std::string(kNode) + "/set_parameters", change));
  for (const auto& number : change.response.config.doubles) {
    if (number.name == asked) return number.value;
  }
  ADD_FAILURE() << asked << " is not in the answer";
  return 0.0;
}

TEST_F(OctomapServerTest, ParametersChangeWhileItRuns) {
  TopicProbe<sensor_msgs::PointCloud2> centers("/octomap_point_cloud_centers");
  ASSERT_TRUE(centers.waitForMessage([](const auto& cloud) { return cloud.width > 0; }));
  const auto num_below = centers.last().width;
  EXPECT_EQ(reconfigure({{"occupancy_max_z", 50.0}}, "occupancy_max_z"), 50.0);
  EXPECT_TRUE(centers.waitForMessage([&](const auto& cloud) { return cloud.width > num_below; }))
      << "though no cloud came";
  EXPECT_EQ(reconfigure({{"occupancy_max_z", 0.5}}, "occupancy_max_z"), 0.5);
  EXPECT_TRUE(centers.waitForMessage([&](const auto& cloud) { return cloud.width == num_below; }));
  double on_server = 0.0;
  EXPECT_TRUE(waitFor([&] {  // It is written slightly after the answer.
    return ros::param::get(std::string(kNode) + "/occupancy_max_z", on_server) && on_server == 0.5;
  })) << on_server;
  // A request with other values as well changes nothing.
  EXPECT_EQ(reconfigure({{"occupancy_max_z", 7.0}, {"resolution", 0.3}}, "occupancy_max_z"), 0.5);
  EXPECT_EQ(reconfigure({{"resolution", 0.3}}, "resolution"), 0.1);

  // The sensor model and the minimum range for later clouds.
  EXPECT_EQ(reconfigure({{"sensor_model_min_range", 100.0}}, "sensor_model_min_range"), 100.0);
  reset();
  startCounting();
  publishRoom("lidar", ros::Time(102.0));
  ASSERT_TRUE(waitForInserted(1));
  EXPECT_TRUE(callOctomap("/octomap_full").data.empty()) << "all points are too near";
  EXPECT_EQ(
      reconfigure({{"sensor_model_min_range", 0.0}, {"sensor_model_hit", 0.9}}, "sensor_model_hit"),
      0.9);
  startCounting();
  publishRoom("lidar", ros::Time(103.0));
  ASSERT_TRUE(waitForInserted(1));
  float greatest = -100.0F;
  for (const auto& leaf : contentOf(callOctomap("/octomap_full")).leaves) {
    greatest = std::max(greatest, leaf.log_odds);
  }
  EXPECT_NEAR(greatest, std::log(0.9 / 0.1), 1e-5);
  reconfigure({{"sensor_model_hit", 0.7}}, "sensor_model_hit");
}

TEST_F(OctomapServerTest, ColoursOfCuboidsFitTheMap) {
  TopicProbe<visualization_msgs::MarkerArray> cuboids("/occupied_cuboids");
  const auto fits_the_map = [](const auto& array) {
    bool is_right = !array.markers.empty();
    for (const auto& marker : array.markers) {
      for (std::size_t i = 0; i < marker.colors.size(); ++i) {
        const auto& color = marker.colors[i];
        const double z_m = marker.points[i].z;
        if (z_m < -1.0) is_right = is_right && color.b == 1.0F && color.r == 0.0F && color.g < 0.2F;
        if (z_m > 1.0) is_right = is_right && color.r == 1.0F && color.b == 0.0F && color.g < 0.2F;
      }
    }
    return is_right;
  };
  EXPECT_TRUE(cuboids.waitForMessage(fits_the_map)) << "blue floor, red ceiling";
}

TEST_F(OctomapServerTest, ARefusedChangeSaysWhyToWhoAsked) {
  dynamic_reconfigure::Reconfigure change;
  change.request.config.doubles.resize(1);
  change.request.config.doubles[0].name = "resolution";
  change.request.config.doubles[0].value = 77.0;
  ASSERT_TRUE(callService(std::string(kNode) + "/set_parameters", change));
  const auto& texts = change.response.config.strs;
  ASSERT_FALSE(texts.empty());
  EXPECT_EQ(texts.back().name, "refused");
  EXPECT_EQ(texts.back().value.find("resolution cannot be changed while the node runs"), 0U)
      << texts.back().value;
}

TEST_F(OctomapServerTest, MapsAreSavedAndLoaded) {
  const TemporaryFolder folder;
  const std::string before = bytesOf(callOctomap("/octomap_full"));
  for (const std::string name : {"map.cuboids", "map.ot"}) {
    cuboid_mapping::SaveMap save;
    save.request.filename = folder / name;
    ASSERT_TRUE(callService(std::string(kNode) + "/save_map", save));
    EXPECT_TRUE(save.response.info.success) << save.response.info.message;
    EXPECT_EQ(save.response.bytes, std::filesystem::file_size(folder / name));
    reset();
    EXPECT_TRUE(callOctomap("/octomap_full").data.empty());
    cuboid_mapping::LoadMap load;
    load.request.filename = folder / name;
    ASSERT_TRUE(callService(std::string(kNode) + "/load_map", load));
    EXPECT_TRUE(load.response.info.success) << load.response.info.message;
    EXPECT_TRUE(bytesOf(callOctomap("/octomap_full")) == before) << name;
  }
  cuboid_mapping::LoadMap load;
  load.request.filename = folder / "none";
  ASSERT_TRUE(callService(std::string(kNode) + "/load_map", load));
  EXPECT_FALSE(load.response.info.success);
  EXPECT_NE(load.response.info.message.find("No such file"), std::string::npos);
  EXPECT_TRUE(bytesOf(callOctomap("/octomap_full")) == before) << "the map is as it was";
}

TEST(OctomapServerCompat, StartsFromAMapOnTheCommandLine) {
  bool is_nodelet = false;
  ros::param::get("~is_nodelet", is_nodelet);
  if (is_nodelet) GTEST_SKIP() << "a nodelet has no command line";
  EXPECT_EQ(callOctomap("/argument/octomap_full").resolution, 0.2);
  EXPECT_FALSE(ros::param::has("/argument/octomap_server/map_file"))
      << "the next node of this name starts without it";
}

TEST(OctomapServerCompat, StartsWithTheLaunchFileAndTheLeftoversOfOctomapServer) {
  bool is_nodelet = false;
  ros::param::get("~is_nodelet", is_nodelet);
  if (is_nodelet) GTEST_SKIP() << "the launch file of octomap_server starts a node";
  const octomap_msgs::Octomap map = callOctomap("/leftovers/octomap_full");
  EXPECT_EQ(map.resolution, 0.05);
  EXPECT_EQ(map.header.frame_id, "odom_combined") << "without the slash";
}

TEST(OctomapServerCompat, StartsFromAMapFileWithItsResolution) {
  const octomap_msgs::Octomap map = callOctomap("/compat/octomap_full");
  EXPECT_EQ(map.resolution, 0.2) << "that of the file";
  EXPECT_EQ(countVoxels(contentOf(map), true), 1.0) << "without what is too far for an octree";
  EXPECT_EQ(countVoxels(contentOf(map), false), 7.0 + 4 * 8 * 8);
  EXPECT_TRUE(ros::service::exists("/compat/octomap_server/clear_bbx", false));
  EXPECT_TRUE(ros::service::exists("/compat/octomap_server/reset", false));
}

TEST(OctomapServerCompat, KeepsFreeCellsToItselfUnlessAsked) {
  TopicProbe<visualization_msgs::MarkerArray> free("/compat/free_cells_vis_array");
  ASSERT_TRUE(free.waitForMessage([](const auto& array) { return array.markers.size() == 17; }));
  for (const auto& marker : free.last().markers) EXPECT_TRUE(marker.points.empty());
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
