// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/no_return_points.h"

#include <boost/lexical_cast/try_lexical_convert.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <sstream>

namespace cuboid_mapping_ros {
namespace {

using NamedReadings = std::pair<const char*, NoReturnPoints>;
constexpr std::array<NamedReadings, 5> kReadings{{{"plus_inf", NoReturnPoints::kPlusInf},
                                                  {"nan", NoReturnPoints::kNan},
                                                  {"zero", NoReturnPoints::kZero},
                                                  {"minus_inf", NoReturnPoints::kMinusInf},
                                                  {"range_max", NoReturnPoints::kRangeMax}}};
constexpr std::array<NamedReadings, 5> kSetsOfReadings{{{"rep_117", NoReturnPoints::kRep117},
                                                        {"with_nan", NoReturnPoints::kWithNan},
                                                        {"with_zero", NoReturnPoints::kWithZero},
                                                        {"all", NoReturnPoints::kAll},
                                                        {"none", NoReturnPoints::kNone}}};

}  // namespace

NoReturnPoints classifyReading(double number) {
  if (std::isnan(number)) return NoReturnPoints::kNan;
  if (number == 0.0) return NoReturnPoints::kZero;
  if (number < -kMaxReading_m) return NoReturnPoints::kMinusInf;
  return number > kMaxReading_m ? NoReturnPoints::kPlusInf : NoReturnPoints::kNone;
}

bool contains(const NoReturnRanges& ranges_m, double range_m) {
  return std::any_of(ranges_m.begin(), ranges_m.end(), [range_m](double named_m) {
    return std::abs(range_m - named_m) <= 5e-4 + 1e-6 * named_m;
  });
}

std::string toText(NoReturnPoints points, const NoReturnRanges& ranges_m) {
  std::ostringstream text;
  text.precision(9);
  const auto named = std::find_if(kSetsOfReadings.begin(), kSetsOfReadings.end(),
                                  [points](const auto& set) { return set.second == points; });
  if (named != kSetsOfReadings.end()) {
    text << named->first;
  } else {
    for (const auto& [name, reading] : kReadings) {
      if (contains(points, reading)) text << (text.tellp() > 0 ? " " : "") << name;
    }
  }
  for (const double range_m : ranges_m) text << ' ' << range_m;
  return text.str();
}

std::optional<std::pair<NoReturnPoints, NoReturnRanges>> parseNoReturnPoints(
    const std::string& text) {
  unsigned set = 0;
  NoReturnRanges ranges_m;
  std::size_t num_words = 0;
  bool has_name_of_set = false;
  std::istringstream words(text);
  for (std::string word; words >> word; ++num_words) {
    const auto is_word = [&word](const auto& named) { return word == named.first; };
    const auto reading = std::find_if(kReadings.begin(), kReadings.end(), is_word);
    const auto named_set = std::find_if(kSetsOfReadings.begin(), kSetsOfReadings.end(), is_word);
    double range_m = 0.0;
    if (reading != kReadings.end()) {
      set |= static_cast<unsigned>(reading->second);
    } else if (named_set != kSetsOfReadings.end()) {
      if (set != 0 || has_name_of_set) return std::nullopt;
      set = static_cast<unsigned>(named_set->second);
      has_name_of_set = true;
      continue;
    } else if (boost::conversion::try_lexical_convert(word, range_m) && std::isfinite(range_m) &&
               range_m > 0.0) {
      ranges_m.push_back(range_m);
      continue;
    } else {
      return std::nullopt;
    }
    if (has_name_of_set) return std::nullopt;
  }
  if (num_words == 0) return std::nullopt;
  return std::make_pair(static_cast<NoReturnPoints>(set), ranges_m);
}

}  // namespace cuboid_mapping_ros
