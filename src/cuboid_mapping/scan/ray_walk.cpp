// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/ray_walk.h"

#include <cassert>
#include <cmath>
#include <limits>

namespace cuboid_mapping {

RayOrigin::RayOrigin(const Grid& grid, const Eigen::Vector3d& anchor_map,
                     const Eigen::Vector3f& origin)
    : grid_(grid), anchor_map_(anchor_map), origin_(origin) {
  const Eigen::Vector3d origin_map = anchor_map + origin.cast<double>();
  cell_ = grid.toCell(origin_map);
  if (!cell_) return;
  for (int axis = 0; axis < 3; ++axis) {
    const double center = ((*cell_)[axis] + 0.5) * grid.resolution();
    const double half = static_cast<float>(grid.resolution() * 0.5);
    to_border_[axis][0] = center - half - origin_map[axis];
    to_border_[axis][1] = center + half - origin_map[axis];
  }
}

bool RayOrigin::computeRay(const Eigen::Vector3f& end, Ray& ray) const {
  assert(cell_);
  const auto end_cell = grid_.toCell(anchor_map_ + end.cast<double>());
  if (!end_cell) return false;
  ray.start = *cell_;
  ray.end = *end_cell;
  const Eigen::Vector3f beam = end - origin_;
  const float squared_length = beam.x() * beam.x() + beam.y() * beam.y() + beam.z() * beam.z();
  const auto length_m = static_cast<float>(std::sqrt(static_cast<double>(squared_length)));
  if (!std::isfinite(length_m)) return false;
  // A length rounded to 0 would never be used up: a step would add nothing to it.
  const bool has_length = length_m > 0.0F;
  ray.length_m = length_m;
  for (int axis = 0; axis < 3; ++axis) {
    const float component = has_length ? beam[axis] / length_m : 0.0F;
    ray.step[axis] = static_cast<int>(component > 0.0F) - static_cast<int>(component < 0.0F);
    if (ray.step[axis] == 0) {
      ray.t_max[axis] = std::numeric_limits<double>::max();
      ray.t_delta[axis] = std::numeric_limits<double>::max();
      continue;
    }
    ray.t_max[axis] = to_border_[axis][component > 0.0F ? 1 : 0] / component;
    ray.t_delta[axis] = grid_.resolution() / std::fabs(component);
  }
  return true;
}

MarginSlabs findMarginSlabs(const Ray& ray, double margin_m) {
  int axis = ray.t_delta[1] < ray.t_delta[0] ? 1 : 0;
  if (ray.t_delta[2] < ray.t_delta[axis]) axis = 2;
  const double begin_m = ray.length_m - margin_m;
  std::int32_t num_before = 0;
  if (begin_m > 0.0) {
    const double to_border_m = begin_m - ray.t_max[axis];
    num_before =
        to_border_m < 0.0 ? 1 : 2 + static_cast<std::int32_t>(to_border_m / ray.t_delta[axis]);
  }
  const bool is_down = ray.end[axis] < ray.start[axis];
  return {axis, ray.start[axis] + (is_down ? -num_before : num_before)};
}

bool cutBeam(const Eigen::Vector3f& origin, double max_range_m, Eigen::Vector3f& end) {
  const Eigen::Vector3f to_end = end - origin;
  const float squared_length =
      to_end.x() * to_end.x() + to_end.y() * to_end.y() + to_end.z() * to_end.z();
  const double length_m = std::sqrt(static_cast<double>(squared_length));
  if (!(length_m > max_range_m)) return false;
  end = origin + to_end / static_cast<float>(length_m) * static_cast<float>(max_range_m);
  return true;
}

}  // namespace cuboid_mapping
