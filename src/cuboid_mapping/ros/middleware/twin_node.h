// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

namespace cuboid_mapping_ros {

/// Looks for a running node with the name of this one, which has not been started yet. If this one registered, the
/// master would end the other, and a `respawn` of both would go on for ever.
/// @return URI of a node that answers; nothing if there is none, or no master.
[[nodiscard]] std::optional<std::string> findTwin();

}  // namespace cuboid_mapping_ros
