// SPDX-License-Identifier: BSD-3-Clause
// The map of a node in a rosbag with its topics cuboid_map and cuboid_map_updates. The header needs no ROS.
#pragma once

#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/map/progress_listener.h"

#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Selects a map of a bag.
struct RecordedMapOptions {
  std::string topic;   ///< Topic of FullCuboidMap; empty: the only one of the bag.
  std::string server;  ///< Namespace of the node's services; empty: the only one on the topic.
  double at_s = std::numeric_limits<double>::infinity();  ///< Time since the start of the bag.
};

/// A map that was read from a bag.
struct RecordedMap {
  cuboid_mapping::MapSnapshot snapshot;
  std::vector<std::string> notes;  ///< Lines: the source of the map, and warnings.
};

/// Whether a file is a rosbag, by its first bytes or its name.
[[nodiscard]] bool isBagFile(const std::string& file);

/// Reads the map that a client had at a time, from the last keyframe and the updates after it. A client that
/// has lost updates keeps its map until the next keyframe; a note says so.
///
/// @param listener  Reports messages.
/// @throws std::runtime_error  naming the file and the cure: it cannot be read, it has no such topic or more
///         than one, several nodes publish to it, or there is no whole map by that time.
/// @complexity O(n) in the bytes of the updates, and of the needed keyframes.
[[nodiscard]] RecordedMap readRecordedMap(const std::string& file,
                                          const RecordedMapOptions& options,
                                          const cuboid_mapping::ProgressListener& listener);

}  // namespace cuboid_mapping_ros
