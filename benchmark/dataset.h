// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/scan.h"

#include <cstddef>
#include <string>
#include <vector>

namespace cuboid_mapping::bench {

/// Where scans come from.
struct DatasetChoice {
  std::string path;         ///< A folder, a .graph, or a .bag.
  std::string cloud_topic;  ///< Of a bag; empty: the only topic of clouds that there is.
  std::string map_frame;    ///< Of a bag.
  std::size_t max_scans = 0;
  int laps = 1;        ///< See repeatElsewhere().
  int point_step = 1;  ///< Only the first of so many points of a cloud.
  int every = 1;       ///< Only the first of so many of the max_scans scans.
};

/// Reads scans into memory, with a progress bar on a terminal.
/// @return At least one scan.
/// @throws std::runtime_error saying what cannot be read and why, or that there is no point.
[[nodiscard]] std::vector<Scan> readScans(const DatasetChoice& choice);

/// The scans again and again, each time in surroundings of the same form, but elsewhere: a longer
/// drive, which shows how the cost of a cloud grows with the map. Laps lie along x, apart by a multiple
/// of 64 m, so that no cell is seen in two of them.
/// @param laps  >= 1; with 1 the scans stay as they are.
[[nodiscard]] std::vector<Scan> repeatElsewhere(const std::vector<Scan>& scans, int laps);

/// readScans for a bag: sensor_msgs/PointCloud2, and tf from /tf and /tf_static.
///
/// All transforms of the bag count, also those behind a cloud. Beams start in the origin of the
/// cloud's frame. Clouds that have no transform, or that the node would refuse, are left out, and
/// said on stderr.
[[nodiscard]] std::vector<Scan> readBagScans(const DatasetChoice& choice);

}  // namespace cuboid_mapping::bench
