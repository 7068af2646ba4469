// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/occupancy/sensor_model.h"

#include <string>
#include <vector>

namespace cuboid_mapping {

struct MapConfig;
struct MapperConfig;

/// One error in a configuration.
struct ConfigError {
  std::string field;    ///< Name in C++, such as "rtree.max_branches".
  std::string message;  ///< The value and its allowed range: "is 200, but must be 4 to 64".
};

/// All errors in a configuration, in the order of its fields; empty if there are none.
/// The parameters of the fusion `growth` are checked only if it is chosen.
///@{
[[nodiscard]] std::vector<ConfigError> checkConfig(const SensorModelConfig& config);
[[nodiscard]] std::vector<ConfigError> checkConfig(const MapConfig& config);
[[nodiscard]] std::vector<ConfigError> checkConfig(const MapperConfig& config);
///@}

/// Does nothing without errors. @throws std::invalid_argument  with all errors in its text.
void throwIfAny(const std::vector<ConfigError>& errors);

/// The configuration itself, if it has no errors. @throws std::invalid_argument as above.
template <typename ConfigT>
const ConfigT& checked(const ConfigT& config) {
  throwIfAny(checkConfig(config));
  return config;
}

}  // namespace cuboid_mapping
