// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/published_topics.h"

#include <ros/master.h>
#include <ros/this_node.h>

namespace cuboid_mapping_ros {

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

std::string describeUnheard(std::size_t num_publishers, bool is_published,
                            const std::string& check) {
  if (num_publishers > 0) return ": " + check;
  if (!is_published) return ", nobody publishes it: " + check;
  return ", though it is published: the machines do not reach each other (set ROS_IP on each), or "
         "the publisher's log says that it has another version of the message";
}

}  // namespace cuboid_mapping_ros
