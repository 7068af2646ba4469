// SPDX-License-Identifier: BSD-3-Clause
// `rosbag record` of a node's map: map_convert reads it, and clients get it when it is played without the node.
#include "cuboid_mapping/CuboidMapUpdate.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/ros/cuboid_map_client.h"
#include "ros/driven_node.h"
#include "support/snapshots.h"

#include <visualization_msgs/MarkerArray.h>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::CuboidMap;
using cuboid_mapping::test::Program;
using cuboid_mapping::test::runProgram;
using cuboid_mapping::test::voxelsOf;
using Voxels = std::map<cuboid_mapping::Cell, float>;

class NodeRecorded : public DrivenNode {
 protected:
  /// Drives for some seconds while a recorder runs. @return The map at the end, as the node saves it.
  Voxels record() {
    start({"_keyframe_period:=0.5", "_publish_values:=true", "_publish_rate:=10.0"});
    drive(0.0, 2.0);
    Program recorder({"rosbag", "record", "-O", bag_, "/cuboid_map", "/cuboid_map_updates"});
    EXPECT_TRUE(cuboid_mapping::test::waitForFile(bag_ + ".active"));
    for (int part = 1; part < 5; ++part) {
      ros::WallDuration(1.0).sleep();
      drive(2.0 * part, 2.0 * part + 2.0);
    }
    ros::WallDuration(1.5).sleep();  // Waits for the last keyframe.
    recorder.send(SIGINT);
    EXPECT_EQ(recorder.finish().status, 0);
    Voxels saved = saveMap();
    end(SIGINT);  // No node serves get_map any more.
    return saved;
  }

  std::string bag_ = folder_ / "recorded.bag";
};

TEST_P(NodeRecorded, IsReadByMapConvertAndShownWhenItIsPlayedFromAnywhere) {
  const Voxels wanted = record();
  ASSERT_GT(wanted.size(), 10000U);
  const std::string read = folder_ / "read.cuboids";
  const auto converted = runProgram({MAP_CONVERT_PROGRAM, bag_, read});
  ASSERT_EQ(converted.status, 0) << converted.err;
  const auto map = cuboid_mapping::readMapFile(read).snapshot;
  EXPECT_EQ(map.frame_id, "map");
  EXPECT_TRUE(voxelsOf(map.bricks) == wanted) << converted.err;
  for (const std::string start_s : {"0", "2.2", "4.8"}) {
    const CuboidMapClient client(nh_, kName);
    const auto played = runProgram({"rosbag", "play", "--quiet", "--delay=1", "-s", start_s, bag_});
    ASSERT_EQ(played.status, 0) << played.err;
    EXPECT_TRUE(waitFor([&] {
      return client.read([&](const CuboidMap& seen) { return voxelsOf(seen) == wanted; });
    })) << "from "
        << start_s << " s";
  }
}

TEST_P(NodeRecorded, ACloudIsPublishedAtOnceIfTheLastPublicationIsLongAgo) {
  using visualization_msgs::MarkerArray;
  std::size_t num_messages = 0;
  std::size_t num_markers = 0;
  const ros::Subscriber subscriber = nh_.subscribe<MarkerArray>(
      "/occupied_cuboids", 10, [&](const MarkerArray::ConstPtr& message) {
        ++num_messages;
        num_markers = message->markers.size();
      });
  start({"_publish_rate:=0.01"});
  ASSERT_TRUE(waitFor([&] { return num_messages == 1; })) << "the empty picture";
  drive(0.0, 0.0);
  EXPECT_TRUE(waitFor([&] { return num_messages > 1 && num_markers > 1; }))
      << "the next call of the timer is after 100 s";
}

TEST_P(NodeRecorded, EditsArePublishedAtTheRateAtMost) {
  std::size_t num_messages = 0;
  const ros::Subscriber subscriber = nh_.subscribe<cuboid_mapping::CuboidMapUpdate>(
      "/cuboid_map_updates", 100,
      [&](const cuboid_mapping::CuboidMapUpdate::ConstPtr&) { ++num_messages; });
  start({"_publish_rate:=0.01"});
  for (int i = 0; i < 10; ++i) {
    setBox(2, false, Eigen::Vector3d(i, 0.0, 0.0), Eigen::Vector3d(i + 0.5, 0.5, 0.5));
    (void)waitFor([&] { return num_messages > 0; });
  }
  ros::WallDuration(0.5).sleep();
  ros::spinOnce();
  EXPECT_EQ(num_messages, 1U);
}

// A nodelet has the same topics.
INSTANTIATE_TEST_SUITE_P(AsNode, NodeRecorded, ::testing::Values(false));

}  // namespace
}  // namespace cuboid_mapping_ros::test
