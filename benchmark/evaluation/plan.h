// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "run.h"
#include "timing.h"

#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping::bench {

/// Which runs of a data set are done; all of them with OctoMap's at each resolution.
enum class RunChoice : unsigned char {
  kAll,    ///< All but those that kLetter adds.
  kSpeed,  ///< What ratios of speed rest on: growth, at the reference the paper to the letter.
  /// The paper to the letter with each M at each resolution, at the reference with more and fewer cells
  /// in T.
  kLetter,
};

struct EvaluationOptions {
  std::vector<std::string> datasets;
  std::string folder = "evaluation";  ///< Gets a folder for each data set.
  std::vector<double> resolutions_m{0.1, 0.2, 0.4, 0.6, 0.8, 1.0};
  std::vector<int> branchings{4, 8, 16, 32, 64};
  double reference_m = 0.2;  ///< Resolution of what is not swept over resolutions.
  std::vector<double> samples_per_m{0.0, 0.03, 0.1, 0.3, 1.0};  ///< Of kLetter, along beams.
  int num_drives = 3;  ///< Simulated, of the moving objects.
  RunChoice runs = RunChoice::kAll;
  std::size_t max_clouds = std::numeric_limits<std::size_t>::max();
  int every = 1;                          ///< Only the first of so many clouds.
  double query_time_s = kTimedQueries_s;  ///< CPU time of the timed visits of a run, at least.
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
