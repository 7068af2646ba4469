// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <xmlrpcpp/XmlRpcValue.h>

#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Parameters of the node in the form of a parameter server: of a YAML file, then of texts
/// "key=value", which may have slashes in the key and win over the file.
/// @param file  Empty: none.
/// @throws std::runtime_error naming the file or the text that is not YAML.
[[nodiscard]] XmlRpc::XmlRpcValue loadYamlParameters(const std::string& file,
                                                     const std::vector<std::string>& settings);

}  // namespace cuboid_mapping_ros
