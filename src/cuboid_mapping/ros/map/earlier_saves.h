// SPDX-License-Identifier: BSD-3-Clause
// Earlier saves of a map, as files beside it.
#pragma once

#include <string>

namespace cuboid_mapping_ros {

/// Name of an earlier save of a file: NAME.1.ext is the previous one.
[[nodiscard]] std::string earlierSave(const std::string& map_file, int number);

/// Keeps the map of a file that is about to be replaced, with its locks, as earlierSave(1). The earlier saves
/// move on by one, and the last of `count` is removed. The file itself exists, and is whole, at any time.
/// @throws std::exception  if a file cannot be written. All others stay.
void keepEarlierSaves(const std::string& map_file, int count);

}  // namespace cuboid_mapping_ros
