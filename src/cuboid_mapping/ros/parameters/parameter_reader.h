// SPDX-License-Identifier: BSD-3-Clause
// Internal to parameters.h: reads a group of parameters, of the node or of one source.
#pragma once

#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Values that are no structs, by their keys with slashes.
[[nodiscard]] std::map<std::string, XmlRpc::XmlRpcValue> leavesOf(const XmlRpc::XmlRpcValue& group);

/// The value of a key in a group; each slash may be a part of a key or lead into a group.
[[nodiscard]] std::optional<XmlRpc::XmlRpcValue> findValue(const XmlRpc::XmlRpcValue& group,
                                                           const std::string& key);

/// A value as YAML, shortened to one line.
[[nodiscard]] std::string describe(XmlRpc::XmlRpcValue value);

/// Text such as "is 3, but there is no such parameter: did you mean x?". @param no_such  Such as "there is no such".
[[nodiscard]] std::string describeUnknown(const std::string& key, const XmlRpc::XmlRpcValue& value,
                                          const std::string& no_such,
                                          const std::vector<std::string>& known_keys);

/// Reads all parameters, or those that a source may have, and checks them against each other.
void readGroup(const XmlRpc::XmlRpcValue& group, bool is_source, LoadedParameters& loaded);

/// Reads the list of sources. @pre All other parameters have been read.
void readSources(LoadedParameters& loaded);

}  // namespace cuboid_mapping_ros
