// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/twin_node.h"

#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <xmlrpcpp/XmlRpc.h>

#include <chrono>
#include <cstdint>

namespace cuboid_mapping_ros {
namespace {

/// Time for an answer; a node that has ended refuses the connection at once.
constexpr std::chrono::seconds kPatience(2);

/// Whether a node answers at this address.
bool answers(const std::string& host, std::uint32_t port) {
  XmlRpc::XmlRpcValue request;
  request[0] = ros::this_node::getName();
  XmlRpc::XmlRpcClient node(host.c_str(), static_cast<int>(port), "/");
  if (!node.executeNonBlock("getPid", request)) return false;
  XmlRpc::XmlRpcDispatch dispatch;
  dispatch.addSource(&node,
                     XmlRpc::XmlRpcDispatch::WritableEvent | XmlRpc::XmlRpcDispatch::Exception);
  XmlRpc::XmlRpcValue pid;
  const auto end = std::chrono::steady_clock::now() + kPatience;
  bool has_answered = false;
  while (!has_answered && std::chrono::steady_clock::now() < end) {
    dispatch.work(0.1);
    has_answered = node.executeCheckDone(pid);
  }
  dispatch.removeSource(&node);
  return has_answered && !node.isFault() && pid.valid();
}

}  // namespace

std::optional<std::string> findTwin() {
  XmlRpc::XmlRpcValue request;
  request[0] = ros::this_node::getName();
  request[1] = ros::this_node::getName();
  XmlRpc::XmlRpcValue response;
  XmlRpc::XmlRpcValue uri;
  if (!ros::master::execute("lookupNode", request, response, uri, false)) return std::nullopt;
  if (uri.getType() != XmlRpc::XmlRpcValue::TypeString) return std::nullopt;
  const std::string address = uri;
  std::string host;
  std::uint32_t port = 0;
  const bool is_twin = ros::network::splitURI(address, host, port) && answers(host, port);
  return is_twin ? std::optional(address) : std::nullopt;
}

}  // namespace cuboid_mapping_ros
