// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/fusion.h"
#include "cuboid_mapping/fusion/growth_fusion.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// The back-ends of Fusion.
enum class FusionKind : unsigned char {
  kClass,   ///< Large boxes of one class in bricks of 8 x 8 x 8 voxels, see ClassFusion.
  kGrowth,  ///< That of the paper, see GrowthFusion.
  kNone,    ///< Every voxel stays a cuboid: the baseline.
};

/// "class", "growth" or "none".
[[nodiscard]] const char* toString(FusionKind kind);

/// Inverse of toString(); nothing for another text.
[[nodiscard]] std::optional<FusionKind> parseFusionKind(const std::string& text);

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
