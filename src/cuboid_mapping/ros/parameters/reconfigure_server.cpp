// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/reconfigure_server.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/parameters/reconfigure.h"

#include <dynamic_reconfigure/config_tools.h>
#include <ros/console.h>
#include <ros/master.h>
#include <ros/this_node.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

ReconfigureServer::ReconfigureServer(const ros::NodeHandle& private_nh,
                                     const NodeParameters& parameters,
                                     std::function<void(const NodeParameters&)> apply)
    : private_nh_(private_nh),
      parameters_(parameters),
      apply_(std::move(apply)),
      master_thread_(guardOf(private_nh), "parameters for the master") {
  using dynamic_reconfigure::ConfigDescription;
  descriptions_ = private_nh_.advertise<ConfigDescription>(kParameterDescriptionsTopic, 1, true);
  descriptions_.publish(describeConfig());
  updates_ = private_nh_.advertise<dynamic_reconfigure::Config>(kParameterUpdatesTopic, 1, true);
  updates_.publish(toConfig(parameters_));
  server_ = offerService<dynamic_reconfigure::Reconfigure>(
      private_nh_, kSetParametersService,
      [this](const auto& request, auto& response) { onRequest(request, response); });
  master_thread_.start();
}

ReconfigureServer::~ReconfigureServer() { master_thread_.stop(); }

/// Sets the parameters in force on the parameter server, as dynamic_reconfigure::Server does.
void ReconfigureServer::tellMaster() {
  post(master_thread_.queue(), this, [values = runtimeValues(parameters_), nh = private_nh_] {
    for (const auto& [key, value] : values) {
      XmlRpc::XmlRpcValue request;
      XmlRpc::XmlRpcValue response;
      XmlRpc::XmlRpcValue payload;
      request[0] = ros::this_node::getName();
      request[1] = nh.resolveName(key);
      request[2] = value;
      // NodeHandle::setParam() would wait for a master.
      if (!ros::master::execute("setParam", request, response, payload, false)) return;
    }
  });
}

void ReconfigureServer::onRequest(const dynamic_reconfigure::ReconfigureRequest& request,
                                  dynamic_reconfigure::ReconfigureResponse& response) {
  const LoadedParameters loaded = applyConfig(parameters_, request.config);
  std::vector<std::string> refusals;
  for (const ParameterError& error : loaded.errors) {
    refusals.push_back(error.key + ' ' + error.message);
    ROS_ERROR_STREAM_NAMED(
        kNodeName, "set_parameters: " << refusals.back() << ". The whole request is refused");
  }
  const auto differences = toDifferenceLines(loaded.parameters, parameters_, "was");
  if (loaded.errors.empty() && !differences.empty()) {
    for (const std::string& line : differences) {
      ROS_INFO_STREAM_NAMED(kNodeName, "set_parameters: " << line);
    }
    parameters_ = loaded.parameters;
    apply_(parameters_);
    tellMaster();
    updates_.publish(toConfig(parameters_));
  }
  response.config = toConfig(parameters_);
  if (!loaded.errors.empty()) {
    // The message has no field for the reason, and clients ignore parameters that they do not know.
    dynamic_reconfigure::ConfigTools::appendParameter(response.config, kRefusedName,
                                                      join(refusals, "; "));
  }
}

}  // namespace cuboid_mapping_ros
