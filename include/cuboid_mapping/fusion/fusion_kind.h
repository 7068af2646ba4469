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

/// When a brick whose classes have changed is divided into cuboids, with FusionKind::kClass. The cuboids are
/// the same.
enum class FusionTime : unsigned char {
  kEveryCloud,  ///< With each change, by all threads (the paper).
  kWhenRead,    ///< When somebody reads its cuboids: for programs that read at the end.
};

/// "every_cloud" or "when_read".
[[nodiscard]] const char* toString(FusionTime time);
/// Inverse of toString(); nothing for another text.
[[nodiscard]] std::optional<FusionTime> parseFusionTime(const std::string& text);

/// "class", "growth" or "none".
[[nodiscard]] const char* toString(FusionKind kind);

/// Inverse of toString(); nothing for another text.
[[nodiscard]] std::optional<FusionKind> parseFusionKind(const std::string& text);

}  // namespace cuboid_mapping
