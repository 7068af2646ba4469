// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sstream>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// Collects errors in the values of a configuration.
class RangeCheck {
 public:
  /// Adds the line "KEY = VALUE: must be from MIN to MAX" if the value is not, or is NaN.
  template <typename NumberT>
  void operator()(const std::string& key, NumberT value, NumberT min, NumberT max) {
    if (value >= min && value <= max) return;
    std::ostringstream line;
    line << key << " = " << value << ": must be from " << min << " to " << max;
    errors_.push_back(line.str());
  }

  [[nodiscard]] const std::vector<std::string>& errors() const { return errors_; }

 private:
  std::vector<std::string> errors_;
};

}  // namespace cuboid_mapping
