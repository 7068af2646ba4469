// SPDX-License-Identifier: BSD-3-Clause
// A map, and its changes, as flat arrays: what the messages CuboidMap and CuboidMapUpdate carry. Knows
// neither the map nor ROS.
#pragma once

#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// A whole map; msg/CuboidMap.msg says what each field means.
struct MapImage {
  std::uint64_t instance = 0;
  std::uint64_t revision = 0;
  double resolution_m = 0.0;
  std::vector<std::int32_t> bounds;
  std::vector<float> log_odds;
};

/// Changes of a map; msg/CuboidMapUpdate.msg says what each field means.
struct MapDelta {
  std::uint64_t instance = 0;
  std::uint64_t base = 0;
  std::uint64_t revision = 0;
  bool is_everything = false;
  double resolution_m = 0.0;
  std::vector<std::int32_t> boxes;
  std::vector<std::uint32_t> counts;
  std::vector<std::uint8_t> offsets;
  std::vector<float> log_odds;
};

}  // namespace cuboid_mapping
