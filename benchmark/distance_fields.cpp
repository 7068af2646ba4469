// SPDX-License-Identifier: BSD-3-Clause
// Distances to obstacles that follow clouds of real scans: this map's, and dynamicEDT3D's with the same changes.
#include "command_line.h"
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/distance_field.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "data_sets/scan_dataset.h"
#include "timing.h"

#include <dynamicEDT3D/dynamicEDT3D.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping::bench {
namespace {

struct Options {
  std::string dataset;
  double resolution_m = 0.1;
  double bound_m = 2.0;
};

const Eigen::Vector3d kRegion_m(20.0, 20.0, 3.0);

/// Times of one cloud.
struct Times {
  double here_ms;
  double peer_ms;
  std::size_t num_changes;  ///< Voxels that are obstacles now, or no longer.
};

/// dynamicEDT3D of a region.
class Peer {
 public:
  Peer(const CellBox& region, double bound) : region_(region), field_(bound * bound) {
    const Cell size = region.size();
    field_.initializeEmpty(size.x, size.y, size.z);
    is_obstacle_.resize(static_cast<std::size_t>(region.numVoxels()));
  }

  /// The voxels that have become obstacles, or none, with a change of a map.
  [[nodiscard]] std::vector<Cell> findChanges(const CuboidMap& map, const ChangeSet& changes) {
    std::vector<Cell> changed;
    for (const ChangedBrick& brick : changes.bricks) {
      const CellBox part = intersect(brickBox(brick.brick), region_);
      if (part.isEmpty()) continue;
      forEachCell(brick.brick, BrickMask::ofBox(part), [&](const Cell& cell) {
        const bool is_occupied = map.voxels().at(cell) == Occupancy::kOccupied;
        if (is_occupied == is_obstacle_[indexOf(cell)]) return;
        is_obstacle_[indexOf(cell)] = is_occupied;
        changed.push_back(cell);
      });
    }
    return changed;
  }
  void update(const std::vector<Cell>& changed) {
    for (const Cell& cell : changed) {
      const Cell at = cell - region_.min;
      is_obstacle_[indexOf(cell)] ? field_.occupyCell(at.x, at.y, at.z)
                                  : field_.clearCell(at.x, at.y, at.z);
    }
    field_.update();
  }
  [[nodiscard]] int squareAt(const Cell& cell) const {
    const Cell at = cell - region_.min;
    return field_.getSQCellDistance(at.x, at.y, at.z);
  }

 private:
  [[nodiscard]] std::size_t indexOf(const Cell& cell) const {
    std::size_t index = 0;
    for (const int axis : {2, 1, 0}) {
      index = index * static_cast<std::size_t>(region_.size()[axis]) +
              static_cast<std::size_t>(cell[axis] - region_.min[axis]);
    }
    return index;
  }

  CellBox region_;
  DynamicEDT3D field_;
  std::vector<bool> is_obstacle_;
};

/// Prints in how many voxels the distances differ. Ours is that of an obstacle: where it is the lesser one, the peer has
/// missed this. Left out are voxels whose nearest obstacle is outside the region:
/// the peer does not see it.
void compare(const DistanceField& field, const Peer& peer) {
  std::size_t num_compared = 0;
  std::size_t num_less = 0;
  std::size_t num_more = 0;
  CellBox row = field.region();
  for (Cell cell = row.min; cell.z < row.max.z; ++cell.z) {
    for (cell.y = row.min.y; cell.y < row.max.y; ++cell.y) {
      for (cell.x = row.min.x; cell.x < row.max.x; ++cell.x) {
        const auto nearest = field.findNearest(cell);
        if (!nearest || !row.contains(*nearest)) continue;
        ++num_compared;
        const double square = toVector(cell - *nearest).squaredNorm();
        num_less += square < peer.squareAt(cell) ? 1 : 0;
        num_more += square > peer.squareAt(cell) ? 1 : 0;
      }
    }
  }
  std::printf("\ndistances compared: %zu, less than dynamicEDT3D's: %zu, more: %zu\n", num_compared,
              num_less, num_more);
}

void measure(const Options& options) {
  MapConfig config;
  config.resolution_m = options.resolution_m;
  CuboidMap map(config);
  ScanUpdater updater(map.grid());
  const auto scans = openScanDataset(options.dataset);
  const Eigen::Vector3d middle = scans->read(scans->size() / 2).T_map_sensor.translation();
  const MetricBox box{middle - 0.5 * kRegion_m, middle + 0.5 * kRegion_m};
  DistanceField field(map, *map.grid().toCellBox(box), options.bound_m, UnknownPolicy::kFree);
  Peer peer(field.region(), options.bound_m / options.resolution_m);
  std::vector<Times> times;
  for (std::size_t i = 0; i < scans->size(); ++i) {
    const ScanDataset::Item item = scans->read(i);
    const ChangeSet changes = map.apply(updater.compute(
        makeScan(item.T_map_sensor, item.T_map_sensor.translation(), item.points_sensor)));
    const std::vector<Cell> changed = peer.findChanges(map, changes);
    const double here_ms = 1e3 * timeOf([&] { field.update(map, changes); }).cpu_s;
    const double peer_ms = 1e3 * timeOf([&] { peer.update(changed); }).cpu_s;
    times.push_back({here_ms, peer_ms, changed.size()});
    std::printf("cloud %zu: %zu changes, %.2f ms, dynamicEDT3D %.2f ms\n", i, changed.size(),
                here_ms, peer_ms);
  }
  const auto median_of = [&](const auto& value_of) {
    std::vector<double> values(times.size());
    std::transform(times.begin(), times.end(), values.begin(), value_of);
    return median(std::move(values));
  };
  std::printf("\nmedians: %.2f ms, dynamicEDT3D %.2f ms, ratio of a cloud %.2f\n",
              median_of([](const Times& cloud) { return cloud.here_ms; }),
              median_of([](const Times& cloud) { return cloud.peer_ms; }),
              median_of([](const Times& cloud) { return cloud.peer_ms / cloud.here_ms; }));
  compare(field, peer);
}

int run(int argc, char** argv) {
  Options options;
  CommandLine line("distance_fields",
                   "Measures the time to update distances to obstacles after each cloud, in a "
                   "region of 20 x 20 x 3 m, here and in dynamicEDT3D with the same changes.");
  line.addArgument("dataset", options.dataset, "folder of scans, or .graph file");
  line.addNumber("resolution", options.resolution_m, "edge of a voxel [m]", {0.001, 100.0});
  line.addNumber("bound", options.bound_m, "largest distance [m]", {0.001, 100.0});
  if (const auto status = line.parse(argc, argv)) return *status;
  measure(options);
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("distance_fields", argc, argv, cuboid_mapping::bench::run);
}
