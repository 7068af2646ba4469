// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/map/guarded_map.h"
#include "support/random_bricks.h"
#include "support/snapshots.h"

#include <map>

namespace cuboid_mapping_ros::test {

/// Configuration of a map that is saved and loaded in tests.
inline cuboid_mapping::MapConfig makeConfig() {
  cuboid_mapping::MapConfig config;
  config.resolution_m = 0.1;
  return config;
}

/// Adds some random clouds.
inline void fill(GuardedMap& map, cuboid_mapping::test::Random& random) {
  for (int i = 0; i < 8; ++i) {
    const auto update = cuboid_mapping::test::randomUpdate(random, {{-3, -3, -3}, {3, 3, 3}}, 9);
    map.change(ros::Time(3.0),
               [&](cuboid_mapping::CuboidMap& content) { return content.apply(update); });
  }
}

/// The voxels of a map.
inline std::map<cuboid_mapping::Cell, float> voxelsOf(const GuardedMap& map) {
  return map.read([](const cuboid_mapping::CuboidMap& content, const ros::Time&) {
    return cuboid_mapping::test::voxelsOf(content);
  });
}

}  // namespace cuboid_mapping_ros::test
