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

std::vector<std::string> publishersOf(const std::string& topic) {
  XmlRpc::XmlRpcValue request;
  request[0] = ros::this_node::getName();
  XmlRpc::XmlRpcValue response;
  XmlRpc::XmlRpcValue state;
  if (!ros::master::execute("getSystemState", request, response, state, false)) return {};
  std::vector<std::string> names;
  XmlRpc::XmlRpcValue& published = state[0];
  for (int i = 0; i < published.size(); ++i) {
    if (std::string(published[i][0]) != topic) continue;
    for (int j = 0; j < published[i][1].size(); ++j) names.push_back(published[i][1][j]);
  }
  return names;
}

std::string describeUnheard(std::size_t num_publishers, bool is_published,
                            const std::string& check) {
  if (num_publishers > 0) return ": " + check;
  if (!is_published) return ", nobody publishes it: " + check;
  return ", though it is published: the machines do not reach each other (set ROS_IP on each), or "
         "the publisher's log says that it has another version of the message";
}

}  // namespace cuboid_mapping_ros
