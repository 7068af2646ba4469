// SPDX-License-Identifier: BSD-3-Clause
// The saves of a map before the last one, as files beside it.
#pragma once

#include <string>

namespace cuboid_mapping_ros {

/// Name of an earlier save of a file: NAME.1.ext is the one before the last.
[[nodiscard]] std::string earlierSave(const std::string& map_file, int number);

/// Puts the map of a file, which is about to be replaced, beside it as earlierSave(1), with its locks. The earlier ones
/// move on by one, and the last of `count` goes. The file itself is there, and whole, at any time.
/// @throws std::exception  When a file cannot be written. All others stay.
void keepEarlierSaves(const std::string& map_file, int count);

}  // namespace cuboid_mapping_ros
