// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/config_check.h"

#include "cuboid_mapping/map/mapper.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace cuboid_mapping {
namespace {

/// Collects errors.
class Checker {
 public:
  /// @param allowed  Completes the sentence "is 200, but must be ..."
  template <typename T>
  void expect(bool is_good, const std::string& field, const T& value, const std::string& allowed) {
    if (is_good) return;
    std::ostringstream text;
    text << "is " << value << ", but must be " << allowed;
    errors_.push_back({field, text.str()});
  }
  /// @param last  The enumerators are 0 to this one.
  template <typename EnumT>
  void expectEnumerator(const std::string& field, EnumT value, EnumT last) {
    expect(value <= last, field, static_cast<int>(value), "one of its enumerators");
  }
  template <typename T>
  void expectWithin(const std::string& field, T value, T low, T high) {
    std::ostringstream allowed;
    allowed << low << " to " << high;
    expect(value >= low && value <= high, field, value, allowed.str());  // NaN fails it, too
  }
  void append(const std::string& prefix, const std::vector<ConfigError>& errors) {
    for (const ConfigError& error : errors)
      errors_.push_back({prefix + error.field, error.message});
  }
  [[nodiscard]] std::vector<ConfigError> take() { return std::move(errors_); }

 private:
  std::vector<ConfigError> errors_;
};

void check(const GrowthConfig& growth, Checker& checker) {
  const double per_m = growth.sampling.per_m;
  checker.expect(per_m >= 0.0 && per_m <= 100.0, "growth.sampling.per_m", per_m, "0 to 100");
  checker.expectWithin("growth.settle_clouds", growth.settle_clouds, 0,
                       GrowthConfig::kMaxSettleClouds);
  checker.expectWithin("growth.alpha_min", growth.alpha_min.value_or(0.5), 1.0 - kMostOccupied,
                       0.5);
  checker.expectWithin("growth.alpha_max", growth.alpha_max.value_or(0.5), 0.5, kMostOccupied);
}

void check(const RTreeConfig& rtree, Checker& checker) {
  const bool is_max_good =
      rtree.max_branches >= 4 && rtree.max_branches <= RTreeConfig::kMaxBranchesLimit;
  checker.expectWithin("rtree.max_branches", rtree.max_branches, 4,
                       +RTreeConfig::kMaxBranchesLimit);
  checker.expect(rtree.min_branches >= 2, "rtree.min_branches", rtree.min_branches, "at least 2");
  checker.expect(!is_max_good || rtree.min_branches <= rtree.max_branches / 2, "rtree.min_branches",
                 rtree.min_branches,
                 "at most half of max_branches (" + std::to_string(rtree.max_branches) +
                     "): set it to at most " + std::to_string(rtree.max_branches / 2) +
                     ", or max_branches to at least " + std::to_string(2 * rtree.min_branches));
}

}  // namespace

std::vector<ConfigError> checkConfig(const SensorModelConfig& config) {
  Checker checker;
  checker.expectWithin("hit", config.hit, kLeastOccupied, kMostOccupied);
  checker.expectWithin("miss", config.miss, 1.0 - kMostOccupied, 1.0 - kLeastOccupied);
  checker.expectWithin("alpha_min", config.alpha_min, 1.0 - kMostOccupied, 1.0 - kLeastOccupied);
  checker.expectWithin("alpha_max", config.alpha_max, kLeastOccupied, kMostOccupied);
  return checker.take();
}

std::vector<ConfigError> checkConfig(const MapConfig& config) {
  Checker checker;
  checker.expectWithin("resolution_m", config.resolution_m, MapConfig::kMinResolution_m,
                       MapConfig::kMaxResolution_m);
  checker.append("sensor_model.", checkConfig(config.sensor_model));
  checker.expectEnumerator("environment", config.environment, Environment::kStatic);
  checker.expectEnumerator("fusion", config.fusion, FusionKind::kNone);
  checker.expectEnumerator("fuse", config.fuse, FusionTime::kWhenRead);
  if (config.fusion == FusionKind::kGrowth) check(config.growth, checker);
  check(config.rtree, checker);
  checker.expectWithin("threads", config.threads, 1, MapConfig::kMaxThreads);
  return checker.take();
}

std::vector<ConfigError> checkConfig(const MapperConfig& config) {
  Checker checker;
  checker.append("map.", checkConfig(config.map));
  checker.expect(config.max_range_m > 0.0, "max_range_m", config.max_range_m,
                 "greater than 0 (infinity: no limit)");
  checker.expect(config.end_margin_m >= 0.0 && std::isfinite(config.end_margin_m), "end_margin_m",
                 config.end_margin_m, "at least 0, and finite");
  return checker.take();
}

void throwIfAny(const std::vector<ConfigError>& errors) {
  if (errors.empty()) return;
  std::string text = "bad configuration: ";
  for (const ConfigError& error : errors) {
    if (&error != &errors.front()) text += "; ";
    text += error.field + ' ' + error.message;
  }
  throw std::invalid_argument(text);
}

}  // namespace cuboid_mapping
