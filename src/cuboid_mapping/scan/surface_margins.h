// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/scan.h"

#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// Finds the part of each beam that lies along a surface: a beam that grazes the floor, the step before a riser, or a
/// table passes through voxels that other beams hit, but not through what they hit.
///
/// The surfaces are those between the farthest ends of neighbouring directions, in an image of a degree. A beam without
/// a return that passes beside something, such as the edge of a wall, is taken to pass along it, too. Not thread-safe;
/// reuses its buffers.
class SurfaceMargins {
 public:
  /// @param reach_m  Distance from a surface within which a beam clears nothing. @param threads  >= 1.
  SurfaceMargins(double reach_m, int threads);

  /// @param margins  For each point, and then for each open end, the end of its beam that is within reach of a
  ///                 surface, and one reach more, as a share of the beam's length; 0 if the part within reach is
  ///                 shorter than two reaches: such a beam hits its surface, and does not graze it. Then for each no-return the part
  ///                 from two reaches before the nearest end of its neighbours on. @complexity O(points).
  void compute(const Scan& scan, std::vector<float>& margins);

 private:
  void place(const std::vector<Eigen::Vector3f>& ends, const Eigen::Vector3f& origin,
             std::int32_t* pixels, bool are_surfaces);
  void closeCircle(int row);
  void computeShares(int row);
  void findNearest(int first_row, int num_rows);
  void addNoReturns(const Scan& scan, float* shares);

  float reach_m_;
  int threads_;
  std::vector<std::int32_t> pixels_;  ///< Pixel of each end.
  /// Images of directions.
  ///@{
  std::vector<float> ranges_m_;    ///< Range of the farthest end; 0: none.
  std::vector<float> elevations_;  ///< Elevation of that end, in rows.
  std::vector<float> shares_;
  std::vector<float> nearest_m_;  ///< Range of the nearest end beside it; infinite: none.
  ///@}
  /// Pixels of ranges_m_ with the ends of the last scan.
  ///@{
  std::ptrdiff_t first_filled_ = 0;
  std::ptrdiff_t num_filled_ = 0;
  ///@}
};

}  // namespace cuboid_mapping
