// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/window/window_config.h"

#include <algorithm>
#include <cmath>

namespace cuboid_mapping {
namespace {

/// The cells of a cube, cut at the limits of a map.
CellBox cubeAround(const Eigen::Vector3d& center_map, double edge_m, const Grid& grid) {
  const Eigen::Vector3d center_cells = grid.toCellUnits(center_map);
  const double edge_cells = edge_m / grid.resolution();
  CellBox cube;
  constexpr double kMax = Grid::kMaxCell;
  for (int axis = 0; axis < 3; ++axis) {
    const double min = std::floor(center_cells[axis] - 0.5 * edge_cells);
    const double max = std::ceil(center_cells[axis] + 0.5 * edge_cells);
    cube.min[axis] = static_cast<std::int32_t>(std::clamp(min, -kMax, kMax));
    cube.max[axis] = static_cast<std::int32_t>(std::clamp(max, -kMax, kMax));
  }
  return cube;
}

}  // namespace

const char* toString(OutsideWindow outside) {
  switch (outside) {
    case OutsideWindow::kKeep: return "keep";
    case OutsideWindow::kForget: return "forget";
    default: return "refuse";
  }
}

CellBox windowAround(const Eigen::Vector3d& center_map, const WindowConfig& config,
                     const Grid& grid) {
  return cubeAround(center_map, config.size_m, grid);
}

CellBox cellsKeptAround(const Eigen::Vector3d& center_map, const WindowConfig& config,
                        const Grid& grid) {
  return cubeAround(center_map, config.size_m + 2.0 * config.margin_m, grid);
}

}  // namespace cuboid_mapping
