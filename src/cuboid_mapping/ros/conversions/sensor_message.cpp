// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/sensor_message.h"

namespace cuboid_mapping_ros {
namespace {

struct HeaderOf {
  template <typename MessageT>
  const std_msgs::Header& operator()(const MessageT& message) const {
    return message->header;
  }
  const std_msgs::Header& operator()(const DepthImage& depth) const { return depth.image->header; }
};

struct BytesOf {
  std::size_t operator()(const sensor_msgs::PointCloud2::ConstPtr& cloud) const {
    return sizeof(*cloud) + cloud->data.capacity();
  }
  std::size_t operator()(const sensor_msgs::LaserScan::ConstPtr& scan) const {
    return sizeof(*scan) + (scan->ranges.capacity() + scan->intensities.capacity()) * sizeof(float);
  }
  std::size_t operator()(const DepthImage& depth) const {
    return sizeof(*depth.image) + depth.image->data.capacity() + sizeof(*depth.camera);
  }
};

}  // namespace

const std_msgs::Header& SensorMessage::header() const { return std::visit(HeaderOf{}, content); }

std::size_t SensorMessage::numBytes() const { return std::visit(BytesOf{}, content); }

}  // namespace cuboid_mapping_ros
