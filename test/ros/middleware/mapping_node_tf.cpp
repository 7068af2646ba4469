// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/mapping/tf_poses.h"
#include "cuboid_mapping/ros/middleware/tf_buffer.h"
#include "ros/logged_lines.h"
#include "ros/node_probe.h"

#include <ros/callback_queue.h>

#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

TEST(TfReceiver, LosesNoTransformWhileItsThreadIsBusy) {
  ros::CallbackQueue queue;
  ros::NodeHandle nh("", {{"/tf", "/burst"}});
  nh.setCallbackQueue(&queue);
  TfBuffer buffer;
  const TfReceiver receiver(nh, buffer);
  const auto publisher = nh.advertise<tf2_msgs::TFMessage>("/tf", 1);
  // At 1 kHz, with the robot's joints, half a second.
  const ros::Time begin(1000.0);
  const ros::Time end(1000.5);
  for (ros::Time stamp = begin; stamp <= end; stamp += ros::Duration(0.001)) {
    const auto message = boost::make_shared<tf2_msgs::TFMessage>();
    message->transforms.push_back(makeTransform("map", "lidar", makeTranslation(0, 0, 0), stamp));
    publisher.publish(message);
  }
  ASSERT_TRUE(waitFor([&] {
    queue.callAvailable();
    return buffer.canTransform("map", "lidar", end);
  }));
  EXPECT_TRUE(buffer.canTransform("map", "lidar", begin));
}

/// tf2 itself has a line for each.
TEST(TfReceiver, NamesAFaultyTransformOnceAndNoTwins) {
  ros::CallbackQueue queue;
  ros::NodeHandle nh("", {{"/tf", "/faulty"}});
  nh.setCallbackQueue(&queue);
  TfBuffer buffer;
  const TfReceiver receiver(nh, buffer);
  const auto publisher = nh.advertise<tf2_msgs::TFMessage>("/tf", 100);
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
  ASSERT_TRUE(waitFor([&] {
    queue.callAvailable();
    return buffer.canTransform("map", "wheel", stamp);
  }));
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
  const NodeParameters parameters;
  std_msgs::Header header;
  header.frame_id = "camera";
  header.stamp = stamp;
  const PoseFrames frames(parameters, parameters.source);
  EXPECT_EQ(findPoses(buffer, frames, header, {}).why,
            "the transforms of 'camera' are faulty: " + fault);
}

TEST(TfReceiver, NamesThePublishersOfTwoParents) {
  ros::CallbackQueue queue;
  ros::NodeHandle nh("", {{"/tf", "/torn"}});
  nh.setCallbackQueue(&queue);
  TfBuffer buffer;
  const TfReceiver receiver(nh, buffer);
  const auto publisher = nh.advertise<tf2_msgs::TFMessage>("/tf", 100);
  const ros::Time begin(1000.0);
  const auto send = [&](const std::string& parent, double time_s) {
    tf2_msgs::TFMessage message;
    const ros::Time stamp = begin + ros::Duration(time_s);
    message.transforms = {makeTransform(parent, "base", makeTranslation(0, 0, 0), stamp)};
    publisher.publish(message);
  };
  for (int i = 0; i <= 20; ++i) send(i % 2 == 0 ? "map" : "odom", 0.1 * i);
  ASSERT_TRUE(waitFor([&] {
    queue.callAvailable();
    return buffer.canTransform("map", "base", begin + ros::Duration(2.0));
  }));
  const NodeParameters parameters;
  std_msgs::Header header;
  header.frame_id = "base";
  header.stamp = begin + ros::Duration(1.95);
  const PoseFrames frames(parameters, parameters.source);
  const PoseSearch search = findPoses(buffer, frames, header, {});
  EXPECT_EQ(search.hopeless, DropReason::kNoTransform) << "tf has not begun after it";
  const std::string by = " (" + ros::this_node::getName() + ")";
  EXPECT_EQ(search.why.find("the transforms of 'base' are faulty: they have different parents in "
                            "turn, 'map'" +
                            by + " and 'odom'" + by),
            0U)
      << search.why;
  header.stamp = begin - ros::Duration(1.0);
  EXPECT_EQ(findPoses(buffer, frames, header, {}).hopeless, DropReason::kBeforeTf);
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
