// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// The known key most similar to another one; nothing if none is similar.
[[nodiscard]] std::optional<std::string> findNearestKey(const std::string& key,
                                                        const std::vector<std::string>& known_keys);

}  // namespace cuboid_mapping_ros
