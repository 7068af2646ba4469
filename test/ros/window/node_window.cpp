// SPDX-License-Identifier: BSD-3-Clause
// A running node with a window: it drives away from a room and back, ends, is killed, and continues.
#include "cuboid_mapping/GetLocks.h"
#include "cuboid_mapping/GetMap.h"
#include "cuboid_mapping/QueryBox.h"
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_files.h"
#include "ros/driven_node.h"
#include "ros/log_probe.h"
#include "ros/octomap_server/octomap_probe.h"
#include "support/snapshots.h"

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::QueryBox;
using cuboid_mapping::SetBox;

class NodeWindow : public DrivenNode {
 protected:
  void start(std::vector<std::string> parameters) {
    parameters.insert(parameters.end(), {"_window/frame:=base", "_window/size:=8.0"});
    DrivenNode::start(parameters);
  }

  [[nodiscard]] static QueryBox::Response askAt(double x) {
    QueryBox query;
    query.request.min = tf2::toMsg(Eigen::Vector3d(x - 0.2, -0.2, -0.2));
    query.request.max = tf2::toMsg(Eigen::Vector3d(x + 0.2, 0.2, 0.2));
    EXPECT_TRUE(callService(std::string(kName) + "/query_box", query));
    return query.response;
  }

  /// Whether a place that the robot has left is wholly known.
  [[nodiscard]] static bool isKnownAt(double x) {
    const QueryBox::Response answer = askAt(x);
    return answer.success != 0 && answer.unknown_volume == 0.0;
  }

  static void setBoxAt(double x, std::uint8_t occupancy, bool is_locked) {
    setBox(occupancy, is_locked, {x - 0.2, -0.2, -0.2}, {x + 0.2, 0.2, 0.2});
  }

  [[nodiscard]] static std::size_t countLocks() {
    cuboid_mapping::GetLocks locks;
    EXPECT_TRUE(callService(std::string(kName) + "/get_locks", locks));
    return locks.response.boxes.size();
  }

  std::string file_ = folder_ / "map.sqlite";
};

TEST_P(NodeWindow, SaysThatItsFileCannotBeWritten) {
  LogProbe log;
  std::signal(SIGXFSZ, SIG_IGN);  // Of the node, too.
  start({"_window/file:=" + file_, "_autosave_period:=1.0"});
  cuboid_mapping::test::limitFileSize(50, node_->pid());  // Nothing can be written.
  drive(0.0, 2.0);
  EXPECT_TRUE(log.waitForLine("map not saved to " + file_ + ": "));
}

TEST_P(NodeWindow, SaysThatItsFileIsGone) {
  LogProbe log;
  start({"_window/file:=" + file_, "_autosave_period:=1.0"});
  drive(0.0, 2.0);
  std::filesystem::remove(file_);
  EXPECT_TRUE(log.waitForLine(file_ + " was removed or renamed"));
}

TEST_P(NodeWindow, KeepsWhatIsFarAwayAndGoesOnWithIt) {
  start({"_window/file:=" + file_});
  drive(0.0, 40.0);
  EXPECT_GT(figure("window parts on disk only"), 0);
  EXPECT_EQ(askAt(0.0).message.rfind("not loaded: ", 0), 0U) << askAt(0.0).message;
  EXPECT_TRUE(isKnownAt(40.0)) << askAt(40.0).message;
  drive(40.0, 0.0);
  EXPECT_GT(figure("window parts read"), 0);
  EXPECT_TRUE(isKnownAt(0.0)) << askAt(0.0).message;
  EXPECT_EQ(askAt(40.0).message.rfind("not loaded: ", 0), 0U);
  EXPECT_EQ(figure("window failures"), 0);
  end(SIGINT);
  const auto all =
      cuboid_mapping::test::voxelsOf(cuboid_mapping::readMapFile(file_).snapshot.bricks);
  EXPECT_EQ(all.count({400, 0, 0}), 1U);
  EXPECT_EQ(all.count({0, 0, 0}), 1U);

  start({"_window/file:=" + file_, "_window/queries:=load"});
  EXPECT_TRUE(isKnownAt(40.0)) << "before any cloud has come";
  drive(80.0, 81.0);
  EXPECT_TRUE(isKnownAt(0.0));
  end(SIGKILL);
  const auto later =
      cuboid_mapping::test::voxelsOf(cuboid_mapping::readMapFile(file_).snapshot.bricks);
  for (const auto& [cell, value] : all) ASSERT_EQ(later.count(cell), 1U) << cell;
}

