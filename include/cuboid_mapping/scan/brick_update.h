// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/brick.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace cuboid_mapping {

/// Maximum length of a beam along an axis, in voxels: the edge of the map that OctoMap's 16 bits can
/// number, so that every beam of OctoMap is accepted. 3.3 km at 0.05 m.
constexpr std::int32_t kMaxBeamVoxels = 65535;

/// Ranges of beams.
struct BeamRanges {
  /// Maximum range, at which longer beams are cut: > 0; infinity for no limit.
  double max_range_m = std::numeric_limits<double>::infinity();
  /// Length before a return or an open end in which a beam frees unknown voxels only, >= 0. With 0, a beam misses all voxels
  /// before its end, as in OctoMap.
  double end_margin_m = 0.0;
  /// Beams free unknown voxels only where they lie along what their neighbours hit, see SurfaceMargins.
  bool keep_surfaces = false;
};

/// The voxels of one brick that a cloud observes.
struct BrickUpdate {
  Cell brick;        ///< Least cell of the brick.
  BrickMask hits;    ///< Voxels in which a beam ends.
  BrickMask misses;  ///< Voxels that a beam passes. A voxel that is also a hit counts as a hit.
  /// Voxels that beams pass in their end margin, or along a surface, only, see BeamRanges: misses if they are unknown, else nothing.
  /// A voxel that is also a hit or a miss counts as that.
  BrickMask grazes{};
};

/// Whether an update has no observation.
[[nodiscard]] constexpr bool isEmpty(const BrickUpdate& update) {
  return update.hits.isEmpty() && update.misses.isEmpty() && update.grazes.isEmpty();
}

/// The observations of one cloud: each voxel at most once.
///
/// A beam that ends ...            | misses, from the origin's voxel on        | hit
/// --------------------------------|-------------------------------------------|------------------
/// within max range                | up to the end point's voxel, excluded     | end point's voxel
/// in the origin's voxel           | none                                      | that voxel
/// beyond max range                | up to the voxel where it is cut, included | none
/// as a no-return                  | up to its end, or the cut, included       | none
/// as an open end, within max range| up to the end point's voxel, excluded     | none
/// outside the grid*, or not finite| none                                      | none; is counted
/// beyond kMaxBeamVoxels*          | none                                      | none; is counted
/// (no beam) at a free point       | its voxel, within kMaxBeamVoxels          | none
/// * where it is cut, if it is.
///
/// With an end margin, a beam to a hit or an open end grazes the voxels of those slabs of its longest axis that it
/// enters in the margin, and misses the others. With keep_surfaces, so do no-returns, cut or not.
/// A voxel that is hit and missed is a hit. The rules are those of octomap_server's insertScan.
/// octomap::OccupancyOcTreeBase::computeUpdate differs in one point: it leaves out the voxel where a beam is
/// cut.
struct ScanUpdate {
  std::vector<BrickUpdate> bricks;  ///< One for each touched brick, along the Morton curve.
  std::vector<Cell> samples;        ///< Cells drawn along the beams, see BeamSampling.
  std::size_t num_points = 0;       ///< Beams that took part: points, no-returns, open ends.
  /// Beams left out: an end is not finite, or outside the grid after the cut.
  std::size_t num_out_of_range = 0;
  /// Beams left out: longer than kMaxBeamVoxels after the cut, or of a sensor too far from the first, see ScanUpdater.
  std::size_t num_too_far = 0;
};

/// Whether each brick comes once, along the Morton curve.
[[nodiscard]] bool isOrdered(const std::vector<BrickUpdate>& bricks);

/// The same voxels with each brick once, along the Morton curve. @complexity O(n log n).
[[nodiscard]] std::vector<BrickUpdate> ordered(std::vector<BrickUpdate> bricks);

/// One observation of what two saw, such as two sensors at the same time: each voxel once, and a hit wins.
/// Counts are sums. Neither needs to be ordered. @complexity O(n log n).
[[nodiscard]] ScanUpdate unite(ScanUpdate first, const ScanUpdate& second);

}  // namespace cuboid_mapping
