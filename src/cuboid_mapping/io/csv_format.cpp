// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/csv_format.h"

#include "cuboid_mapping/fusion/brick_division.h"

#include <locale>
#include <sstream>

namespace cuboid_mapping {

namespace {

double meanProbability(const PackedVoxels& voxels, const CellBox& box) {
  const BrickMask of_box = BrickMask::ofBox(box);
  double sum = 0.0;
  voxels.forEachValue([&](float log_odds, const BrickMask& of_value) {
    sum += toProbability(log_odds) * (of_value & of_box).count();
  });
  return sum / box.numVoxels();
}

}  // namespace

std::string toCsv(const MapSnapshot& snapshot, const ProgressListener& listener) {
  const Grid grid(snapshot.resolution_m);
  std::ostringstream out;
  out.exceptions(std::ios::badbit);  // Without memory it would leave the rest out, and say nothing.
  out.imbue(std::locale::classic());
  out << "min_x,min_y,min_z,max_x,max_y,max_z,probability,class\n";
  ProgressCounter progress(listener, snapshot.bricks.size());
  for (const VoxelBrick& brick : snapshot.bricks) {
    std::vector<Cuboid> cuboids;
    divideBrick(brick, cuboids);
    for (const Cuboid& cuboid : cuboids) {
      const MetricBox box = grid.toMetricBox(cuboid.box);
      out.precision(12);  // Millimetres far from the origin, too.
      for (const Eigen::Vector3d& corner : {box.min_m, box.max_m}) {
        for (int axis = 0; axis < 3; ++axis) out << corner[axis] << ',';
      }
      out.precision(6);
      out << meanProbability(brick.voxels, cuboid.box) << ',' << toString(cuboid.occupancy) << '\n';
    }
    progress.advance();
  }
  return out.str();
}

}  // namespace cuboid_mapping
