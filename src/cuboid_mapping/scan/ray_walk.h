// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/scan/brick_update.h"

#include <Eigen/Core>

#include <cstdint>
#include <optional>

namespace cuboid_mapping {

/// Whether a beam between two cells is within kMaxBeamVoxels on every axis.
[[nodiscard]] constexpr bool isWithinReach(const Cell& start, const Cell& end) {
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t voxels = std::int64_t{end[axis]} - start[axis];
    if (voxels > kMaxBeamVoxels || voxels < -kMaxBeamVoxels) return false;
  }
  return true;
}

/// A beam, set up for the walk through the voxels that it passes.
///
/// The arithmetic (float32 direction, double borders) is that of octomap::OcTreeBaseImpl::
/// computeRayKeys 1.9.7, so that both pass the same voxels to the last bit; the algorithm is that
/// of Amanatides and Woo, "A Fast Voxel Traversal Algorithm for Ray Tracing", 1987.
struct Ray {
  Cell start;         ///< Voxel of the origin.
  Cell end;           ///< Voxel of the end point.
  int step[3];        ///< -1, 0 or 1 per axis.
  double t_max[3];    ///< Length at which the beam leaves the current voxel, per axis, in metres.
  double t_delta[3];  ///< Length from one voxel border to the next, per axis, in metres.
  double length_m;    ///< Length of the beam.
};

/// The slabs of a beam's longest axis (of equal ones, the first) that lie in its end margin.
struct MarginSlabs {
  int axis = -1;           ///< -1: none do.
  std::int32_t first = 0;  ///< The cell's coordinate where the beam enters the first.
};

/// @param margin_m  > 0. The slab where it begins is not in it, unless the beam is not longer.
[[nodiscard]] MarginSlabs findMarginSlabs(const Ray& ray, double margin_m);

/// Common start of all beams of a scan, prepared for computing many rays.
class RayOrigin {
 public:
  /// @param anchor_map  Added to `origin` and to the ends of the rays, see Scan.
  RayOrigin(const Grid& grid, const Eigen::Vector3d& anchor_map, const Eigen::Vector3f& origin);

  /// Voxel of the origin; nothing when it is outside the grid or not finite.
  [[nodiscard]] const std::optional<Cell>& cell() const { return cell_; }

  /// Arguments of the constructor.
  ///@{
  [[nodiscard]] const Grid& grid() const { return grid_; }
  [[nodiscard]] const Eigen::Vector3d& anchor() const { return anchor_map_; }
  [[nodiscard]] const Eigen::Vector3f& point() const { return origin_; }
  ///@}

  /// Signed distance from the origin to the next border down or up an axis, in metres. @pre cell().
  [[nodiscard]] double toBorder(int axis, bool is_up) const {
    return to_border_[axis][is_up ? 1 : 0];
  }

  /// Sets up the beam to a point. A beam so short that its length is rounded to 0 between two
  /// voxels (ends 1e-23 m off an edge) has no steps: it passes its first voxel only.
  /// @return false, with `ray` undefined, if the end is outside the grid or not
  /// finite, or the length is no float32.
  /// @pre cell().
  [[nodiscard]] bool computeRay(const Eigen::Vector3f& end, Ray& ray) const;

 private:
  Grid grid_;
  Eigen::Vector3d anchor_map_;
  Eigen::Vector3f origin_;
  std::optional<Cell> cell_;
  /// Signed distances from the origin to the next border down and up, per axis, in metres.
  double to_border_[3][2];
};

/// Cuts a beam at a range, with the arithmetic of octomath::Vector3::normalized() and octomap_server.
/// @return Whether the beam was longer.
bool cutBeam(const Eigen::Vector3f& origin, double max_range_m, Eigen::Vector3f& end);

/// Walks from the origin's voxel (included) to the end point's (excluded).
///
/// Cases:
///   - both points in one voxel: nothing is marked;
///   - a beam through an edge or a corner of voxels: one axis after the other; ties in the order
///     z, y, x;
///   - rounding errors make it miss the end voxel: it stops when the length of the beam is used up.
///
/// The walk ends for all points: after its first step it goes on only while the length so far
/// is at most the beam's, which is finite, and each step adds its t_delta to one of three
/// lengths. Where a step is not 0, t_delta is resolution / |component| with |component| < 2 (a rounded
/// unit vector), so that the sum grows by more than its rounding error: a grid has 2^31 voxels along
/// an axis, a double 53 bits. On an axis these are at most the voxels between both ends and two more,
/// one because the ends lie anywhere in theirs, one for rounding.
///
/// @param cursor  mark() marks the current voxel; advance(axis) goes on by ray.step[axis];
///                isAtEnd() tells whether the current voxel is the end point's. It starts in the
///                origin's voxel. It is passed by value, so that its state can stay in registers.
/// @return The cursor where it stopped.
/// @pre `ray` is from RayOrigin::computeRay().
/// @complexity O(number of voxels passed).
template <typename CursorT>
[[nodiscard]] CursorT walkRay(const Ray& ray, CursorT cursor) {
  if (ray.start == ray.end) return cursor;
  double t_x = ray.t_max[0];
  double t_y = ray.t_max[1];
  double t_z = ray.t_max[2];
  bool is_x_before_y = t_x < t_y;
  double t_xy = is_x_before_y ? t_x : t_y;
  bool is_z = !(t_xy < t_z);
  do {
    cursor.mark();
    cursor.advance(is_z ? 2 : (is_x_before_y ? 0 : 1));
    // Selections instead of branches: which axis comes next is hard to predict.
    const double delta_x = is_x_before_y ? ray.t_delta[0] : 0.0;
    const double delta_y = is_x_before_y ? 0.0 : ray.t_delta[1];
    t_x += is_z ? 0.0 : delta_x;
    t_y += is_z ? 0.0 : delta_y;
    t_z += is_z ? ray.t_delta[2] : 0.0;
    is_x_before_y = t_x < t_y;
    t_xy = is_x_before_y ? t_x : t_y;
    is_z = !(t_xy < t_z);
  } while (!cursor.isAtEnd() && (is_z ? t_z : t_xy) <= ray.length_m);
  return cursor;
}

}  // namespace cuboid_mapping
