// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/ray_walk.h"

#include <cmath>
#include <limits>

namespace cuboid_mapping {

std::optional<Ray> computeRay(const Grid& grid, const Eigen::Vector3d& anchor_map,
                              const Eigen::Vector3f& origin, const Eigen::Vector3f& end) {
  const Eigen::Vector3d origin_map = anchor_map + origin.cast<double>();
  const auto start_cell = grid.toCell(origin_map);
  const auto end_cell = grid.toCell(anchor_map + end.cast<double>());
  if (!start_cell || !end_cell) return std::nullopt;

  Ray ray;
  ray.start = *start_cell;
  ray.end = *end_cell;
  Eigen::Vector3f direction = end - origin;
  const float squared_length =
      direction.x() * direction.x() + direction.y() * direction.y() + direction.z() * direction.z();
  const auto length_m = static_cast<float>(std::sqrt(static_cast<double>(squared_length)));
  direction /= length_m;
  ray.length_m = length_m;
  for (int axis = 0; axis < 3; ++axis) {
    const float component = direction[axis];
    ray.step[axis] = component > 0.0F ? 1 : (component < 0.0F ? -1 : 0);
    if (ray.step[axis] == 0) {
      ray.t_max[axis] = std::numeric_limits<double>::max();
      ray.t_delta[axis] = std::numeric_limits<double>::max();
      continue;
    }
    const double center = (ray.start[axis] + 0.5) * grid.resolution();
    const double border = center + static_cast<float>(ray.step[axis] * grid.resolution() * 0.5);
    ray.t_max[axis] = (border - origin_map[axis]) / component;
    ray.t_delta[axis] = grid.resolution() / std::fabs(component);
  }
  return ray;
}

}  // namespace cuboid_mapping
