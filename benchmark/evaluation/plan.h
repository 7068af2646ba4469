// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "run.h"

#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping::bench {

struct EvaluationOptions {
  std::vector<std::string> datasets;
  std::string folder = "evaluation";  ///< Gets a folder for each data set.
  std::vector<double> resolutions_m{0.1, 0.2, 0.4, 0.6, 0.8, 1.0};
  std::vector<int> branchings{2, 4, 8, 16, 32, 64};
  double reference_m = 0.2;  ///< Resolution of what is not swept over resolutions.
  int num_drives = 3;        ///< Simulated, of the moving objects.
  /// Only what ratios of speed rest on, to be repeated: at each resolution OctoMap and growth, at the
  /// reference the paper to the letter, too.
  bool is_speed_only = false;
  std::size_t max_clouds = std::numeric_limits<std::size_t>::max();
};

/// Runs that share the clouds and the resolution, OctoMap's first.
struct RunGroup {
  double resolution_m;
  double rotation_deg;
  std::vector<RunSpec> specs;
};

/// All runs of a data set: the paper's sweeps over resolution and M, then at the reference
/// resolution fusion strategies, environments, steps, search orders, starters, and rotations.
[[nodiscard]] std::vector<RunGroup> makePlan(const EvaluationOptions& options);

/// The paper's method as this package has it, with M branches: in a dynamic environment, cells that
/// cannot grow are tried again when something beside them has, split cells settle, and the R-tree
/// packs what is fused. RunSpec::reading has it to the letter.
[[nodiscard]] RunSpec paperRun(double resolution_m, int max_branches);

}  // namespace cuboid_mapping::bench
