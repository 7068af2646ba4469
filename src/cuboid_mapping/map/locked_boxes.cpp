// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/locked_boxes.h"

#include "cuboid_mapping/rtree/traversal.h"

#include <algorithm>

namespace cuboid_mapping {

void LockedBoxes::add(const CellBox& box) {
  if (!box.isEmpty()) replace(box, true);
}

void LockedBoxes::remove(const CellBox& box) {
  if (!box.isEmpty()) replace(box, false);
}

/// Removes a box from the locked ones. @param is_added  If true, locks the box itself.
void LockedBoxes::replace(const CellBox& box, bool is_added) {
  std::vector<CellBox> met;
  std::vector<Cuboid> added;
  visitBox(tree_, box, CuboidFilter::kAll, [&](const Cuboid& locked) {
    met.push_back(locked.box);
    for (const CellBox& piece : subtract(locked.box, box)) {
      added.push_back({piece, Occupancy::kOccupied});
    }
    return Visit::kContinue;
  });
  if (is_added) added.push_back({box, Occupancy::kOccupied});
  tree_.reserve(added.size(), met.size());  // Nothing throws from here on.
  for (const CellBox& locked : met) (void)tree_.removeReserved(locked);
  for (const Cuboid& piece : added) tree_.insertReserved(piece);
}

bool LockedBoxes::intersects(const CellBox& box) const {
  bool is_met = false;
  visitBox(tree_, box, CuboidFilter::kAll, [&is_met](const Cuboid& /*locked*/) {
    is_met = true;
    return Visit::kStop;
  });
  return is_met;
}

bool LockedBoxes::mayMeet(const std::vector<BrickUpdate>& update) const {
  if (isEmpty() || update.empty()) return false;
  CellBox around = brickBox(update.front().brick);
  for (const BrickUpdate& brick : update) around = unite(around, brickBox(brick.brick));
  return intersects(around);
}

std::vector<CellBox> LockedBoxes::boxes() const {
  std::vector<CellBox> boxes;
  boxes.reserve(tree_.size());
  visitAll(tree_, CuboidFilter::kAll, [&boxes](const Cuboid& locked) {
    boxes.push_back(locked.box);
    return Visit::kContinue;
  });
  std::sort(boxes.begin(), boxes.end(),
            [](const CellBox& a, const CellBox& b) { return a.min < b.min; });
  return boxes;
}

std::vector<BrickUpdate> LockedBoxes::without(const std::vector<BrickUpdate>& update) const {
  std::vector<BrickUpdate> rest = update;
  for (BrickUpdate& brick : rest) {
    const CellBox cells = brickBox(brick.brick);
    visitBox(tree_, cells, CuboidFilter::kAll, [&](const Cuboid& locked) {
      const BrickMask kept = ~BrickMask::ofBox(intersect(locked.box, cells));
      brick.hits &= kept;
      brick.misses &= kept;
      brick.grazes &= kept;
      return Visit::kContinue;
    });
  }
  return rest;
}

}  // namespace cuboid_mapping
