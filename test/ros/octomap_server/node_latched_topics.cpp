// SPDX-License-Identifier: BSD-3-Clause
// The running node at rest: a subscriber of any topic gets the whole, whenever and wherever it connects.
#include "ros/node_probe.h"
#include "ros/octomap_server/octomap_probe.h"
#include "tools/run_program.h"

#include <nav_msgs/OccupancyGrid.h>
#include <topic_tools/shape_shifter.h>

#include <csignal>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

using topic_tools::ShapeShifter;

class LatchedTopicsTest : public NodeTest {
 protected:
  void SetUp() override {
    NodeTest::SetUp();
    publishStaticTf(makeTransform("map", "lidar", makeTranslation(0.05, 0.05, 0.05)));
  }

  void insertRoom() {
    publishRoom("lidar");
    ASSERT_TRUE(waitForInserted(1));
  }

  static bool clear(double half_m) {
    octomap_msgs::BoundingBoxQuery request;
    request.request.min = tf2::toMsg(Eigen::Vector3d(-half_m, -half_m, -2.5));
    request.request.max = tf2::toMsg(Eigen::Vector3d(half_m, half_m, 2.5));
    return callService(std::string(kNode) + "/clear_bbx", request);
  }

  /// Whether a node of another name subscribes.
  static bool hasListenerElsewhere(const std::string& topic) {
    XmlRpc::XmlRpcValue request;
    request[0] = ros::this_node::getName();
    XmlRpc::XmlRpcValue response;
    XmlRpc::XmlRpcValue state;
    if (!ros::master::execute("getSystemState", request, response, state, false)) return false;
    for (int i = 0; i < state[1].size(); ++i) {
      if (static_cast<std::string>(state[1][i][0]) == topic) return true;
    }
    return false;
  }
};

const std::vector<std::string> kOctomapTopics{"/projected_map", "/octomap_full", "/octomap_binary",
                                              "/occupied_cells_vis_array",
                                              "/octomap_point_cloud_centers"};

TEST_F(LatchedTopicsTest, ASecondListenerOfOneProcessGetsTheWhole) {
  insertRoom();
  std::vector<std::string> topics = kOctomapTopics;
  topics.insert(topics.end(),
                {"/free_cells_vis_array", "/cuboid_map", "/occupied_cuboids", "/free_cuboids"});
  for (const std::string& topic : topics) {
    TopicProbe<ShapeShifter> first(topic);
    ASSERT_TRUE(first.waitForMessage([](const auto&) { return true; })) << topic;
    ASSERT_TRUE(diagnostics_.waitForNextReport());
    TopicProbe<ShapeShifter> second(topic);
    ASSERT_TRUE(second.waitForMessage([](const auto&) { return true; })) << topic;
    EXPECT_EQ(second.first().size(), first.last().size()) << topic;
  }
}

TEST_F(LatchedTopicsTest, BeforeTheFirstCloudTopicsOfOctomapServerAreSilent) {
  for (const std::string& topic : kOctomapTopics) {
    TopicProbe<ShapeShifter> probe(topic);
    ASSERT_TRUE(probe.waitForConnection());
    ASSERT_TRUE(diagnostics_.waitForNextReport());
    EXPECT_EQ(probe.count(), 0) << topic;
    if (topic != kOctomapTopics.back()) continue;
    insertRoom();
    EXPECT_TRUE(probe.waitForMessage([](const auto&) { return true; }));
  }
}

TEST_F(LatchedTopicsTest, AListenerWithoutUpdatesSeesEachChangeThoughAnotherNodeTakesUpdates) {
  insertRoom();
  TopicProbe<nav_msgs::OccupancyGrid> grid("/projected_map");
  ASSERT_TRUE(grid.waitForMessage([](const auto& message) { return !message.data.empty(); }));
  cuboid_mapping::test::Program updates(
      {"rostopic", "hz", "--wall-time", "/projected_map_updates"});
  ASSERT_TRUE(waitFor([] { return hasListenerElsewhere("/projected_map_updates"); }));
  ASSERT_TRUE(diagnostics_.waitForNextReport());
  for (const double half_m : {0.35, 0.55}) {
    ASSERT_TRUE(clear(half_m));
    const auto is_clear = [half_m](const nav_msgs::OccupancyGrid& message) {
      const auto index = [&](double origin_m) {
        return static_cast<std::size_t>((half_m - 0.1 - origin_m) / message.info.resolution);
      };
      const geometry_msgs::Point& origin = message.info.origin.position;
      return message.data.at(index(origin.y) * message.info.width + index(origin.x)) == 0;
    };
    EXPECT_TRUE(grid.waitForMessage(is_clear)) << half_m;
  }
  updates.send(SIGINT);
  updates.finish();
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
