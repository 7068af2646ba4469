// SPDX-License-Identifier: BSD-3-Clause
#include "yaml_parameters.h"

#include <xmlrpcpp/XmlRpcException.h>
#include <yaml-cpp/yaml.h>

#include <stdexcept>

namespace cuboid_mapping_ros {
namespace {

using XmlRpc::XmlRpcValue;

XmlRpcValue toScalar(const YAML::Node& node) {
  const bool is_quoted = node.Tag() == "!";
  bool boolean = false;
  int integer = 0;
  double number = 0.0;
  if (!is_quoted && YAML::convert<int>::decode(node, integer)) return XmlRpcValue(integer);
  if (!is_quoted && YAML::convert<double>::decode(node, number)) return XmlRpcValue(number);
  if (!is_quoted && YAML::convert<bool>::decode(node, boolean)) return XmlRpcValue(boolean);
  return XmlRpcValue(node.Scalar());
}

constexpr int kMaxDepth = 100;

/// @param depth  Number of lists and groups around it: an alias can lie in itself.
XmlRpcValue toValue(const YAML::Node& node, int depth = 0) {
  if (depth > kMaxDepth)
    throw std::runtime_error("more than 100 lists or groups lie in each other");
  XmlRpcValue value;
  if (node.IsScalar()) return toScalar(node);
  if (node.IsMap()) {
    for (const auto& entry : node)
      value[entry.first.as<std::string>()] = toValue(entry.second, depth + 1);
  } else if (node.IsSequence()) {
    value.setSize(static_cast<int>(node.size()));
    for (int i = 0; i < static_cast<int>(node.size()); ++i) {
      value[i] = toValue(node[static_cast<std::size_t>(i)], depth + 1);
    }
  }
  return value;
}

void set(const std::string& setting, XmlRpcValue& parameters) {
  const std::size_t equals = setting.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw std::runtime_error("--set " + setting + ": write it as key=value");
  }
  const std::string key = setting.substr(0, equals);
  XmlRpcValue* group = &parameters;
  std::size_t begin = 0;
  for (std::size_t slash = key.find('/'); slash != std::string::npos;
       slash = key.find('/', begin)) {
    group = &(*group)[key.substr(begin, slash - begin)];
    begin = slash + 1;
  }
  (*group)[key.substr(begin)] = toValue(YAML::Load(setting.substr(equals + 1)));
}

}  // namespace

XmlRpcValue loadYamlParameters(const std::string& file, const std::vector<std::string>& settings) {
  XmlRpcValue parameters;
  std::string subject = file;
  try {
    if (!file.empty()) {
      const YAML::Node root = YAML::LoadFile(file);
      if (!root.IsMap() && !root.IsNull()) {
        throw std::runtime_error("it must have lines such as resolution: 0.1");
      }
      parameters = toValue(root);
    }
    for (const std::string& setting : settings) {
      subject = "--set " + setting;
      set(setting, parameters);
    }
  } catch (const XmlRpc::XmlRpcException& error) {
    throw std::runtime_error("cannot read " + subject + ": " + error.getMessage());
  } catch (const std::exception& error) {
    throw std::runtime_error("cannot read " + subject + ": " + error.what());
  }
  return parameters;
}

}  // namespace cuboid_mapping_ros
