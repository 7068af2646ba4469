// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/cuboid_search.h"

#include "cuboid_mapping/fusion/cuboid_tree.h"

namespace cuboid_mapping {

void visitBox(const CuboidMap& map, const CellBox& window, CuboidFilter filter,
              FunctionRef<Visit(const Cuboid&)> visit) {
  map.cuboids().visitBox(map.voxels(), window, filter, visit);
}

void visitAll(const CuboidMap& map, CuboidFilter filter, FunctionRef<Visit(const Cuboid&)> visit) {
  visitBox(map, kAllCells, filter, visit);
}

void visitNearest(const CuboidMap& map, const Eigen::Vector3d& point, double max_distance,
                  CuboidFilter filter, FunctionRef<Visit(const Cuboid&, double)> visit) {
  map.cuboids().visitNearest(map.voxels(), point, max_distance, filter, visit);
}

CuboidCounts countCuboids(const CuboidMap& map) {
  CuboidCounts counts;
  visitAll(map, CuboidFilter::kAll, [&counts](const Cuboid& cuboid) {
    ++(cuboid.isOccupied() ? counts.occupied : counts.free);
    return Visit::kContinue;
  });
  return counts;
}

TreeSize measureTree(const CuboidMap& map) {
  const InnerTree& inner = map.cuboids().inner();
  return {inner.height(), map.voxels().size(), inner.size(), inner.numBytes()};
}

}  // namespace cuboid_mapping
