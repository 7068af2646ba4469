// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "comparison.h"

#include <string>

namespace cuboid_mapping::bench {

/// Writes what was measured to stdout, for people.
void printReport(const Options& options, const std::vector<Scan>& scans,
                 const Comparison& comparison);

/// The same as JSON; keys are said in benchmark/README.md. What has no value is null.
[[nodiscard]] std::string makeJsonReport(const Options& options, const std::vector<Scan>& scans,
                                         const Comparison& comparison);

/// Number of points of all scans.
[[nodiscard]] std::size_t countPoints(const std::vector<Scan>& scans);

}  // namespace cuboid_mapping::bench
