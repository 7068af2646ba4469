// SPDX-License-Identifier: BSD-3-Clause
// One run of the evaluation: a data set goes into one map.
#pragma once

#include "paper_grid.h"

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/scan/scan.h"

#include <octomap/OcTree.h>
#include <nlohmann/json.hpp>

#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping::bench {

/// What is run. Of OctoMap only resolution and rotation count.
struct RunSpec {
  bool is_octomap = false;
  std::optional<PaperReading> reading;  ///< Runs PaperGrid, in place of this package's map.
  MapConfig map;
  GrowthVariant growth;       ///< Rules of FusionKind::kGrowth.
  double rotation_deg = 0.0;  ///< Of the clouds about the z axis of the map.
};

/// Name of a run, fit for a file: equal for equal runs only.
[[nodiscard]] std::string nameOf(const RunSpec& spec);

/// Clouds turned about the z axis of the map.
/// @throws std::runtime_error when they lie more than 512 m from the origin, where OctoMap is not
///         exact.
[[nodiscard]] std::vector<Scan> rotate(const std::vector<Scan>& scans, double angle_deg);

/// OctoMap with all clouds, and its figures.
/// @param min_query_s  As of cpuTimeOfOne_s(); of the following functions, too.
[[nodiscard]] nlohmann::json runOctomap(const RunSpec& spec, const std::vector<Scan>& scans,
                                        double min_query_s, octomap::OcTree& tree);

/// The map with all clouds, fused after every one of them, and its figures.
/// @param octomap  With the same clouds: in a dynamic environment and with a lossless fusion the
///                 figures say how far both agree.
[[nodiscard]] nlohmann::json runCuboidMap(const RunSpec& spec, const std::vector<Scan>& scans,
                                          double min_query_s, const octomap::OcTree& octomap);

/// The paper's grid with all clouds, and its figures. @pre spec.reading.
[[nodiscard]] nlohmann::json runPaperGrid(const RunSpec& spec, const std::vector<Scan>& scans,
                                          double min_query_s);

}  // namespace cuboid_mapping::bench
