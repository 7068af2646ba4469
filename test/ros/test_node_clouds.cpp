// SPDX-License-Identifier: BSD-3-Clause
// The running node: clouds that are late, early, lost or damaged.
#include "ros/node_probe.h"

#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

/// The value in the launch files of the tests.
constexpr int kQueueSize = 5;

using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

PointCloud2 makeSmallCloud(const std::string& frame_id, const ros::Time& stamp) {
  return makeCloud(frame_id, stamp, {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}});
}

class NodeCloudsTest : public NodeTest {
 protected:
  void SetUp() override {
    publishStaticTf(makeTransform("map", "lidar", makeTranslation(0.05, 0.05, 0.05)));
    NodeTest::SetUp();
  }

  bool waitForDropped(const std::string& reason, long count) {
    return waitFor([&] {
      return countNew("clouds dropped, " + reason) + countNew("clouds empty, " + reason) >= count;
    });
  }
};

TEST_F(NodeCloudsTest, ACloudThatComesBeforeItsTransformIsInserted) {
  cloud_publisher_.publish(makeSmallCloud("late_lidar", ros::Time(100.0)));
  ASSERT_TRUE(waitFor([&] { return countNew("clouds received") == 1; }));
  ASSERT_TRUE(diagnostics_.waitForNextReport());
  EXPECT_EQ(countNew("clouds inserted"), 0);
  publishStaticTf(makeTransform("map", "late_lidar", Eigen::Isometry3d::Identity()));
  EXPECT_TRUE(waitForInserted(1));
}

TEST_F(NodeCloudsTest, ACloudInTheFrameOfTheMapNeedsNoTransform) {
  cloud_publisher_.publish(makeSmallCloud("map", ros::Time(100.0)));
  EXPECT_TRUE(waitForInserted(1));
}

TEST_F(NodeCloudsTest, CloudsWithoutATransformAreCountedAndTold) {
  for (int i = 0; i < kQueueSize; ++i) {
    cloud_publisher_.publish(makeSmallCloud("nowhere", ros::Time(100.0)));
  }
  ASSERT_TRUE(waitFor([&] { return countNew("clouds received") == kQueueSize; }));
  EXPECT_TRUE(waitFor([&] {
    return diagnostics_.status().message.find("wait for a transform") != std::string::npos;
  })) << diagnostics_.status().message;
  const std::string& message = diagnostics_.status().message;
  EXPECT_NE(message.find("frame 'nowhere'"), std::string::npos) << message;
  EXPECT_NE(message.find("\"nowhere\""), std::string::npos) << "what tf says: " << message;
  EXPECT_NE(message.find("years old: set use_sim_time"), std::string::npos) << message;

  startCounting();
  for (int i = 0; i < 3; ++i) {
    cloud_publisher_.publish(makeSmallCloud("nowhere", ros::Time(100.0)));
  }
  ASSERT_TRUE(waitFor([&] { return countNew("clouds received") == 3; }));
  EXPECT_EQ(countNew("clouds dropped"), 0) << "queue_size is not for clouds that wait for tf";
  EXPECT_EQ(countNew("clouds inserted"), 0);
  EXPECT_EQ(diagnostics_.status().number("clouds waiting"), kQueueSize + 3);
  EXPECT_NE(diagnostics_.status().values.at("clouds waiting, oldest").find("nowhere"),
            std::string::npos);

  cloud_publisher_.publish(makeSmallCloud("lidar", ros::Time(100.0)));
  EXPECT_TRUE(waitForInserted(1)) << "others are not held up";
}

