// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/config_check.h"

#include "cuboid_mapping/map/mapper.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace cuboid_mapping {
namespace {

std::vector<std::string> fieldsOf(const std::vector<ConfigError>& errors) {
  std::vector<std::string> fields;
  for (const ConfigError& error : errors) fields.push_back(error.field);
  return fields;
}

/// @param change  (MapConfig&): makes one field bad.
template <typename ChangeT>
void expectError(const std::string& field, const ChangeT& change) {
  MapConfig config;
  change(config);
  EXPECT_EQ(fieldsOf(checkConfig(config)), std::vector<std::string>{field});
  EXPECT_THROW(CuboidMap{config}, std::invalid_argument) << field;
  MapperConfig mapper;
  mapper.map = config;
  EXPECT_THROW(Mapper{mapper}, std::invalid_argument) << field;
}

TEST(CheckConfig, findsNothingInDefaults) {
  EXPECT_TRUE(checkConfig(MapperConfig()).empty());
  MapperConfig growth;
  growth.map.fusion = FusionKind::kGrowth;
  EXPECT_TRUE(checkConfig(growth).empty());
}

TEST(CheckConfig, takesTheBoundsOfTheRanges) {
  MapConfig config;
  config.sensor_model = {0.50001, 0.49999, 0.0005, 0.9995};
  config.rtree = {RTreeConfig::kMaxBranchesLimit, RTreeConfig::kMaxBranchesLimit / 2};
  for (const double resolution_m : {MapConfig::kMinResolution_m, MapConfig::kMaxResolution_m}) {
    config.resolution_m = resolution_m;
    EXPECT_TRUE(checkConfig(config).empty());
    EXPECT_EQ(CuboidMap(config).config().resolution_m, resolution_m);
  }
  config.rtree = {4, 2};
  EXPECT_TRUE(checkConfig(config).empty());
}

TEST(CheckConfig, findsEachBadField) {
  for (const double bad : {0.0, -0.1, std::numeric_limits<double>::infinity(), std::nan("")}) {
    expectError("resolution_m", [bad](MapConfig& c) { c.resolution_m = bad; });
    expectError("sensor_model.hit", [bad](MapConfig& c) { c.sensor_model.hit = bad; });
    expectError("sensor_model.miss", [bad](MapConfig& c) { c.sensor_model.miss = bad; });
  }
  expectError("sensor_model.alpha_min", [](MapConfig& c) { c.sensor_model.alpha_min = 0.5; });
  expectError("sensor_model.alpha_max", [](MapConfig& c) { c.sensor_model.alpha_max = 1.0; });
  expectError("environment", [](MapConfig& c) { c.environment = static_cast<Environment>(7); });
  expectError("fusion", [](MapConfig& c) { c.fusion = static_cast<FusionKind>(7); });
  expectError("rtree.max_branches", [](MapConfig& c) { c.rtree.max_branches = 65; });
  expectError("rtree.min_branches", [](MapConfig& c) { c.rtree.min_branches = 17; });
  expectError("rtree.min_branches", [](MapConfig& c) { c.rtree.min_branches = 1; });
  expectError("rtree.min_branches", [](MapConfig& c) { c.rtree = {4, 3}; });
  constexpr int kLimit = RTreeConfig::kMaxBranchesLimit;
  expectError("rtree.min_branches", [](MapConfig& c) { c.rtree = {kLimit, kLimit / 2 + 1}; });
  // A bad maximum number of branches is not reported as a bad minimum.
  expectError("rtree.max_branches", [](MapConfig& c) { c.rtree = {3, 2}; });
  expectError("rtree.max_branches", [](MapConfig& c) { c.rtree = {2 * kLimit, 2 * kLimit}; });
  expectError("threads", [](MapConfig& c) { c.threads = 0; });
  expectError("fuse", [](MapConfig& c) { c.fuse = static_cast<FusionTime>(7); });
}

TEST(CheckConfig, looksAtGrowthWhereItIsChosen) {
  MapConfig config;
  config.growth.sampling.per_m = 1e9;
  config.growth.alpha_min = 0.51;
  config.growth.alpha_max = 0.49;
  config.growth.settle_clouds = -1;
  EXPECT_TRUE(checkConfig(config).empty());
  config.fusion = FusionKind::kGrowth;
  const std::vector<std::string> expected = {"growth.sampling.per_m", "growth.settle_clouds",
                                             "growth.alpha_min", "growth.alpha_max"};
  EXPECT_EQ(fieldsOf(checkConfig(config)), expected);
  config.growth = {};
  config.growth.settle_clouds = std::numeric_limits<int>::max();
  EXPECT_EQ(fieldsOf(checkConfig(config)), std::vector<std::string>{"growth.settle_clouds"})
      << "a list with room for each of them";
  config.growth = {};
  for (const double per_m : {100.1, 1e30, -1.0, std::nan(""), HUGE_VAL}) {
    config.growth.sampling.per_m = per_m;
    EXPECT_EQ(fieldsOf(checkConfig(config)), std::vector<std::string>{"growth.sampling.per_m"})
        << per_m;
    EXPECT_THROW(CuboidMap{config}, std::invalid_argument) << per_m;
  }
}

TEST(CheckConfig, saysAllErrorsAtOnce) {
  MapperConfig config;
  config.map.resolution_m = -0.1;
  config.map.rtree.max_branches = 200;
  config.max_range_m = std::nan("");
  try {
    const Mapper mapper(config);
    FAIL() << "nothing was thrown";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(),
                 "bad configuration: map.resolution_m is -0.1, but must be 0.001 to 100; "
                 "map.rtree.max_branches is 200, but must be 4 to 64; "
                 "max_range_m is nan, but must be greater than 0 (infinity: no limit)");
  }
}

TEST(CheckConfig, keepsABadSensorModelOutOfAMap) {
  CuboidMap map;
  SensorModelConfig bad;
  bad.miss = 0.6;
  EXPECT_THROW(map.setSensorModel(bad), std::invalid_argument);
  EXPECT_EQ(map.config().sensor_model.miss, SensorModelConfig().miss);
}

}  // namespace
}  // namespace cuboid_mapping
