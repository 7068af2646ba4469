// SPDX-License-Identifier: BSD-3-Clause
#include "scenes.h"

#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/map/cuboid_search.h"

#include <cmath>
#include <random>
#include <vector>

namespace cuboid_mapping_rviz::bench {
namespace {

using namespace cuboid_mapping;

constexpr std::int32_t kPatchEdge = 4;

CuboidMap makePatches(std::int32_t num_patches) {
  std::mt19937 random(7);
  std::vector<UniformBox> columns;
  const std::int32_t first = -num_patches / 2 * kPatchEdge;
  for (std::int32_t y = 0; y < num_patches; ++y) {
    for (std::int32_t x = 0; x < num_patches; ++x) {
      const double hills = 12.0 * std::sin(0.11 * x) * std::cos(0.07 * y);
      const auto top = static_cast<std::int32_t>(std::lround(hills) + random() % 2);
      const auto thickness = static_cast<std::int32_t>(2 + random() % 3);
      const Cell min{first + kPatchEdge * x, first + kPatchEdge * y, top - thickness};
      columns.push_back({{min, {min.x + kPatchEdge, min.y + kPatchEdge, top}}, 1.0F});
    }
  }
  MapConfig config;
  config.resolution_m = 0.1;
  CuboidMap map(config);
  map.replace(kAllCells, columns);
  return map;
}

}  // namespace

CuboidMap makeGround(double num_boxes) {
  constexpr std::int32_t kSample = 64;
  const double density =
      static_cast<double>(countCuboids(makePatches(kSample)).occupied) / (kSample * kSample);
  return makePatches(static_cast<std::int32_t>(std::lround(std::sqrt(num_boxes / density))));
}

CuboidMap loadMap(const std::string& file) {
  const MapSnapshot snapshot = readMapFile(file).snapshot;
  MapConfig config;
  config.resolution_m = snapshot.resolution_m;
  CuboidMap map(config);
  restoreSnapshot(snapshot, map);
  return map;
}

}  // namespace cuboid_mapping_rviz::bench