TEST_F(NodeCloudsTest, ACloudOlderThanAllTransformsIsDropped) {
  for (const double stamp : {1015.0, 1018.9, 1019.2, 1020.0}) {
    publishTf(makeTransform("map", "moving", makeTranslation(stamp, 0, 0), ros::Time(stamp)));
  }
  cloud_publisher_.publish(makeSmallCloud("moving", ros::Time(1019.0)));
  ASSERT_TRUE(waitForInserted(1));
  cloud_publisher_.publish(makeSmallCloud("moving", ros::Time(1005.0)));
  cloud_publisher_.publish(makeSmallCloud("moving", ros::Time(1019.1)));
  EXPECT_TRUE(waitForInserted(2));
  EXPECT_TRUE(waitForDropped("before the first transform", 1));
}

TEST_F(NodeCloudsTest, AnyNumberOfCloudsWaitsForTransformsThatComeLate) {
  constexpr int kClouds = 10 * kQueueSize;
  for (int i = 0; i < kClouds; ++i) {
    cloud_publisher_.publish(makeSmallCloud("very_late", ros::Time(7000.0 + 0.1 * i)));
    if (i % 10 == 9) {
      ASSERT_TRUE(waitFor([&] { return countNew("clouds received") == i + 1; }));
    }
  }
  EXPECT_EQ(countNew("clouds inserted"), 0);
  for (double t = -0.1; t < 0.1 * kClouds + 0.2; t += 0.1) {
    publishTf(
        makeTransform("map", "very_late", Eigen::Isometry3d::Identity(), ros::Time(7000.0 + t)));
  }
  EXPECT_TRUE(waitForInserted(kClouds));
  EXPECT_EQ(countNew("clouds dropped"), 0);
}

TEST_F(NodeCloudsTest, APublisherOfTfWhoseClockIsAheadCostsNoCloud) {
  for (int i = 0; i < 30; ++i) {
    const ros::Time stamp(9000.0 + 0.1 * i);
    publishTf(makeTransform("map", "steady", Eigen::Isometry3d::Identity(), stamp));
    if (i % 14 != 0) continue;
    publishTf(makeTransform("world", "tag", Eigen::Isometry3d::Identity(),
                            stamp + ros::Duration(5000.0)));  // Longer than tf keeps.
  }
  for (int i = 0; i < 28; ++i) {
    cloud_publisher_.publish(makeSmallCloud("steady", ros::Time(9000.05 + 0.1 * i)));
    if (i % 4 == 3) {
      ASSERT_TRUE(waitForInserted(i + 1));
    }
  }
  EXPECT_EQ(countNew("clouds dropped"), 0);
}

TEST_F(NodeCloudsTest, ARecordingThatStartsAgainIsMappedAgain) {
  // The bag is played without its clock: only the stamps of tf show the jump.
  const auto play = [&](double start) {
    for (double stamp = start; stamp < start + 2.0; stamp += 0.05) {
      publishTf(makeTransform("map", "looping", Eigen::Isometry3d::Identity(), ros::Time(stamp)));
    }
  };
  play(5000.0);
  cloud_publisher_.publish(makeSmallCloud("looping", ros::Time(5000.5)));
  ASSERT_TRUE(waitForInserted(1));

  play(4000.0);
  EXPECT_TRUE(waitFor([&] {  // Waits for the transforms.
    cloud_publisher_.publish(makeSmallCloud("looping", ros::Time(4001.5)));
    return countNew("clouds inserted") >= 2;
  }));
}

