// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/mapping/tf_poses.h"
#include "cuboid_mapping/ros/middleware/tf_buffer.h"
#include "ros/logged_lines.h"
#include "ros/node_probe.h"

#include <ros/callback_queue.h>

#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

/// A receiver of the transforms of a topic, and their publisher.
class TfReceiverTest : public testing::Test {
 protected:
  TfReceiverTest() {
    nh.setCallbackQueue(&queue);
    receiver.emplace(nh, buffer);
    publisher = nh.advertise<tf2_msgs::TFMessage>("/tf", 100);
  }

  [[nodiscard]] bool hears(const std::string& frame_id, const ros::Time& stamp) {
    return waitFor([&] {
      queue.callAvailable();
      return buffer.canTransform("map", frame_id, stamp);
    });
  }
  [[nodiscard]] PoseSearch search(const std::string& frame_id, const ros::Time& stamp) const {
    const NodeParameters parameters;
    std_msgs::Header header;
    header.frame_id = frame_id;
    header.stamp = stamp;
    return findPoses(buffer, PoseFrames(parameters, parameters.source), header, {});
  }

  ros::CallbackQueue queue;
  ros::NodeHandle nh{"", {{"/tf", "/heard_tf"}}};
  TfBuffer buffer;
  std::optional<TfReceiver> receiver;
  ros::Publisher publisher;
};

TEST_F(TfReceiverTest, LosesNoTransformWhileItsThreadIsBusy) {
  // At 1 kHz, with the robot's joints, half a second.
  const ros::Time begin(1000.0);
  const ros::Time end(1000.5);
  for (ros::Time stamp = begin; stamp <= end; stamp += ros::Duration(0.001)) {
    const auto message = boost::make_shared<tf2_msgs::TFMessage>();
    message->transforms.push_back(makeTransform("map", "lidar", makeTranslation(0, 0, 0), stamp));
    publisher.publish(message);
  }
  ASSERT_TRUE(hears("lidar", end));
  EXPECT_TRUE(buffer.canTransform("map", "lidar", begin));
}

/// tf2 itself has a line for each.
TEST_F(TfReceiverTest, NamesAFaultyTransformOnceAndNoTwins) {
  (void)LoggedLines::take();
  ros::Time stamp(1000.0);
  for (int i = 0; i < 20; ++i) {
    stamp += ros::Duration(0.1);
    tf2_msgs::TFMessage message;
    const auto wheel = makeTransform("map", "wheel", makeTranslation(0, 0, 0), stamp);
    auto camera = makeTransform("map", "camera", makeTranslation(0, 0, 0), stamp);
    camera.transform.rotation.w = 0.0;
    message.transforms = {wheel, wheel, camera};
    publisher.publish(message);
  }
  ASSERT_TRUE(hears("wheel", stamp));
  tf2_msgs::TFMessage late;
  late.transforms = {makeTransform("map", "wheel", makeTranslation(0, 0, 0), ros::Time(900.0)),
                     makeTransform("wheel", "wheel", makeTranslation(0, 0, 0), stamp)};
  publisher.publish(late);
  queue.callAvailable();
  EXPECT_FALSE(buffer.canTransform("map", "wheel", ros::Time(900.0)));
  const std::string fault =
      "the rotation (0, 0, 0, 0) is no unit quaternion. Correct " + ros::this_node::getName();
  EXPECT_EQ(LoggedLines::take(),
            (std::vector<std::string>{"a transform of 'camera' is ignored: " + fault}));
  EXPECT_EQ(search("camera", stamp).why, "the transforms of 'camera' are faulty: " + fault);
}

TEST_F(TfReceiverTest, NamesThePublishersOfTwoParents) {
  const ros::Time begin(1000.0);
  const auto send = [&](const std::string& parent, double time_s) {
    tf2_msgs::TFMessage message;
    const ros::Time stamp = begin + ros::Duration(time_s);
    message.transforms = {makeTransform(parent, "base", makeTranslation(0, 0, 0), stamp)};
    publisher.publish(message);
  };
  for (int i = 0; i <= 20; ++i) send(i % 2 == 0 ? "map" : "odom", 0.1 * i);
  ASSERT_TRUE(hears("base", begin + ros::Duration(2.0)));
  const PoseSearch between = search("base", begin + ros::Duration(1.95));
  EXPECT_EQ(between.hopeless, DropReason::kNoTransform) << "tf has not begun after it";
  const std::string by = " (" + ros::this_node::getName() + ")";
  EXPECT_EQ(between.why.find("the transforms of 'base' are faulty: they have different parents in "
                             "turn, 'map'" +
                             by + " and 'odom'" + by),
            0U)
      << between.why;
  EXPECT_EQ(search("base", begin - ros::Duration(1.0)).hopeless, DropReason::kBeforeTf);
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
