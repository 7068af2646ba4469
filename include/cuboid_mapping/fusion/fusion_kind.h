// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

namespace cuboid_mapping {

/// How voxels become cuboids.
enum class FusionKind : unsigned char {
  kClass,   ///< Large boxes of one class in bricks of 8 x 8 x 8 voxels.
  kGrowth,  ///< That of the paper, see GrowthConfig.
  kNone,    ///< Every voxel stays a cuboid: the baseline.
};

/// "class", "growth" or "none".
[[nodiscard]] const char* toString(FusionKind kind);

/// Inverse of toString(); nothing for another text.
[[nodiscard]] std::optional<FusionKind> parseFusionKind(const std::string& text);

}  // namespace cuboid_mapping
