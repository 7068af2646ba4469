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

/// The voxels of a brick; unknown ones if it is not there.
const PackedVoxels& voxelsOf(const std::vector<VoxelBrick>& bricks, const Cell& brick) {
  static const PackedVoxels kUnknown;
  const auto found = std::lower_bound(bricks.begin(), bricks.end(), brick,
                                      [](const VoxelBrick& each, const Cell& wanted) {
                                        return isBeforeOnMortonCurve(each.brick, wanted);
                                      });
  return found != bricks.end() && found->brick == brick ? found->voxels : kUnknown;
}

/// The cuboids whose voxels have their class. In a store whose pages were written one by one, others may be left of
/// the pages before.
std::vector<Cuboid> fittingOf(const MapSnapshot& snapshot) {
  std::vector<Cuboid> fitting;
  for (const Cuboid& cuboid : snapshot.cuboids) {
    const bool is_other = anyBrick(cuboid.box, [&](const Cell& brick) {
      const PackedVoxels& voxels = voxelsOf(snapshot.bricks, brick);
      const BrickMask of_class = cuboid.isOccupied() ? voxels.occupied() : voxels.free();
      return !of_class.contains(BrickMask::ofBox(intersect(cuboid.box, brickBox(brick))));
    });
    if (!is_other) fitting.push_back(cuboid);
  }
  return fitting;
}

/// @pre The snapshot has all voxels of the box.
double meanProbability(const std::vector<VoxelBrick>& bricks, const CellBox& box) {
  double sum = 0.0;
  forEachBrick(box, [&](const Cell& brick) {
    const BrickMask of_box = BrickMask::ofBox(intersect(box, brickBox(brick)));
    voxelsOf(bricks, brick).forEachValue([&](float log_odds, const BrickMask& of_value) {
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
  const std::vector<Cuboid> fitting = fittingOf(snapshot);
  add(fitting);
  const auto told = voxelsOf(fitting);
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
