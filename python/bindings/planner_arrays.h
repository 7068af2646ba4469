// SPDX-License-Identifier: BSD-3-Clause
// Helpers of the bindings of planner queries.
#pragma once

#include "arrays.h"

#include <Eigen/Core>

#include <cmath>
#include <limits>
#include <string>

namespace cuboid_map_python {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const Eigen::Vector3d kNowhere = Eigen::Vector3d::Constant(NAN);

/// Name of an element, such as "paths[3]".
inline std::string element(const char* name, std::size_t index) {
  return std::string(name) + "[" + std::to_string(index) + "]";
}

/// @throws Error
inline void require(bool is_right, const std::string& text) {
  if (!is_right) throw Error(text);
}

}  // namespace cuboid_map_python
