// SPDX-License-Identifier: BSD-3-Clause
// Numbers in messages, written as people write them.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <cstdint>
#include <locale>
#include <sstream>
#include <string>

namespace cuboid_mapping {

/// A count with its noun: "1 cloud", "2 clouds". @param noun  In the singular, with a regular plural.
[[nodiscard]] inline std::string counted(std::uint64_t count, const std::string& noun) {
  return std::to_string(count) + ' ' + noun + (count == 1 ? "" : "s");
}

/// A number with at most nine digits: "0.25", "107374182", "1.25e+11", "NaN", "-inf".
[[nodiscard]] inline std::string toText(double value) {
  if (std::isnan(value)) return "NaN";
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(9);
  out << value;
  return out.str();
}

/// A point or a vector: "(1, 2.5, NaN)".
[[nodiscard]] inline std::string toText(const Eigen::Vector3d& vector) {
  return '(' + toText(vector.x()) + ", " + toText(vector.y()) + ", " + toText(vector.z()) + ')';
}

}  // namespace cuboid_mapping
