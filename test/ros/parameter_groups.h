// SPDX-License-Identifier: BSD-3-Clause
// Groups of parameters as the parameter server has them, and what the node says to them.
#pragma once

#include "cuboid_mapping/ros/parameters/parameters.h"

#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

using XmlRpc::XmlRpcValue;

/// Sets a key with slashes in nested structs.
inline void set(XmlRpcValue& group, const std::string& key, const XmlRpcValue& value) {
  const std::size_t slash = key.find('/');
  if (slash == std::string::npos) {
    group[key] = value;
  } else {
    set(group[key.substr(0, slash)], key.substr(slash + 1), value);
  }
}

inline XmlRpcValue makeGroup(const std::vector<std::pair<std::string, XmlRpcValue>>& values) {
  XmlRpcValue group;
  for (const auto& [key, value] : values) set(group, key, value);
  return group;
}

/// What values of the parameter server become in the struct of a feature, or of a step of the only source.
template <typename T>
T readInto(const std::vector<std::pair<std::string, XmlRpcValue>>& values) {
  const NodeParameters parameters = readParameters(makeGroup(values)).parameters;
  if constexpr (std::is_base_of_v<StepParameters, T>) {
    return parameters.source.of<T>();
  } else {
    return parameters.of<T>();
  }
}

inline std::vector<std::string> keysOf(const std::vector<ParameterError>& errors) {
  std::vector<std::string> keys;
  keys.reserve(errors.size());
  for (const ParameterError& error : errors) keys.push_back(error.key);
  return keys;
}

inline bool hasText(const ParameterError& error, const std::string& text) {
  return error.message.find(text) != std::string::npos;
}

/// Warning of the node about a key; empty if there is none.
inline std::string warningOf(const LoadedParameters& loaded, const std::string& key) {
  std::string text;
  for (const ParameterError& warning : loaded.warnings) {
    if (warning.key == key) text += warning.message;
  }
  return text;
}

}  // namespace cuboid_mapping_ros
