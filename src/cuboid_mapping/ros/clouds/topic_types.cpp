// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/topic_types.h"

#include "cuboid_mapping/ros/conversions/compressed_depth.h"

#include <ros/master.h>
#include <ros/this_node.h>

#include <array>
#include <utility>

namespace cuboid_mapping_ros {

const char* datatypeOf(SourceType type, const std::string& topic) {
  if (type == SourceType::kDepthImage) return isCompressed(topic) ? kCompressed : kImages;
  return type == SourceType::kLaserScan ? kScans : kClouds;
}

std::string adviseOn(const std::string& datatype) {
  constexpr std::array<std::pair<const char*, const char*>, 6> kAdvice{
      {{"sensor_msgs/PointCloud", "convert it with point_cloud_converter"},
       {"sensor_msgs/MultiEchoLaserScan", "take one echo of it with laser_proc"},
       {"velodyne_msgs/VelodyneScan", "make clouds of its packets with velodyne_pointcloud"},
       {"ouster_ros/PacketMsg", "make clouds of its packets with ouster_ros"},
       {"livox_ros_driver/CustomMsg", "have the driver send PointCloud2 (xfer_format 0)"},
       {"livox_ros_driver2/CustomMsg", "have the driver send PointCloud2 (xfer_format 0)"}}};
  for (const auto& [name, advice] : kAdvice) {
    if (datatype == name) return advice;
  }
  return "";
}

std::string describeWrongType(const SourceParameters& source, const std::string& topic,
                              const std::string& datatype) {
  if (datatype == datatypeOf(source.type, topic)) return "";
  std::string cure = adviseOn(datatype);
  for (const SourceType type :
       {SourceType::kPointCloud, SourceType::kLaserScan, SourceType::kDepthImage}) {
    if (datatype == datatypeOf(type, topic))
      cure = std::string("set type to ") + toString(type) + " (roslaunch: type:=" + toString(type) +
             ")";
  }
  if (cure.empty()) cure = "name a topic of clouds, planar scans or depth images";
  return topic + " has messages of " + datatype + ", not of " + datatypeOf(source.type, topic) +
         " (type " + toString(source.type) + "): " + cure;
}

std::map<std::string, std::string> publishedTypes() {
  // Not by ros::master::getTopics(), which waits for a master that is gone.
  XmlRpc::XmlRpcValue request;
  request[0] = ros::this_node::getName();
  request[1] = "";
  XmlRpc::XmlRpcValue response;
  XmlRpc::XmlRpcValue topics;
  if (!ros::master::execute("getPublishedTopics", request, response, topics, false)) return {};
  std::map<std::string, std::string> types;
  for (int i = 0; i < topics.size(); ++i) types[topics[i][0]] = std::string(topics[i][1]);
  return types;
}

}  // namespace cuboid_mapping_ros