TEST_P(NodeWindow, KeepsLocksFarAwayForTheNextRun) {
  start({"_window/file:=" + file_});
  drive(0.0, 1.0);
  setBoxAt(0.5, SetBox::Request::UNKNOWN, true);
  drive(1.0, 40.0);
  end(SIGINT);
  EXPECT_TRUE(std::filesystem::exists(file_ + ".locks"));

  start({"_window/file:=" + file_});
  EXPECT_EQ(countLocks(), 1U);
  drive(40.0, 0.0);
  EXPECT_TRUE(isKnownAt(1.0)) << askAt(1.0).message;
  EXPECT_EQ(askAt(0.5).occupancy, QueryBox::Response::UNKNOWN) << "clouds do not change it";
  setBoxAt(0.5, SetBox::Request::KEEP, false);
  end(SIGINT);
  EXPECT_FALSE(std::filesystem::exists(file_ + ".locks"));

  cuboid_mapping::replaceFile(file_ + ".locks", "0 0 0 1 1 1\n");
  std::filesystem::remove(file_);
  for (int run = 1; run <= 2; ++run) {
    start({"_window/file:=" + file_});
    EXPECT_EQ(countLocks(), 0U) << "of a map that was removed, in run " << run;
    end(SIGINT);
  }
}

/// Whether an octree knows the voxel of a place.
bool isKnownIn(const octomap_msgs::Octomap& message, double x) {
  const auto cell_x = static_cast<std::int32_t>(std::floor(x / message.resolution));
  for (const auto& leaf : contentOf(message).leaves) {
    if (leaf.box.contains(cuboid_mapping::Cell{cell_x, 0, 0})) return true;
  }
  return false;
}

TEST_P(NodeWindow, OctreesOfServicesAreWholeOrRefused) {
  start({"_window/file:=" + file_});
  LogProbe log;
  drive(0.0, 40.0);
  octomap_msgs::GetOctomap octree;
  for (const std::string service : {"/octomap_full", "/octomap_binary"}) {
    ASSERT_TRUE(ros::service::waitForService(service, ros::Duration(kDeadline_s)));
    EXPECT_FALSE(ros::service::call(service, octree)) << service;
  }
  EXPECT_TRUE(log.waitForLine("not loaded: ")) << "the caller gets the text";
  TopicProbe<octomap_msgs::Octomap> topic("/octomap_full");
  EXPECT_TRUE(topic.waitForMessage([](const auto& message) { return isKnownIn(message, 40.0); }));
  EXPECT_FALSE(isKnownIn(topic.last(), 0.0)) << "the topic shows what is in memory";
  cuboid_mapping::GetMap map;
  ASSERT_TRUE(callService(std::string(kName) + "/get_map", map));
  EXPECT_NE(map.response.info.message.find("on disk"), std::string::npos)
      << map.response.info.message;
  EXPECT_TRUE(diagnostics_.waitForNextReport());
  EXPECT_EQ(diagnostics_.status().values.at("topics show"), "the part in memory");
  EXPECT_EQ(diagnostics_.status().number("callbacks failed"), 0);
  end(SIGINT);

  start({"_window/file:=" + file_, "_window/queries:=load"});
  for (const std::string service : {"/octomap_full", "/octomap_binary"}) {
    const octomap_msgs::Octomap whole = callOctomap(service);
    EXPECT_TRUE(isKnownIn(whole, 0.0) && isKnownIn(whole, 40.0)) << service;
  }
  EXPECT_GT(figure("window parts on disk only"), 0) << "they are read, and stay there";
}

TEST_P(NodeWindow, ForgetsWhatIsFarAway) {
  start({"_window/outside:=forget"});
  drive(0.0, 40.0);
  EXPECT_GT(figure("window parts forgotten"), 0);
  EXPECT_EQ(askAt(0.0).occupancy, QueryBox::Response::UNKNOWN);
  EXPECT_TRUE(isKnownAt(40.0));
}

TEST_P(NodeWindow, DoesNotStartWithTheStoreOfAnotherMap) {
  cuboid_mapping::MapSnapshot other;
  other.resolution_m = 0.3;
  cuboid_mapping::writeMapFile(file_, other);
  const auto end = cuboid_mapping::test::runProgram(
      {CUBOID_MAPPING_NODE, std::string("__name:=") + (kName + 1), "_resolution:=0.1",
       "_window/frame:=base", "_window/file:=" + file_});
  EXPECT_NE(end.status, 0);
  EXPECT_NE((end.out + end.err).find("resolution 0.3 m, but this map has 0.1 m"), std::string::npos)
      << end.out << end.err;
}

INSTANTIATE_TEST_SUITE_P(AsNodeAndNodelet, NodeWindow, ::testing::Bool());

}  // namespace
}  // namespace cuboid_mapping_ros::test
