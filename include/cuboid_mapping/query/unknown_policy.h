// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace cuboid_mapping {

/// What unknown space is to a query.
enum class UnknownPolicy : unsigned char {
  kPass,  ///< As free: octomap's castRay with ignoreUnknownCells.
  kStop,  ///< An obstacle.
};

}  // namespace cuboid_mapping
