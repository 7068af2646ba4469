// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/beam_sampling.h"

#include <memory>
#include <optional>

namespace cuboid_mapping {

class GrowthRules;

/// Parameters of the fusion of the paper, Section IV-B.
struct GrowthConfig {
  BeamSampling sampling{
      0.1, 1};  ///< Random cells along the beams; they start to grow, as end points do.
  /// Clouds that a split-off voxel waits before it may fuse again, 0 to kMaxSettleClouds.
  ///@{
  static constexpr int kMaxSettleClouds = 1'000'000;
  int settle_clouds = 10;
  ///@}
  /// Probabilities beyond which voxels may fuse (paper, conditions (7) and (8)): alpha_min 0.0005 to 0.5, alpha_max 0.5
  /// to 0.9995. Nothing:
  /// the clamping thresholds, also where these are nearer to 0.5. With 0.5 and 0.5 all voxels of a class may fuse.
  ///@{
  std::optional<double> alpha_min;
  std::optional<double> alpha_max;
  ///@}
  /// Rules of an experiment, in place of the paper's. Null in programs that map.
  std::shared_ptr<const GrowthRules> rules;
};

}  // namespace cuboid_mapping
