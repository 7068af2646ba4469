// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/reconfigure.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <dynamic_reconfigure/config_tools.h>
#include <ros/console.h>
#include <ros/master.h>
#include <ros/this_node.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using dynamic_reconfigure::Config;
using dynamic_reconfigure::ConfigTools;
using XmlRpc::XmlRpcValue;

bool isDescribed(const ParameterDeclaration& declaration) {
  const std::string& key = declaration.key;
  return declaration.kind.is_adjustable || key == "frame_id" || key == "resolution";
}

/// Adds a value to a message. @return The name of its type.
const char* add(const std::string& name, XmlRpcValue value, Config& config) {
  switch (value.getType()) {
    case XmlRpcValue::TypeBoolean:
      ConfigTools::appendParameter(config, name, static_cast<bool&>(value));
      return "bool";
    case XmlRpcValue::TypeInt:
      ConfigTools::appendParameter(config, name, static_cast<int&>(value));
      return "int";
    case XmlRpcValue::TypeDouble:
      ConfigTools::appendParameter(config, name, static_cast<double&>(value));
      return "double";
    default:
      ConfigTools::appendParameter(config, name, static_cast<std::string&>(value));
      return "str";
  }
}

void addTopGroup(Config& config) {
  config.groups.emplace_back();
  config.groups.back().name = "Default";
  config.groups.back().state = 1;
}

/// Values of a request by name.
std::map<std::string, XmlRpcValue> valuesOf(const Config& request) {
  std::map<std::string, XmlRpcValue> values;
  for (const auto& p : request.doubles) values[p.name] = XmlRpcValue(p.value);
  for (const auto& p : request.ints) values[p.name] = XmlRpcValue(p.value);
  for (const auto& p : request.bools) values[p.name] = XmlRpcValue(p.value != 0);
  for (const auto& p : request.strs) values[p.name] = XmlRpcValue(p.value);
  return values;
}

/// Parameters with some other values, and the conflicts.
LoadedParameters readOver(const NodeParameters& parameters, const XmlRpcValue& values) {
  LoadedParameters loaded{parameters, {}, {}};
  loaded.parameters.sources.clear();  // They are read again: their missing parameters may change.
  readGroup(values, false, loaded);
  readSources(loaded);
  return loaded;
}

const ParameterDeclaration* findDeclaration(const std::string& name) {
  for (const ParameterDeclaration& declaration : parameterTable()) {
    if (declaration.key == name || toReconfigureName(declaration.key) == name) return &declaration;
  }
  return nullptr;
}

}  // namespace

std::string toReconfigureName(const std::string& key) {
  std::string name = key;
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

std::map<std::string, XmlRpcValue> runtimeValues(const NodeParameters& parameters) {
  std::map<std::string, XmlRpcValue> values;
  for (const ParameterDeclaration& declaration : parameterTable()) {
    if (declaration.kind.is_adjustable) values[declaration.key] = declaration.kind.get(parameters);
  }
  return values;
}

dynamic_reconfigure::ConfigDescription describeConfig() {
  // Numbers without a range get one, which sliders of graphical clients need. Values beyond it are accepted.
  constexpr double kWidest = 1000.0;
  dynamic_reconfigure::ConfigDescription description;
  description.groups.emplace_back();
  description.groups.front().name = "Default";
  for (const ParameterDeclaration& declaration : parameterTable()) {
    if (!isDescribed(declaration)) continue;
    XmlRpcValue least = declaration.kind.get({});  // Other kinds have their default for both ends.
    XmlRpcValue most = least;
    if (least.getType() == XmlRpcValue::TypeDouble) {
      least = std::max(declaration.kind.min, -kWidest);
      most = std::min(declaration.kind.max, kWidest);
    }
    dynamic_reconfigure::ParamDescription parameter;
    parameter.name = toReconfigureName(declaration.key);
    parameter.description = declaration.help;
    parameter.type = add(parameter.name, least, description.min);
    add(parameter.name, most, description.max);
    description.groups.front().parameters.push_back(parameter);
  }
  description.dflt = toConfig({});
  addTopGroup(description.min);
  addTopGroup(description.max);
  return description;
}

Config toConfig(const NodeParameters& parameters) {
  Config config;
  for (const ParameterDeclaration& declaration : parameterTable()) {
    if (!isDescribed(declaration)) continue;
    add(toReconfigureName(declaration.key), declaration.kind.get(parameters), config);
  }
  addTopGroup(config);
  return config;
}

LoadedParameters applyConfig(const NodeParameters& parameters, const Config& request) {
  std::vector<ParameterError> refusals;
  XmlRpcValue values;
  for (const auto& [name, value] : valuesOf(request)) {
    if (octomapServerOnly().count(name) > 0) continue;
    const ParameterDeclaration* declaration = findDeclaration(name);
    if (declaration == nullptr) {
      refusals.push_back({name, "is not a parameter: see ~parameter_descriptions"});
    } else if (declaration->kind.is_adjustable) {
      values[declaration->key] = value;
    } else if (value != declaration->kind.get(parameters)) {
      refusals.push_back({declaration->key,
                          "cannot be changed while the node runs: restart it with the new value"});
    }
  }
  // The resolution of a map_file may have made others wrong: that refuses no change.
  const std::vector<ParameterError> earlier = readOver(parameters, {}).errors;
  LoadedParameters loaded = readOver(parameters, values);
  for (const ParameterError& error : loaded.errors) {
    if (std::find(earlier.begin(), earlier.end(), error) == earlier.end())
      refusals.push_back(error);
  }
  if (!refusals.empty()) loaded.parameters = parameters;
  loaded.errors = std::move(refusals);
  return loaded;
}

ReconfigureServer::ReconfigureServer(const ros::NodeHandle& private_nh,
                                     const NodeParameters& parameters,
                                     std::function<void(const NodeParameters&)> apply)
    : private_nh_(private_nh), parameters_(parameters), apply_(std::move(apply)) {
  using dynamic_reconfigure::ConfigDescription;
  descriptions_ = private_nh_.advertise<ConfigDescription>(kParameterDescriptionsTopic, 1, true);
  descriptions_.publish(describeConfig());
  updates_ = private_nh_.advertise<dynamic_reconfigure::Config>(kParameterUpdatesTopic, 1, true);
  updates_.publish(toConfig(parameters_));
  server_ = offerService<dynamic_reconfigure::Reconfigure>(
      private_nh_, kSetParametersService, [this](const auto& request, auto& response) {
        const std::lock_guard<std::mutex> lock(mutex_);
        onRequest(request, response);
      });
}

/// Sets the parameters in force on the parameter server, as dynamic_reconfigure::Server does.
void ReconfigureServer::tellMaster() {
  post(*private_nh_.getCallbackQueue(), this, [this] {
    const std::lock_guard<std::mutex> telling(master_mutex_);
    const std::map<std::string, XmlRpc::XmlRpcValue> values = [this] {
      const std::lock_guard<std::mutex> lock(mutex_);
      return runtimeValues(parameters_);
    }();
    for (const auto& [key, value] : values) {
      XmlRpc::XmlRpcValue request;
      XmlRpc::XmlRpcValue response;
      XmlRpc::XmlRpcValue payload;
      request[0] = ros::this_node::getName();
      request[1] = private_nh_.resolveName(key);
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
