// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/tf_buffer.h"
#include "ros/node_probe.h"

#include <ros/callback_queue.h>

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

}  // namespace
}  // namespace cuboid_mapping_ros::test
