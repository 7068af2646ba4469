// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/no_return_points.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/middleware/core_names.h"

#include <boost/lexical_cast/try_lexical_convert.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <sstream>

namespace cuboid_mapping_ros {
namespace {

struct NamedReadings {
  const char* name;
  NoReturnPoints readings;
  bool is_set;  ///< A set stands for itself, and goes with no other name.
};
constexpr std::array<NamedReadings, 10> kNames{{{"rep_117", NoReturnPoints::kRep117, true},
                                                {"with_nan", NoReturnPoints::kWithNan, true},
                                                {"with_zero", NoReturnPoints::kWithZero, true},
                                                {"all", NoReturnPoints::kAll, true},
                                                {"none", NoReturnPoints::kNone, true},
                                                {"plus_inf", NoReturnPoints::kPlusInf, false},
                                                {"nan", NoReturnPoints::kNan, false},
                                                {"zero", NoReturnPoints::kZero, false},
                                                {"minus_inf", NoReturnPoints::kMinusInf, false},
                                                {"range_max", NoReturnPoints::kRangeMax, false}}};

}  // namespace

NoReturnPoints classifyReading(double number) {
  if (std::isnan(number)) return NoReturnPoints::kNan;
  if (number == 0.0) return NoReturnPoints::kZero;
  if (number < -kMaxReading_m) return NoReturnPoints::kMinusInf;
  return number > kMaxReading_m ? NoReturnPoints::kPlusInf : NoReturnPoints::kNone;
}

std::string toText(NoReturnPoints points, const NoReturnRanges& ranges_m) {
  std::ostringstream text;
  text.precision(9);
  const auto* const named = std::find_if(kNames.begin(), kNames.end(), [points](const auto& other) {
    return other.is_set && other.readings == points;
  });
  if (named != kNames.end()) text << named->name;
  for (const auto& [name, reading, is_set] : kNames) {
    const bool is_listed = named == kNames.end() && !is_set && contains(points, reading);
    if (is_listed) text << (text.tellp() > 0 ? " " : "") << name;
  }
  for (const double range_m : ranges_m) text << ' ' << range_m;
  return text.str();
}

std::optional<std::pair<NoReturnPoints, NoReturnRanges>> parseNoReturnPoints(
    const std::string& text) {
  unsigned set = 0;
  NoReturnRanges ranges_m;
  std::size_t num_names = 0;
  bool has_name_of_set = false;
  const std::vector<std::string> words = wordsOf(text);
  for (const std::string& word : words) {
    const auto* const named = std::find_if(
        kNames.begin(), kNames.end(), [&word](const auto& other) { return word == other.name; });
    double range_m = 0.0;
    if (named != kNames.end()) {
      set |= static_cast<unsigned>(named->readings);
      has_name_of_set = has_name_of_set || named->is_set;
      ++num_names;
    } else if (boost::conversion::try_lexical_convert(word, range_m) && std::isfinite(range_m) &&
               range_m > 0.0) {
      ranges_m.push_back(range_m);
    } else {
      return std::nullopt;
    }
  }
  if (words.empty() || (has_name_of_set && num_names > 1)) return std::nullopt;
  return std::make_pair(static_cast<NoReturnPoints>(set), ranges_m);
}

}  // namespace cuboid_mapping_ros