TEST_F(NodeCloudsTest, DamagedCloudsAreCountedByReason) {
  struct Damage {
    std::string reason;
    PointCloud2 cloud;
  };
  const PointCloud2 good = makeSmallCloud("lidar", ros::Time(100.0));
  std::vector<Damage> damages(7, Damage{"", good});
  damages[0].reason = "empty frame_id";
  damages[0].cloud.header.frame_id.clear();
  damages[1].reason = "no points";
  damages[1].cloud.width = 0;
  damages[2].reason = "no x/y/z fields";
  damages[2].cloud.fields[1].name = "why";
  damages[3].reason = "wrong datatype";
  damages[3].cloud.fields[2].datatype = PointField::INT16;
  damages[4].reason = "bad layout";
  damages[4].cloud.fields[0].offset = damages[4].cloud.point_step;
  damages[5].reason = "short data";
  damages[5].cloud.data.resize(5);
  damages[6].reason = "no valid points";
  const double nan = std::numeric_limits<double>::quiet_NaN();
  damages[6].cloud = makeCloud("lidar", ros::Time(100.0), {{nan, nan, nan}});

  for (const Damage& damage : damages) {
    cloud_publisher_.publish(damage.cloud);
    EXPECT_TRUE(waitForDropped(damage.reason, 1)) << damage.reason;
  }
  cloud_publisher_.publish(good);
  ASSERT_TRUE(waitForInserted(1));
  for (const Damage& damage : damages) {
    const bool is_empty = damage.reason == "no points" || damage.reason == "no valid points";
    EXPECT_EQ(countNew((is_empty ? "clouds empty, " : "clouds dropped, ") + damage.reason), 1);
  }
  EXPECT_EQ(countNew("clouds dropped"), static_cast<long>(damages.size()) - 2);
  EXPECT_EQ(countNew("clouds received"), static_cast<long>(damages.size()) + 1);
  EXPECT_EQ(countNew("clouds inserted"), 1);
}

TEST_F(NodeCloudsTest, PointsThatAreNoneAreCounted) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  cloud_publisher_.publish(
      makeCloud("lidar", ros::Time(100.0),
                {{1.0, 0.0, 0.0}, {nan, 0.0, 0.0}, {5e8, 0.0, 0.0}, {5e6, 0.0, 0.0}}));
  ASSERT_TRUE(waitForInserted(1));
  EXPECT_EQ(countNew("points inserted"), 1);
  EXPECT_EQ(countNew("points NaN or without return"), 1);
  EXPECT_EQ(countNew("points out of range"), 1);
  EXPECT_EQ(countNew("points too far"), 1);
}

TEST_F(NodeCloudsTest, NoCloudIsLostWithoutBeingCounted) {
  // Far more clouds at once than the queue holds.
  long num_published = 0;
  for (int round = 0; round < 5; ++round) {
    for (int i = 0; i < 20; ++i, ++num_published) publishRoom("lidar");
    EXPECT_TRUE(waitFor(
        [&] { return countNew("clouds inserted") + countNew("clouds dropped") == num_published; }));
  }
  EXPECT_EQ(countNew("clouds received"), num_published);
  EXPECT_EQ(countNew("clouds dropped"), countNew("clouds dropped, queue full"));
  EXPECT_GT(countNew("clouds inserted"), 0);
}

TEST_F(NodeCloudsTest, AClockThatIsAheadIsTold) {
  cloud_publisher_.publish(makeSmallCloud("lidar", ros::Time::now() + ros::Duration(30.0)));
  ASSERT_TRUE(waitForInserted(1));
  EXPECT_TRUE(waitFor([&] {
    return diagnostics_.status().message.find("ahead of this machine's clock") != std::string::npos;
  })) << diagnostics_.status().message;
  EXPECT_EQ(diagnostics_.status().level, static_cast<int>(diagnostic_msgs::DiagnosticStatus::WARN));
}

TEST_F(NodeCloudsTest, DiagnosticsTellTimesAndSizes) {
  publishRoom("lidar");
  ASSERT_TRUE(waitForInserted(1));
  const NodeStatus& status = diagnostics_.status();
  EXPECT_GT(status.number("cuboids free"), 0);
  EXPECT_GT(status.number("cuboids occupied"), 0);
  EXPECT_GT(status.number("map bytes"), 0);
  for (const std::string stage : {"convert", "ray walk", "apply"}) {
    for (const std::string figure : {"last", "mean", "max"}) {
      const std::string key = stage + " time " + figure + " [ms]";
      EXPECT_GT(std::stod(status.values.at(key)), 0.0) << key;
    }
  }
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
