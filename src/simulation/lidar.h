// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "simulation/world.h"

#include <cstdint>
#include <string>
#include <vector>

namespace cuboid_mapping {

struct LidarConfig {
  int rings = 32;     ///< Beams above each other, 1 to 1024.
  int columns = 900;  ///< Beams in one revolution, 1 to 100000: steps of 0.4 degrees.
  double min_elevation_rad = -0.5236;  ///< Elevation of the lowest ring, from -pi/2 on.
  double max_elevation_rad = 0.5236;   ///< Elevation of the highest ring, up to pi/2.
  double max_range_m = 30.0;           ///< Farther surfaces give no return; 0.1 to 1000.
  double range_noise_m = 0.01;  ///< Standard deviation of ranges, 0 to 1; cut off at 3 times it.
  std::uint64_t seed = 1;       ///< Seed of the noise.
};

/// Errors of a configuration, a line each: key, value, allowed range. Empty: none.
[[nodiscard]] std::vector<std::string> checkLidarConfig(const LidarConfig& config);

/// A return, or NaN in x, y and z (intensity 0) without return. Metres, lidar frame.
struct LidarPoint {
  float x, y, z;
  float intensity;  ///< Reflectivity of the surface, 0 to 1.
};

/// One revolution, organized.
struct LidarCloud {
  int rings = 0;
  int columns = 0;
  std::vector<LidarPoint> points;  ///< points[ring * columns + column]
};

/// A spinning lidar. Lidar frame: z up, x forward.
///
/// Ring 0 is the highest one. Column 0 looks along x, the following ones anticlockwise, seen from
/// above. A revolution is taken at one instant: nothing moves while the lidar turns, so a cloud has
/// one pose and needs no motion correction. Thread-safe: const.
class Lidar {
 public:
  /// @pre checkLidarConfig(config) finds no error.
  explicit Lidar(const LidarConfig& config);
  /// A sensor with other beams, such as a camera: its cloud has their order.
  /// @param directions  Directions in the sensor frame, of length 1; rings * columns of them. Elevations are
  ///                    ignored.
  Lidar(const LidarConfig& config, std::vector<Eigen::Vector3d> directions);

  /// Points of one turn of the lidar.
  ///
  /// @param solids  All solids that can be hit.
  /// @param T_map_lidar  Pose of the lidar.
  /// @param number  Number of the revolution. The noise depends on it and the seed only, so that a cloud
  ///                does not depend on whether earlier clouds were computed.
  /// @complexity O(rings * columns * solids) at worst; few solids are tried if surfaces are near.
  [[nodiscard]] LidarCloud computeCloud(const std::vector<Solid>& solids,
                                        const Eigen::Isometry3d& T_map_lidar,
                                        std::uint64_t number) const;

 private:
  LidarConfig config_;
  std::vector<Eigen::Vector3d> directions_lidar_;  ///< Directions of all beams, length 1.
};

}  // namespace cuboid_mapping
