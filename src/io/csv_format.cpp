// SPDX-License-Identifier: BSD-3-Clause
#include "csv_format.h"

#include <locale>
#include <sstream>

namespace cuboid_mapping {

std::string toCsv(MapSnapshot snapshot, const ProgressListener& listener) {
  sortCuboids(snapshot.cuboids);
  const Grid grid(snapshot.resolution_m);
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << "min_x,min_y,min_z,max_x,max_y,max_z,probability,class\n";
  ProgressCounter progress(listener, snapshot.cuboids.size());
  for (const Cuboid& cuboid : snapshot.cuboids) {
    const MetricBox box = grid.toMetricBox(cuboid.box);
    out.precision(10);
    for (const Eigen::Vector3d& corner : {box.min_m, box.max_m}) {
      for (int axis = 0; axis < 3; ++axis) out << corner[axis] << ',';
    }
    out.precision(6);
    out << toProbability(cuboid.log_odds) << ',' << toString(cuboid.occupancy()) << '\n';
    progress.advance();
  }
  return out.str();
}

}  // namespace cuboid_mapping
