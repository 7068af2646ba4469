// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/occupancy/sensor_model.h"

#include <string>
#include <vector>

namespace cuboid_mapping {

struct MapConfig;
struct MapperConfig;

/// One thing that is wrong with a configuration.
struct ConfigError {
  std::string field;    ///< Name in C++, such as "rtree.max_branches".
  std::string message;  ///< The value and its allowed range: "is 200, but must be 2 to 64".
};

/// Everything that is wrong with a configuration, in the order of its fields; empty for a good one.
/// The parameters of the fusion `growth` count only where it is chosen.
///@{
[[nodiscard]] std::vector<ConfigError> checkConfig(const SensorModelConfig& config);
[[nodiscard]] std::vector<ConfigError> checkConfig(const MapConfig& config);
[[nodiscard]] std::vector<ConfigError> checkConfig(const MapperConfig& config);
///@}

/// Does nothing without errors.
/// @throws std::invalid_argument  where there are errors: its text says all of them.
void throwIfAny(const std::vector<ConfigError>& errors);

/// The configuration, where nothing is wrong with it. @throws std::invalid_argument as above.
template <typename ConfigT>
const ConfigT& checked(const ConfigT& config) {
  throwIfAny(checkConfig(config));
  return config;
}

}  // namespace cuboid_mapping
