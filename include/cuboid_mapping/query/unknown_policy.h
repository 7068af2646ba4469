// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace cuboid_mapping {

/// Treatment of unknown space by a query.
enum class UnknownPolicy : unsigned char {
  kPass,  ///< Free, as with ignoreUnknownCells of octomap's castRay.
  kStop,  ///< An obstacle.
};

}  // namespace cuboid_mapping
