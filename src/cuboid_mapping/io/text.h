// SPDX-License-Identifier: BSD-3-Clause
// Readable numbers for messages.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <cstdint>
#include <iterator>
#include <locale>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// A count with its noun: "1 cloud", "2 clouds". @param noun  In the singular, with a regular plural.
[[nodiscard]] inline std::string counted(std::uint64_t count, const std::string& noun) {
  return std::to_string(count) + ' ' + noun + (count == 1 ? "" : "s");
}

/// Joins texts with a separator. @param texts  A container of std::string.
template <typename TextsT>
[[nodiscard]] std::string join(const TextsT& texts, const std::string& separator) {
  std::string joined;
  for (const std::string& text : texts) joined += (joined.empty() ? "" : separator) + text;
  return joined;
}

/// The words between white space.
[[nodiscard]] inline std::vector<std::string> wordsOf(const std::string& text) {
  std::istringstream words(text);
  return {std::istream_iterator<std::string>(words), {}};
}

/// A number with a limited number of digits: "0.25", "107374182", "1.25e+11", "NaN", "-inf".
[[nodiscard]] inline std::string toText(double value, int max_digits = 9) {
  if (std::isnan(value)) return "NaN";
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(max_digits);
  out << value;
  return out.str();
}

/// The first number in a text; nothing without one.
template <typename T>
[[nodiscard]] std::optional<T> parseNumber(const std::string& text) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  T value{};
  if (!(in >> value)) return std::nullopt;
  return value;
}

/// A decimal number that reads back as the same, with as few digits beyond six as that takes.
[[nodiscard]] inline std::string toExactText(double value) {
  int digits = 6;
  while (digits < 17 && parseNumber<double>(toText(value, digits)) != value) ++digits;
  return toText(value, digits);
}

/// A point or a vector: "(1, 2.5, NaN)".
[[nodiscard]] inline std::string toText(const Eigen::Vector3d& vector) {
  return '(' + toText(vector.x()) + ", " + toText(vector.y()) + ", " + toText(vector.z()) + ')';
}

}  // namespace cuboid_mapping
