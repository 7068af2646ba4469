// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/scan.h"

#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// Finds the part of each beam that lies along a surface: a beam that grazes the floor, the step before a riser, or a
/// table passes through voxels that other beams hit, but not through what they hit.
///
/// The surfaces are those between beams that are neighbours by direction. Not thread-safe; reuses its buffers.
class SurfaceMargins {
 public:
  /// @param reach_m  Distance from a surface within which a beam clears nothing. @param threads  >= 1.
  SurfaceMargins(double reach_m, int threads)
      : reach_m_(static_cast<float>(reach_m)), threads_(threads) {}

  /// @return For each point, and then for each open end, the length before it in which its beam is within reach of a
  ///         surface, and one reach more; 0 if that is less than two reaches: such a beam hits its surface, and does
  ///         not graze it. Valid until the next call. @complexity O(points).
  const std::vector<float>& compute(const Scan& scan);

 private:
  /// A direction, as a place in the grid of directions.
  struct Place {
    std::int16_t column;
    std::int16_t row;
  };

  /// A side in the grid.
  struct Way {
    int columns;
    int rows;
  };
  /// A neighbour's end, along a beam and across it.
  struct SeenEnd {
    float along_m;
    float across_m;
  };

  void place(const Scan& scan);
  [[nodiscard]] const Eigen::Vector3f* findNear(const Place& place, const Way& way,
                                                int& step) const;
  [[nodiscard]] static bool isGrazed(const SeenEnd& seen, const SeenEnd& next, const Way& way);
  [[nodiscard]] float beginOf(std::size_t beam, const Way& way) const;
  [[nodiscard]] float marginOf(std::size_t beam) const;

  float reach_m_;
  int threads_;
  std::vector<Eigen::Vector3f> ends_;  ///< From the sensor.
  std::vector<Place> places_;          ///< Of each end.
  std::vector<std::int32_t> grid_;     ///< An end of each direction; negative: none.
  std::vector<float> margins_m_;
};

}  // namespace cuboid_mapping
