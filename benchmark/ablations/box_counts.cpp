// SPDX-License-Identifier: BSD-3-Clause
#include "box_counts.h"

#include "cuboid_mapping/voxels/brick_cuboids.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>

namespace cuboid_mapping::bench {
namespace {

/// Where each voxel of a brick goes when its axes change places or direction.
using Symmetry = std::array<int, kBrickVoxels>;

std::vector<Symmetry> makeSymmetries() {
  std::vector<Symmetry> symmetries;
  std::array<int, 3> axes{0, 1, 2};
  do {
    for (unsigned mirrored = 0; mirrored < 8; ++mirrored) {
      Symmetry& symmetry = symmetries.emplace_back();
      for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
        const Cell from = cellAt({}, voxel);
        Cell to;
        for (int axis = 0; axis < 3; ++axis) {
          const std::int32_t at = from[axes[static_cast<std::size_t>(axis)]];
          to[axis] = (mirrored >> axis & 1U) != 0 ? kBrickEdge - 1 - at : at;
        }
        symmetry[static_cast<std::size_t>(voxel)] = voxelIndex(to);
      }
    }
  } while (std::next_permutation(axes.begin(), axes.end()));
  return symmetries;
}

std::size_t countDivided(const BrickMask& mask) {
  std::vector<Cuboid> cuboids;
  divideVoxels({}, mask, Occupancy::kFree, cuboids);
  return cuboids.size();
}

std::size_t countBestOfOrders(const BrickMask& mask) {
  static const std::vector<Symmetry> kSymmetries = makeSymmetries();
  std::size_t best = kBrickVoxels;
  for (const Symmetry& symmetry : kSymmetries) {
    BrickMask moved;
    mask.forEach([&](int voxel) { moved.set(symmetry[static_cast<std::size_t>(voxel)]); });
    best = std::min(best, countDivided(moved));
  }
  return best;
}

bool canShareBox(int a, int b, const BrickMask& mask) {
  const CellBox box = unite(CellBox::ofCell(cellAt({}, a)), CellBox::ofCell(cellAt({}, b)));
  return mask.contains(BrickMask::ofBox(box));
}

/// Takes voxels one by one that share no box with those taken, lonely ones first.
std::size_t findLowerBound(const BrickMask& mask) {
  std::vector<std::pair<int, int>> order;  // Voxels it can share a box with, and the voxel.
  mask.forEach([&](int voxel) {
    int num_companions = 0;
    mask.forEach([&](int other) { num_companions += canShareBox(voxel, other, mask) ? 1 : 0; });
    order.emplace_back(num_companions, voxel);
  });
  std::sort(order.begin(), order.end());
  std::vector<int> taken;
  for (const auto& [num_companions, voxel] : order) {
    const bool is_apart = std::none_of(
        taken.begin(), taken.end(),
        [&, candidate = voxel](int other) { return canShareBox(candidate, other, mask); });
    if (is_apart) taken.push_back(voxel);
  }
  return taken.size();
}

/// Class, and extent across an axis: cuboids for which they are equal can be joined along it.
auto keyAcross(const Cuboid& cuboid, int axis) {
  const CellBox& box = cuboid.box;
  const int second = (axis + 1) % 3;
  const int third = (axis + 2) % 3;
  return std::tuple(cuboid.occupancy, box.min[second], box.max[second], box.min[third],
                    box.max[third]);
}

void joinAlong(int axis, std::vector<Cuboid>& cuboids) {
  std::sort(cuboids.begin(), cuboids.end(), [axis](const Cuboid& a, const Cuboid& b) {
    return std::pair(keyAcross(a, axis), a.box.min[axis]) <
           std::pair(keyAcross(b, axis), b.box.min[axis]);
  });
  std::vector<Cuboid> joined;
  for (const Cuboid& cuboid : cuboids) {
    if (!joined.empty() && keyAcross(joined.back(), axis) == keyAcross(cuboid, axis) &&
        joined.back().box.max[axis] == cuboid.box.min[axis]) {
      joined.back().box.max[axis] = cuboid.box.max[axis];
    } else {
      joined.push_back(cuboid);
    }
  }
  cuboids.swap(joined);
}

}  // namespace

BoxCounts countBoxes(const VoxelStore& voxels, std::size_t max_bricks) {
  BoxCounts counts;
  const std::size_t step = std::max<std::size_t>(1, voxels.size() / max_bricks);
  std::size_t index = 0;
  voxels.forEach([&](const VoxelBrick& brick) {
    if (index++ % step != 0) return;
    ++counts.bricks;
    for (const BrickMask& mask : {brick.voxels.occupied(), brick.voxels.free()}) {
      counts.cuboids += countDivided(mask);
      if (mask.isEmpty()) continue;
      counts.best_of_orders += countBestOfOrders(mask);
      counts.lower_bound += findLowerBound(mask);
    }
  });
  return counts;
}

std::size_t countJoined(std::vector<Cuboid> cuboids, const std::array<int, 3>& axes) {
  std::size_t num_before = 0;
  do {
    num_before = cuboids.size();
    for (const int axis : axes) joinAlong(axis, cuboids);
  } while (cuboids.size() < num_before);
  return cuboids.size();
}

}  // namespace cuboid_mapping::bench
