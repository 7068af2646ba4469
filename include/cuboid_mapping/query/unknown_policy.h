// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace cuboid_mapping {

/// Meaning of unknown space for a query. Services use the same numbers, Python the same words.
enum class UnknownPolicy : unsigned char {
  kObstacle,  ///< It is in the way.
  kFree,      ///< It is free, as with ignoreUnknownCells of octomap's castRay.
};

}  // namespace cuboid_mapping
