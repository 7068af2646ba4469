// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace cuboid_mapping {

/// How a query treats unknown space.
enum class UnknownPolicy : unsigned char {
  kPass,  ///< As free: octomap's castRay with ignoreUnknownCells.
  kStop,  ///< An obstacle.
};

}  // namespace cuboid_mapping
