// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {

/// Messages that a player of the bag sends, in order.
struct BagContents {
  struct Cloud {
    std::string topic;
    sensor_msgs::PointCloud2 message;
    bool has_transform;  ///< There is one from `map`, at its stamp, in earlier messages.
    geometry_msgs::TransformStamped T_map_cloud;  ///< Set if there is one.
  };

  std::vector<Cloud> clouds;
  std::vector<tf2_msgs::TFMessage> transforms;
  std::vector<tf2_msgs::TFMessage> static_transforms;
  bool is_static_latched = false;
};

inline BagContents readBag(const std::string& file) {
  BagContents contents;
  tf2::BufferCore buffer(ros::Duration(1e6));
  rosbag::Bag bag(file);
  rosbag::View view(bag);
  for (const rosbag::MessageInstance& instance : view) {
    if (const auto transforms = instance.instantiate<tf2_msgs::TFMessage>()) {
      const bool is_static = instance.getTopic() == "/tf_static";
      for (const auto& transform : transforms->transforms) {
        buffer.setTransform(transform, "bag", is_static);
      }
      (is_static ? contents.static_transforms : contents.transforms).push_back(*transforms);
      if (is_static) {
        const auto header = *instance.getConnectionHeader();
        const auto latching = header.find("latching");
        contents.is_static_latched = latching != header.end() && latching->second == "1";
      }
    } else if (const auto cloud = instance.instantiate<sensor_msgs::PointCloud2>()) {
      const auto& header = cloud->header;
      const bool has_transform = buffer.canTransform("map", header.frame_id, header.stamp);
      contents.clouds.push_back({instance.getTopic(), *cloud, has_transform, {}});
      if (has_transform) {
        contents.clouds.back().T_map_cloud =
            buffer.lookupTransform("map", header.frame_id, header.stamp);
      }
    }
  }
  return contents;
}

}  // namespace cuboid_mapping_ros::test
