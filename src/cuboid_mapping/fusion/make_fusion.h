// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/fusion.h"
#include "cuboid_mapping/fusion/fusion_kind.h"
#include "cuboid_mapping/fusion/growth_config.h"

#include <memory>

namespace cuboid_mapping {

/// What a back-end is made of.
struct FusionConfig {
  FusionKind kind = FusionKind::kClass;  ///< Which one is made.
  GrowthConfig growth;                   ///< Of kGrowth.
  RTreeConfig rtree;                     ///< Order (d, M) of its tree.
  int threads = 1;                       ///< >= 1. The cuboids do not depend on it.
};

/// A back-end without cuboids. @param model  That of the map.
[[nodiscard]] std::unique_ptr<Fusion> makeFusion(const FusionConfig& config,
                                                 const SensorModel& model);

}  // namespace cuboid_mapping
