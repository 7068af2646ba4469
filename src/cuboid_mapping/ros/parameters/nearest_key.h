// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// The known key that is most like another one; nothing when none is near.
[[nodiscard]] std::optional<std::string> findNearestKey(const std::string& key,
                                                        const std::vector<std::string>& known_keys);

}  // namespace cuboid_mapping_ros
