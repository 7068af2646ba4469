// SPDX-License-Identifier: BSD-3-Clause
// What programs have in common that measure on one data set and report in JSON.
#pragma once

#include "command_line.h"

#include <cstddef>
#include <limits>
#include <string>

namespace cuboid_mapping::bench {

struct Measurement {
  std::string dataset;
  std::string out;
  double resolution_m = 0.2;
  std::size_t max_clouds = std::numeric_limits<std::size_t>::max();
};

/// Declares all of it. @param resolution_help  What voxels have that edge.
inline void declareMeasurement(CommandLine& line, Measurement& measurement,
                               const std::string& resolution_help = "edge of a voxel [m]") {
  line.addArgument("dataset", measurement.dataset,
                   "folder with poses.txt and scans/NNNN.pcd, or a .graph file of OctoMap");
  line.addText("out", measurement.out, "JSON file for the figures; else they are printed");
  line.addNumber("resolution", measurement.resolution_m, resolution_help, {0.001, 1000.0});
  line.addNumber("clouds", measurement.max_clouds, "only the first N clouds", {1});
}

}  // namespace cuboid_mapping::bench
