// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/cuboid_history.h"

#include "cuboid_mapping/query/point_query.h"

namespace cuboid_mapping::bench {
namespace {

bool isAlone(const CellBox& box) { return box == CellBox::ofCell(box.min); }

}  // namespace

void CuboidHistory::note(const CuboidMap& map) {
  Cuboids now;
  visitAll(map, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
    if (!isAlone(cuboid.box)) now.emplace(cuboid.box.min, cuboid.box);
    return Visit::kContinue;
  });
  for (auto voxel = alone_.begin(); voxel != alone_.end();) {
    const std::optional<Cuboid> holder = findCuboidOfCell(map, *voxel);
    const bool is_alone = holder && isAlone(holder->box);
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
  const std::optional<Cuboid> holder = findCuboidOfCell(map, gone.min);
  if (holder && holder->box.contains(gone)) return;  // It has been absorbed.
  ++num_splits_;
  visitBox(map, gone, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
    if (isAlone(cuboid.box)) alone_.insert(cuboid.box.min);
    return Visit::kContinue;
  });
}

}  // namespace cuboid_mapping::bench
