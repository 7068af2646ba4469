// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "simulation/world.h"

#include <cstdint>
#include <random>
#include <vector>

/// The parts of the simulated world, in the site frame: metres, origin at
/// the south-west corner of the building, on the ground; x east, y north.
namespace cuboid_mapping::site {

/// Thickness of all walls.
inline constexpr double kWallThickness_m = 0.2;
inline constexpr double kCeiling_m = 2.8;
inline constexpr double kDoorHeight_m = 2.1;

/// The door that opens: hinge at (x, y), its leaf along +x while it is closed, turning to -y.
inline constexpr double kHingeX_m = 14.5;
inline constexpr double kHingeY_m = 5.0;
inline constexpr double kDoorWidth_m = 1.0;

/// Numbers that are the same on every machine, unlike those of std::uniform_real_distribution.
class Random {
 public:
  explicit Random(std::uint64_t seed) : generator_(seed) {}

  /// Uniform in [from, to).
  double uniform(double from, double to) {
    return from + (to - from) * static_cast<double>(generator_() >> 11) * 0x1.0p-53;
  }

 private:
  std::mt19937_64 generator_;
};

using Solids = std::vector<Solid>;

/// Appends an axis-aligned box.
inline void addBox(Solids& solids, SolidKind kind, const Eigen::Vector3d& min_m,
                   const Eigen::Vector3d& max_m) {
  solids.push_back({kind, MetricBox{min_m, max_m}});
}

void addGround(Solids& solids);

/// Walls with doorways and windows, ceiling, stairs, pillars.
void addBuilding(Solids& solids);

/// Adds tables, shelves and cupboards to the rooms, clear of the robot's path and the door.
void addFurniture(Solids& solids, Random& random);

/// Adds a fence, trees, a car, and crates.
void addYard(Solids& solids, Random& random);

}  // namespace cuboid_mapping::site
