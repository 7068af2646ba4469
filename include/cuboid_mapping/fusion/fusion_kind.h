// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

namespace cuboid_mapping {

/// Method by which voxels become cuboids.
enum class FusionKind : unsigned char {
  kClass,   ///< Large boxes of one class in bricks of 8 x 8 x 8 voxels.
  kGrowth,  ///< The paper's fusion, see GrowthConfig.
  kNone,    ///< Every voxel is a cuboid: the baseline.
};

/// Time at which FusionKind::kClass divides a brick whose classes have changed. The cuboids are the same.
enum class FusionTime : unsigned char {
  kEveryCloud,  ///< With each cloud, by all threads (the paper); after an edit, when read.
  kWhenRead,    ///< At the first read of its cuboids: for programs that read at the end.
};

/// Name of a time: "every_cloud" or "when_read".
[[nodiscard]] const char* toString(FusionTime time);

/// Name of a method: "class", "growth" or "none".
[[nodiscard]] const char* toString(FusionKind kind);

/// Inverse of toString(); nothing for another text.
[[nodiscard]] std::optional<FusionKind> parseFusionKind(const std::string& text);

}  // namespace cuboid_mapping
