// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/csv_format.h"

#include "cuboid_mapping/fusion/cuboid_tree.h"
#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/map/progress_counter.h"
#include "cuboid_mapping/query/value_query.h"
#include "cuboid_mapping/voxels/brick_cuboids.h"

#include <locale>
#include <sstream>
#include <vector>

namespace cuboid_mapping {

namespace {

/// The map of a snapshot, with its cuboids. Those of growth may have fused at any thresholds.
CuboidMap mapOf(const MapSnapshot& snapshot) {
  MapConfig config;
  config.resolution_m = snapshot.resolution_m;
  config.sensor_model = snapshot.sensor_model;
  config.fusion = snapshot.cuboids.empty() ? snapshot.fusion : FusionKind::kGrowth;
  config.growth.alpha_min = config.growth.alpha_max = 0.5;
  CuboidMap map(config);
  restoreSnapshot(snapshot, map);
  return map;
}

/// The lines of a file.
class CsvText {
 public:
  explicit CsvText(const CuboidMap& map) : map_(map) {
    out_.exceptions(
        std::ios::badbit);  // Without this, the stream silently drops text when memory is short.
    out_.imbue(std::locale::classic());
    out_ << "min_x,min_y,min_z,max_x,max_y,max_z,probability,class\n";
  }

  void add(const Cuboid& cuboid) {
    const MetricBox box = map_.grid().toMetricBox(cuboid.box);
    out_.precision(12);  // Exact to millimetres far from the origin.
    for (const Eigen::Vector3d& corner : {box.min_m, box.max_m}) {
      for (int axis = 0; axis < 3; ++axis) out_ << corner[axis] << ',';
    }
    out_.precision(6);
    out_ << meanProbability(map_, cuboid.box, Budget::unlimited()).valueOr(0.5) << ','
         << toString(cuboid.occupancy) << '\n';
  }

  [[nodiscard]] std::string take() const { return out_.str(); }

 private:
  const CuboidMap& map_;
  std::ostringstream out_;
};

}  // namespace

std::string toCsv(const MapSnapshot& snapshot, const ProgressListener& listener) {
  const CuboidMap map = mapOf(snapshot);
  const GrownBricks* grown =
      snapshot.fusion == FusionKind::kClass ? map.cuboids().grown() : nullptr;
  CsvText text(map);
  ProgressCounter progress(listener, snapshot.bricks.size());
  for (const VoxelBrick& brick : snapshot.bricks) {
    if (grown != nullptr && grown->find(brick.brick) == nullptr) {
      std::vector<Cuboid> cuboids;
      divideBrick(brick, cuboids);
      for (const Cuboid& cuboid : cuboids) text.add(cuboid);
    } else {
      visitBox(map, brickBox(brick.brick), CuboidFilter::kAll, [&](const Cuboid& cuboid) {
        if (brickOf(cuboid.box.min) == brick.brick) text.add(cuboid);
        return Visit::kContinue;
      });
    }
    progress.advance();
  }
  return text.take();
}

std::string toCsv(const CuboidMap& map, const std::vector<Cuboid>& cuboids) {
  CsvText text(map);
  for (const Cuboid& cuboid : cuboids) text.add(cuboid);
  return text.take();
}

}  // namespace cuboid_mapping
