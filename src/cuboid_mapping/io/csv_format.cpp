// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/csv_format.h"

#include "cuboid_mapping/fusion/brick_division.h"
#include "cuboid_mapping/map/progress_counter.h"
#include "cuboid_mapping/query/value_query.h"

#include <algorithm>
#include <locale>
#include <sstream>
#include <unordered_map>
#include <vector>

namespace cuboid_mapping {

namespace {

/// @pre The snapshot has all voxels of the box.
double meanProbability(const std::vector<VoxelBrick>& bricks, const CellBox& box) {
  double sum = 0.0;
  forEachBrick(box, [&](const Cell& brick) {
    const auto found = std::lower_bound(bricks.begin(), bricks.end(), brick,
                                        [](const VoxelBrick& each, const Cell& wanted) {
                                          return isBeforeOnMortonCurve(each.brick, wanted);
                                        });
    const BrickMask of_box = BrickMask::ofBox(intersect(box, brickBox(brick)));
    found->voxels.forEachValue([&](float log_odds, const BrickMask& of_value) {
      sum += toProbability(log_odds) * (of_value & of_box).count();
    });
  });
  return sum / box.numVoxels();
}

/// Voxels of cuboids, by brick.
std::unordered_map<Cell, BrickMask, CellHash> voxelsOf(const std::vector<Cuboid>& cuboids) {
  std::unordered_map<Cell, BrickMask, CellHash> voxels;
  for (const Cuboid& cuboid : cuboids) {
    forEachBrick(cuboid.box, [&](const Cell& brick) {
      voxels[brick] |= BrickMask::ofBox(intersect(cuboid.box, brickBox(brick)));
    });
  }
  return voxels;
}

/// The lines of a file.
class CsvText {
 public:
  explicit CsvText(double resolution_m) : grid_(resolution_m) {
    out_.exceptions(
        std::ios::badbit);  // Without this, the stream silently drops text when memory is short.
    out_.imbue(std::locale::classic());
    out_ << "min_x,min_y,min_z,max_x,max_y,max_z,probability,class\n";
  }

  void add(const Cuboid& cuboid, double probability) {
    const MetricBox box = grid_.toMetricBox(cuboid.box);
    out_.precision(12);  // Exact to millimetres far from the origin.
    for (const Eigen::Vector3d& corner : {box.min_m, box.max_m}) {
      for (int axis = 0; axis < 3; ++axis) out_ << corner[axis] << ',';
    }
    out_.precision(6);
    out_ << probability << ',' << toString(cuboid.occupancy) << '\n';
  }

  [[nodiscard]] std::string take() const { return out_.str(); }

 private:
  Grid grid_;
  std::ostringstream out_;
};

}  // namespace

std::string toCsv(const MapSnapshot& snapshot, const ProgressListener& listener) {
  CsvText text(snapshot.resolution_m);
  const auto add = [&](const std::vector<Cuboid>& cuboids) {
    for (const Cuboid& cuboid : cuboids) {
      text.add(cuboid, meanProbability(snapshot.bricks, cuboid.box));
    }
  };
  add(snapshot.cuboids);
  const auto told = voxelsOf(snapshot.cuboids);
  ProgressCounter progress(listener, snapshot.bricks.size());
  for (const VoxelBrick& brick : snapshot.bricks) {
    std::vector<Cuboid> cuboids;
    if (const auto found = told.find(brick.brick); found == told.end()) {
      divideBrick(brick, cuboids);
    } else {  // Voxels beside fused cuboids are single cells.
      forEachCell(brick.brick, brick.voxels.known().without(found->second), [&](const Cell& cell) {
        cuboids.push_back({CellBox::ofCell(cell), brick.voxels.at(voxelIndex(cell))});
      });
    }
    add(cuboids);
    progress.advance();
  }
  return text.take();
}

std::string toCsv(const CuboidMap& map, const std::vector<Cuboid>& cuboids) {
  CsvText text(map.grid().resolution());
  for (const Cuboid& cuboid : cuboids) {
    text.add(cuboid,
             cuboid_mapping::meanProbability(map, cuboid.box, Budget::unlimited()).valueOr(0.5));
  }
  return text.take();
}

}  // namespace cuboid_mapping
