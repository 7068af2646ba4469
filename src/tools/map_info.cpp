// SPDX-License-Identifier: BSD-3-Clause
// Prints the content of a map file.
#include "command_line.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/io/map_store.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/voxels/brick_cuboids.h"

#include <filesystem>
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

/// Common data of the bricks of a map.
struct Content {
  Totals free;
  Totals occupied;
  std::optional<CellBox> extent;

  void add(const std::vector<VoxelBrick>& bricks) {
    std::vector<Cuboid> cuboids;
    for (const VoxelBrick& brick : bricks) {
      cuboids.clear();
      divideBrick(brick, cuboids);
      for (const Cuboid& cuboid : cuboids) {
        (cuboid.isOccupied() ? occupied : free).add(cuboid);
        extent = extent ? unite(*extent, cuboid.box) : cuboid.box;
      }
    }
  }
};

/// @param pages  Number of pages of a store; empty for other files.
void printHead(const MapFile& file, const std::optional<std::size_t>& pages) {
  const MapSnapshot& map = file.snapshot;
  std::cout << "format:       " << toString(file.format) << '\n'
            << "file:         " << file.num_bytes << " bytes\n";
  if (pages) std::cout << "pages:        " << *pages << '\n';
  std::cout << "resolution:   " << map.resolution_m << " m\n";
  if (file.format != MapFormat::kNative && file.format != MapFormat::kStore) return;
  const SensorModelConfig& model = map.sensor_model;
  std::cout << "frame:        " << (map.frame_id.empty() ? "not known" : map.frame_id) << '\n'
            << "environment:  " << toString(map.environment) << '\n'
            << "sensor model: hit " << model.hit << ", miss " << model.miss << ", min "
            << model.alpha_min << ", max " << model.alpha_max << '\n';
}

void printContent(const Content& content, double resolution_m) {
  const Grid grid(resolution_m);
  std::cout.precision(10);
  print("free:         ", content.free, grid.voxelVolume());
  print("occupied:     ", content.occupied, grid.voxelVolume());
  if (!content.extent) return;
  const MetricBox box = grid.toMetricBox(*content.extent);
  std::cout << "from:         " << box.min_m.transpose() << " m\n"
            << "to:           " << box.max_m.transpose() << " m\n";
}

void printFile(const std::string& file) {
  const MapFile map = readMapFile(file);
  throwIfInterrupted();
  printHead(map, std::nullopt);
  Content content;
  content.add(map.snapshot.bricks);
  printContent(content, map.snapshot.resolution_m);
}

/// Prints a store page by page: it may be larger than the memory.
void printStore(const std::string& file) {
  const MapStore store(file, StoreAccess::kRead);
  const std::vector<Cell> pages = store.pages();
  printHead({MapFormat::kStore, *store.head(), std::filesystem::file_size(file)}, pages.size());
  Content content;
  for (const Cell& page : pages) {
    throwIfInterrupted();
    content.add(store.read(page));
  }
  printContent(content, store.head()->resolution_m);
}

int run(int argc, char** argv) {
  std::string file;
  CommandLine line("map_info", "Prints the contents of a map file: .cuboids, .sqlite, .ot or .bt.");
  line.addArgument("map", file, "the file");
  if (const auto status = line.parse(argc, argv)) return *status;
  isSqliteFile(file) ? printStore(file) : printFile(file);
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("map_info", argc, argv, cuboid_mapping::run);
}
