// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace cuboid_mapping::bench {

/// Draws the plots of one data set as SVG and PNG into a folder: nodes, cells, insertion and access
/// as the paper's Figure 7 (a) to (d), then sizes, time and rotation.
///
/// A plot for which there are no runs is left out.
/// @param runs  Of one data set.
/// @throws std::runtime_error when gnuplot is missing or fails.
void drawPlots(const std::vector<nlohmann::json>& runs, double reference_m,
               const std::string& folder);

}  // namespace cuboid_mapping::bench
