// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace cuboid_mapping_ros {

/// Text of doc/parameters.md: key, default with its unit, allowed values and help of each parameter, in
/// groups; names of octomap_server are in bold.
[[nodiscard]] std::string toMarkdownTable();

/// Text of config/default.yaml: every parameter with its default, help as comments.
[[nodiscard]] std::string toYaml();

}  // namespace cuboid_mapping_ros
