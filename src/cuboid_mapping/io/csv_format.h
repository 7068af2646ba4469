// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/io/progress_listener.h"
#include "cuboid_mapping/map/map_snapshot.h"

#include <string>

namespace cuboid_mapping {

/// A line of names, then for each cuboid the faces in metres (map frame), the probability, and
/// "free" or "occupied". Sorted as by sortCuboids().
/// @param listener  Is told of cuboids.
[[nodiscard]] std::string toCsv(const MapSnapshot& snapshot, const ProgressListener& listener);

}  // namespace cuboid_mapping
