// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/cuboid_history.h"

namespace cuboid_mapping::bench {
namespace {

/// The cuboid that holds a voxel; an empty box when there is none.
CellBox findCuboid(const CuboidMap& map, const Cell& voxel) {
  CellBox found;
  visitBox(map, CellBox::ofCell(voxel), CuboidFilter::kAll, [&](const Cuboid& cuboid) {
    found = cuboid.box;
    return Visit::kStop;
  });
  return found;
}

bool isAlone(const CellBox& box) { return box == CellBox::ofCell(box.min); }

}  // namespace

void CuboidHistory::note(const CuboidMap& map) {
  Cuboids now;
  visitAll(map, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
    if (!isAlone(cuboid.box)) now.emplace(cuboid.box.min, cuboid.box);
    return Visit::kContinue;
  });
  for (auto voxel = alone_.begin(); voxel != alone_.end();) {
    const bool is_alone = isAlone(findCuboid(map, *voxel));
    num_fused_again_ += is_alone ? 0 : 1;
    voxel = is_alone ? std::next(voxel) : alone_.erase(voxel);
  }
  for (const auto& [least, box] : cuboids_) {
    const auto same = now.find(least);
    if (same == now.end() || same->second != box) noteSplit(map, box);
  }
  cuboids_ = std::move(now);
}

void CuboidHistory::noteSplit(const CuboidMap& map, const CellBox& gone) {
  if (findCuboid(map, gone.min).contains(gone)) return;  // It has been absorbed.
  ++num_splits_;
  visitBox(map, gone, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
    if (isAlone(cuboid.box)) alone_.insert(cuboid.box.min);
    return Visit::kContinue;
  });
}

}  // namespace cuboid_mapping::bench
