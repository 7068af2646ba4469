// SPDX-License-Identifier: BSD-3-Clause
// Inside of parameters.h: reading a group of parameters, of the node or of one source.
#pragma once

#include "cuboid_mapping/ros/parameters/parameters.h"

#include <functional>
#include <map>
#include <string>

namespace cuboid_mapping_ros {

/// Values that are no struct, by their keys with slashes.
using Leaves = std::map<std::string, XmlRpc::XmlRpcValue>;

[[nodiscard]] Leaves leavesOf(const XmlRpc::XmlRpcValue& group);

/// A value as YAML, as far as it fits in a line.
[[nodiscard]] std::string describe(const XmlRpc::XmlRpcValue& value);

using KeyFilter = std::function<bool(const std::string& key)>;

/// Reads the parameters that are wanted, and checks how all go together.
void readGroup(const XmlRpc::XmlRpcValue& group, const KeyFilter& is_wanted,
               LoadedParameters& loaded);

/// Reads the list of sources. @pre All else has been read.
void readSources(LoadedParameters& loaded);

}  // namespace cuboid_mapping_ros
