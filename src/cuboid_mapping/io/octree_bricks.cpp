// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/octree_bricks.h"

#include "cuboid_mapping/scan/morton.h"

#include <algorithm>
#include <array>

namespace cuboid_mapping {
namespace {

constexpr std::int32_t kCenter = 32768;

std::uint64_t orderOf(const Cell& brick) {
  const auto number = [](std::int32_t v) { return static_cast<std::uint32_t>((v + kCenter) >> 3); };
  return spreadBits(number(brick.x)) | spreadBits(number(brick.y)) << 1 |
         spreadBits(number(brick.z)) << 2;
}

/// Indices of the voxels of a brick in the order of an octree.
constexpr std::array<std::uint16_t, kBrickVoxels> makePlaces() {
  std::array<std::uint16_t, kBrickVoxels> places{};
  for (std::uint32_t voxel = 0; voxel < kBrickVoxels; ++voxel) {
    std::uint32_t place = 0;
    for (std::uint32_t bit = 0; bit < 9; ++bit) {  // Bits x, y, z of three each, low ones first.
      place |= (voxel >> bit & 1U) << (3 * (bit % 3) + bit / 3);
    }
    places[voxel] = static_cast<std::uint16_t>(place);
  }
  return places;
}

constexpr std::array<std::uint16_t, kBrickVoxels> kPlaces = makePlaces();

}  // namespace

OctreeBricks sortForOctree(const std::vector<VoxelBrick>& bricks) {
  OctreeBricks sorted;
  sorted.bricks.reserve(bricks.size());
  for (const VoxelBrick& brick : bricks) {
    if (kOctreeCells.contains(brick.brick)) {
      sorted.bricks.push_back({orderOf(brick.brick), &brick.voxels});
    } else {
      sorted.num_left_out += brick.voxels.known().count();
    }
  }
  std::sort(sorted.bricks.begin(), sorted.bricks.end(),
            [](const OctreeBrick& a, const OctreeBrick& b) { return a.order < b.order; });
  return sorted;
}

Cell brickAt(std::uint64_t order) {
  const auto coordinate = [&](int axis) {
    return static_cast<std::int32_t>(gatherBits(order >> axis) << 3) - kCenter;
  };
  return {coordinate(0), coordinate(1), coordinate(2)};
}

void fillVoxels(const PackedVoxels& from, OctreeKind kind, OctreeVoxels& voxels) {
  voxels.known.fill(0);
  from.forEachValue([&](float log_odds, const BrickMask& of_value) {
    const float value = kind == OctreeKind::kFull ? log_odds : (log_odds >= 0.0F ? 1.0F : -1.0F);
    of_value.forEach([&](int voxel) {
      const unsigned place = kPlaces[static_cast<std::size_t>(voxel)];
      voxels.log_odds[place] = value;
      voxels.known[place / 64] |= 1ULL << (place & 63U);
    });
  });
}

}  // namespace cuboid_mapping
