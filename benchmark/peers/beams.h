// SPDX-License-Identifier: BSD-3-Clause
// The beams of a scan for other maps: the same, cut at the same points, as ScanUpdater::compute().
#pragma once

#include "cuboid_mapping/scan/ray_walk.h"
#include "cuboid_mapping/scan/scan.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

namespace cuboid_mapping::bench {

/// Calls add(const Ray&, bool is_hit) for each beam; one that is cut at the max range has no hit.
template <typename AddT>
void forEachBeam(const Grid& grid, double max_range_m, const Scan& scan, AddT add) {
  const RayOrigin origin(grid, scan.anchor_map, scan.origin);
  if (!origin.cell()) return;
  for (const Eigen::Vector3f& point : scan.points) {
    Eigen::Vector3f end = point;
    const bool is_cut = std::isfinite(max_range_m) && cutBeam(scan.origin, max_range_m, end);
    Ray ray;
    if (origin.computeRay(end, ray)) add(ray, !is_cut);
  }
}

/// Cursor of walkRay() that calls mark(const Cell&).
template <typename MarkT>
class MissCursor {
 public:
  MissCursor(const Ray& ray, MarkT mark)
      : mark_(mark),
        cell_(ray.start),
        end_(ray.end),
        step_{ray.step[0], ray.step[1], ray.step[2]} {}

  void mark() { mark_(cell_); }
  void advance(int axis) { cell_[axis] += step_[axis]; }
  [[nodiscard]] bool isAtEnd() const { return cell_ == end_; }

 private:
  MarkT mark_;
  Cell cell_;
  Cell end_;
  int step_[3];
};

/// Calls mark(const Cell&) for the voxels that a beam passes before its end.
template <typename MarkT>
void forEachMiss(const Ray& ray, MarkT mark) {
  static_cast<void>(walkRay(ray, MissCursor<MarkT>(ray, mark)));
}

/// The points of a scan that are finite, for maps that expect no others.
[[nodiscard]] inline std::vector<Eigen::Vector3f> finitePoints(const Scan& scan) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(scan.points.size());
  std::copy_if(scan.points.begin(), scan.points.end(), std::back_inserter(points),
               [](const Eigen::Vector3f& point) { return point.allFinite(); });
  return points;
}

}  // namespace cuboid_mapping::bench
