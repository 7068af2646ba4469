// SPDX-License-Identifier: BSD-3-Clause
// A running node with a window: it drives away from a room and back, ends, is killed, and goes on.
#include "cuboid_mapping/QueryBox.h"
#include "cuboid_mapping/io/map_files.h"
#include "ros/node_probe.h"
#include "support/snapshots.h"
#include "tools/run_program.h"

#include <tf2_msgs/TFMessage.h>

#include <cmath>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::QueryBox;
using cuboid_mapping::test::Program;
using cuboid_mapping::test::TemporaryFolder;

constexpr char kName[] = "/explorer";

class NodeWindow : public ::testing::TestWithParam<bool> {
 protected:
  void start(const std::vector<std::string>& parameters) {
    std::vector<std::string> command{CUBOID_MAPPING_NODE};
    if (GetParam()) {
      command = {"rosrun", "nodelet", "nodelet", "standalone", "cuboid_mapping/MappingNodelet"};
    }
    command.insert(command.end(), {std::string("__name:=") + (kName + 1), "__log:=/dev/null",
                                   "_resolution:=0.1", "_queue_size:=1000", "_window/frame:=base",
                                   "_window/size:=8.0", "_window/margin:=1.0"});
    command.insert(command.end(), parameters.begin(), parameters.end());
    node_ = std::make_unique<Program>(command);
    ASSERT_TRUE(
        waitFor([this] { return clouds_.getNumSubscribers() > 0 && tf_.getNumSubscribers() > 0; }));
    num_before_ = 0;
  }

  void end(int signal) {
    node_->send(signal);
    const auto end = node_->finish();
    node_.reset();
    EXPECT_TRUE(signal != SIGINT || end.status == 0) << end.out << end.err;
    ASSERT_TRUE(waitFor(
        [this] { return clouds_.getNumSubscribers() == 0 && tf_.getNumSubscribers() == 0; }));
  }

  /// Parameters of the command line stay on the server.
  void SetUp() override { ros::param::del(kName); }

  void TearDown() override {
    if (node_) end(SIGINT);
  }

  /// Sends clouds of a room around the robot at these places, one after the other.
  void drive(double from_x, double to_x) {
    const double step = to_x > from_x ? 0.5 : -0.5;
    const auto num_steps = static_cast<int>(std::abs(to_x - from_x) / 0.5);
    for (int i = 0; i <= num_steps; ++i) {
      const ros::Time stamp(time_s_ += 0.1);
      tf2_msgs::TFMessage tf;
      tf.transforms.push_back(
          makeTransform("map", "base", makeTranslation(from_x + i * step, 0.05, 0.05), stamp));
      tf_.publish(tf);
      clouds_.publish(makeCloud("base", stamp, makeRoom({1.0, 1.0, 0.5})));
      ++num_before_;
    }
    ASSERT_TRUE(waitFor([this] {
      return diagnostics_.status().number("clouds inserted") == num_before_;
    })) << diagnostics_.status().message;
  }

  [[nodiscard]] static QueryBox::Response askAt(double x) {
    QueryBox query;
    query.request.min = tf2::toMsg(Eigen::Vector3d(x - 0.2, -0.2, -0.2));
    query.request.max = tf2::toMsg(Eigen::Vector3d(x + 0.2, 0.2, 0.2));
    EXPECT_TRUE(callService(std::string(kName) + "/query_box", query));
    return query.response;
  }

  /// Whether a place where the robot has been is known, all of it.
  [[nodiscard]] static bool isKnownAt(double x) {
    const QueryBox::Response answer = askAt(x);
    return answer.success != 0 && answer.unknown_volume == 0.0;
  }

  [[nodiscard]] long figure(const std::string& key) {
    EXPECT_TRUE(diagnostics_.waitForNextReport());
    return diagnostics_.status().number("window " + key);
  }

  TemporaryFolder folder_;
  std::string file_ = folder_ / "map.sqlite";
  ros::NodeHandle nh_;
  ros::Publisher clouds_ = nh_.advertise<sensor_msgs::PointCloud2>("/cloud_in", 200);
  ros::Publisher tf_ = nh_.advertise<tf2_msgs::TFMessage>("/tf", 200);
  DiagnosticsProbe diagnostics_{kName};
  std::unique_ptr<Program> node_;
  double time_s_ = 100.0;
  long num_before_ = 0;
};

TEST_P(NodeWindow, KeepsWhatIsFarAwayAndGoesOnWithIt) {
  start({"_window/file:=" + file_});
  drive(0.0, 40.0);
  EXPECT_GT(figure("parts on disk only"), 0);
  EXPECT_EQ(askAt(0.0).message.rfind("not loaded: ", 0), 0U) << askAt(0.0).message;
  EXPECT_TRUE(isKnownAt(40.0)) << askAt(40.0).message;
  drive(40.0, 0.0);
  EXPECT_GT(figure("parts read"), 0);
  EXPECT_TRUE(isKnownAt(0.0)) << askAt(0.0).message;
  EXPECT_EQ(askAt(40.0).message.rfind("not loaded: ", 0), 0U);
  EXPECT_EQ(figure("failures"), 0);
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

TEST_P(NodeWindow, ForgetsWhatIsFarAway) {
  start({"_window/outside:=forget"});
  drive(0.0, 40.0);
  EXPECT_GT(figure("parts forgotten"), 0);
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

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_node_window");
  const ros::NodeHandle keeps_ros_alive;
  return RUN_ALL_TESTS();
}
