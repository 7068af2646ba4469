// SPDX-License-Identifier: BSD-3-Clause
// A map, and its changes, as flat arrays: what the messages CuboidMap and CuboidMapUpdate carry. Knows
// neither the map nor ROS.
#pragma once

#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// Whether log-odds travel with a map, or classes alone.
enum class MapDetail : unsigned char { kClasses, kValues };

/// Bricks with all that is in them; msg/CuboidBricks.msg says what each array means.
struct BrickArrays {
  std::vector<std::int32_t> bricks;    ///< Three for each brick.
  std::vector<std::uint16_t> counts;   ///< Cuboids of each brick.
  std::vector<std::uint8_t> bounds;    ///< Six for each cuboid.
  std::vector<std::uint8_t> occupied;  ///< 1 for an occupied cuboid, 0 for a free one.
  bool has_values = false;             ///< Whether log-odds travel, too.
  std::vector<float> values;  ///< Log-odds of each voxel of each cuboid; none without has_values.
};

/// A whole map; msg/CuboidMap.msg says what each field means.
struct MapImage {
  std::uint64_t instance = 0;  ///< Names the server; another one when it is restarted.
  std::uint64_t revision = 0;  ///< Of the map.
  double resolution_m = 0.0;   ///< Edge of a voxel.
  BrickArrays content;         ///< All bricks with a known voxel.
};

/// Changes of a map; msg/CuboidMapUpdate.msg says what each field means.
struct MapDelta {
  std::uint64_t instance = 0;  ///< As in MapImage.
  std::uint64_t base = 0;      ///< Revision that the changes are counted from.
  std::uint64_t revision = 0;  ///< Of the map after the changes.
  bool is_everything = false;  ///< The whole map was replaced; `content` has no bricks then.
  double resolution_m = 0.0;   ///< Edge of a voxel.
  BrickArrays content;         ///< Changed bricks as they are now; without cuboids: unknown.
};

}  // namespace cuboid_mapping
