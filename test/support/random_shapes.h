// SPDX-License-Identifier: BSD-3-Clause
// Random cells, boxes, rays and scans for the tests.
#pragma once

#include "cuboid_mapping/geometry/cell_box.h"
#include "cuboid_mapping/scan/scan.h"
#include "support/random.h"

#include <Eigen/Core>

#include <cmath>

namespace cuboid_mapping::test {

/// A random cell of the box. @pre the box is not empty.
inline Cell randomCell(Random& random, const CellBox& box) {
  return {random.integer(box.min.x, box.max.x - 1), random.integer(box.min.y, box.max.y - 1),
          random.integer(box.min.z, box.max.z - 1)};
}

/// A random box, not empty, with its least cell in `area` and edges of 1 to `max_edge` cells.
inline CellBox randomBox(Random& random, const CellBox& area, int max_edge) {
  const Cell min = randomCell(random, area);
  return {min, min + Cell{random.integer(1, max_edge), random.integer(1, max_edge),
                          random.integer(1, max_edge)}};
}

/// A random box, not empty, inside `area`.
inline CellBox randomBoxInside(Random& random, const CellBox& area) {
  CellBox box;
  for (int axis = 0; axis < 3; ++axis) {
    box.min[axis] = random.integer(area.min[axis], area.max[axis] - 1);
    box.max[axis] = random.integer(box.min[axis] + 1, area.max[axis]);
  }
  return box;
}

/// A random point of the cube [-half_edge, half_edge) on each axis.
inline Eigen::Vector3d randomPoint(Random& random, double half_edge) {
  const double x = random.real(-half_edge, half_edge);
  const double y = random.real(-half_edge, half_edge);
  const double z = random.real(-half_edge, half_edge);
  return {x, y, z};
}

/// A random direction, neither zero nor normalized. One in four is parallel to an axis or a plane
/// of two axes.
inline Eigen::Vector3d randomDirection(Random& random) {
  while (true) {
    Eigen::Vector3d direction = randomPoint(random, 2.0);
    if (random.chance(0.25)) {
      direction[random.integer(0, 2)] = 0.0;
      direction[random.integer(0, 2)] = 0.0;
    }
    if (direction.norm() > 0.01) return direction;
  }
}

/// Kinds of beams in a random scan.
struct ScanShape {
  int num_points = 50;
  int num_no_returns = 5;
  double half_edge_m = 3.0;  ///< End points lie in a cube around the origin of the map.
  double resolution_m = 0.1;
  /// Share of coordinates that are exact multiples of half a resolution: voxel faces and centres.
  double lattice_ratio = 0.0;
};

/// A random coordinate within the shape's cube.
inline float randomCoordinate(Random& random, const ScanShape& shape) {
  const double coordinate_m = random.real(-shape.half_edge_m, shape.half_edge_m);
  if (!random.chance(shape.lattice_ratio)) return static_cast<float>(coordinate_m);
  const double half_m = 0.5 * shape.resolution_m;
  return static_cast<float>(std::round(coordinate_m / half_m) * half_m);
}

inline Eigen::Vector3f randomEndPoint(Random& random, const ScanShape& shape) {
  const float x = randomCoordinate(random, shape);
  const float y = randomCoordinate(random, shape);
  const float z = randomCoordinate(random, shape);
  return {x, y, z};
}

/// A random scan without an anchor; sometimes a beam has no length or is parallel to an axis.
inline Scan randomScan(Random& random, const ScanShape& shape) {
  Scan scan;
  scan.origin = randomEndPoint(random, shape);
  const auto end_point = [&] {
    Eigen::Vector3f end = randomEndPoint(random, shape);
    if (random.chance(0.02)) end = scan.origin;
    if (random.chance(0.1)) {
      const int kept = random.integer(0, 2);
      for (int axis = 0; axis < 3; ++axis) {
        if (axis != kept) end[axis] = scan.origin[axis];
      }
    }
    return end;
  };
  for (int i = 0; i < shape.num_points; ++i) scan.points.push_back(end_point());
  for (int i = 0; i < shape.num_no_returns; ++i) scan.no_returns.push_back(end_point());
  return scan;
}

}  // namespace cuboid_mapping::test
