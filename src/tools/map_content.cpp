// SPDX-License-Identifier: BSD-3-Clause
#include "map_content.h"

#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/voxels/brick_cuboids.h"

#include <cstdint>
#include <stdexcept>
#include <vector>

namespace cuboid_mapping {
namespace {

template <typename CountT>
std::uint64_t sumOverBricks(const MapSnapshot& map, const CountT& count) {
  std::uint64_t sum = 0;
  for (const VoxelBrick& brick : map.bricks) sum += static_cast<std::uint64_t>(count(brick));
  return sum;
}

}  // namespace

MapFormat checkOutput(const std::string& file) {
  const auto format = formatOfName(file);
  if (!format) throw std::runtime_error(file + ": its name must end in one of " + knownEndings());
  checkReplaceable(file);
  return *format;
}

std::string describeContent(const MapSnapshot& map, MapFormat format) {
  switch (format) {
    case MapFormat::kPcd:
    case MapFormat::kPly:
      return counted(
          sumOverBricks(map, [](const auto& brick) { return brick.voxels.occupied().count(); }),
          "point");
    case MapFormat::kCsv:
      return counted(sumOverBricks(map,
                                   [](const auto& brick) {
                                     std::vector<Cuboid> cuboids;
                                     divideBrick(brick, cuboids);
                                     return cuboids.size();
                                   }),
                     "cuboid");
    default:
      return counted(
          sumOverBricks(map, [](const auto& brick) { return brick.voxels.known().count(); }),
          "voxel");
  }
}

}  // namespace cuboid_mapping
