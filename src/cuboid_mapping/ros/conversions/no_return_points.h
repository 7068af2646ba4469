// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

/// Readings that say that a beam met nothing up to the sensor's range; a set of the first five. In REP 117,
/// +inf stands for this, -inf for an object that is too near, and NaN for a failed measurement.
enum class NoReturnPoints : unsigned char {
  kPlusInf = 1,
  kNan = 2,
  kZero = 4,
  kMinusInf = 8,
  kRangeMax = 16,  ///< range_max of a planar scan, or more.
  kNone = 0,
  kRep117 = kPlusInf,
  kWithNan = kPlusInf | kNan,    ///< For drivers that write NaN for every point without return.
  kWithZero = kPlusInf | kZero,  ///< For drivers that write zeros.
  kAll = kPlusInf | kNan | kZero | kMinusInf | kRangeMax
};

/// Whether a set holds a reading, one of the first five.
[[nodiscard]] constexpr bool contains(NoReturnPoints set, NoReturnPoints reading) {
  return (static_cast<unsigned>(set) & static_cast<unsigned>(reading)) != 0;
}

/// Bound of readings: those beyond it, of either sign, are infinite. float32 can hold it.
constexpr double kMaxReading_m = 1e30;

/// Kind of a reading without a return; kNone for any other number.
[[nodiscard]] NoReturnPoints classifyReading(double number);

/// Ranges in metres that stand for no return, such as the far clip of a simulated camera.
using NoReturnRanges = std::vector<double>;

/// Whether a range is in the list, up to the rounding of floats and half a millimetre.
[[nodiscard]] inline bool contains(const NoReturnRanges& ranges_m, double range_m) {
  return std::any_of(ranges_m.begin(), ranges_m.end(), [range_m](double named_m) {
    return std::abs(range_m - named_m) <= 5e-4 + 1e-6 * named_m;
  });
}

/// Value of the parameter: a name such as "with_nan", or readings such as "nan zero"; then ranges such as
/// "81.91".
[[nodiscard]] std::string toText(NoReturnPoints points, const NoReturnRanges& ranges_m = {});

/// Inverse of toText(), readings and ranges in any order; nothing for another text.
[[nodiscard]] std::optional<std::pair<NoReturnPoints, NoReturnRanges>> parseNoReturnPoints(
    const std::string& text);

}  // namespace cuboid_mapping_ros
