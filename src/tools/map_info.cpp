// SPDX-License-Identifier: BSD-3-Clause
// Prints what is in a map file.
#include "command_line.h"
#include "cuboid_mapping/fusion/brick_division.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/io/text.h"

#include <algorithm>
#include <iostream>
#include <optional>

namespace cuboid_mapping {
namespace {

struct Totals {
  std::size_t num_cuboids = 0;
  double num_voxels = 0.0;

  void add(const Cuboid& cuboid) {
    ++num_cuboids;
    num_voxels += cuboid.box.numVoxels();
  }
};

void print(const char* name, const Totals& totals, double voxel_volume_m3) {
  std::cout << name << counted(totals.num_cuboids, "cuboid") << ", " << totals.num_voxels
            << (totals.num_voxels == 1.0 ? " voxel, " : " voxels, ")
            << totals.num_voxels * voxel_volume_m3 << " m^3\n";
}

void print(const MapFile& file) {
  const MapSnapshot& map = file.snapshot;
  Totals free;
  Totals occupied;
  std::optional<CellBox> extent;
  std::vector<Cuboid> cuboids;
  for (const VoxelBrick& brick : map.bricks) {
    cuboids.clear();
    divideBrick(brick, cuboids);
    for (const Cuboid& cuboid : cuboids) {
      (cuboid.isOccupied() ? occupied : free).add(cuboid);
      extent = extent ? unite(*extent, cuboid.box) : cuboid.box;
    }
  }
  const Grid grid(map.resolution_m);
  std::cout << "format:       " << toString(file.format) << '\n'
            << "file:         " << file.num_bytes << " bytes\n"
            << "resolution:   " << map.resolution_m << " m\n";
  if (file.format == MapFormat::kNative) {
    const SensorModelConfig& model = map.sensor_model;
    std::cout << "frame:        " << (map.frame_id.empty() ? "not known" : map.frame_id) << '\n'
              << "environment:  " << toString(map.environment) << '\n'
              << "sensor model: hit " << model.hit << ", miss " << model.miss << ", min "
              << model.alpha_min << ", max " << model.alpha_max << '\n';
  }
  std::cout.precision(10);
  print("free:         ", free, grid.voxelVolume());
  print("occupied:     ", occupied, grid.voxelVolume());
  if (!extent) return;
  const MetricBox box = grid.toMetricBox(*extent);
  std::cout << "from:         " << box.min_m.transpose() << " m\n"
            << "to:           " << box.max_m.transpose() << " m\n";
}

int run(int argc, char** argv) {
  std::string file;
  CommandLine line("map_info", "Prints what is in a map file: .cuboids, .ot or .bt.");
  line.addArgument("map", file, "the file");
  if (const auto status = line.parse(argc, argv)) return *status;
  const MapFile map = readMapFile(file);
  throwIfInterrupted();
  print(map);
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("map_info", argc, argv, cuboid_mapping::run);
}
