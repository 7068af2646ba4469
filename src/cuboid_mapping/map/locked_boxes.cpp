// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/locked_boxes.h"

#include "cuboid_mapping/rtree/traversal.h"

#include <algorithm>
#include <iterator>

namespace cuboid_mapping {

void LockedBoxes::add(const CellBox& box) {
  if (!box.isEmpty()) replace(box, true);
}

void LockedBoxes::remove(const CellBox& box) {
  if (!box.isEmpty()) replace(box, false);
}

/// Calls visit(NodeIndex) -> Visit for each locked box that shares a voxel with a box.
template <typename VisitT>
void LockedBoxes::visitMet(const CellBox& box, VisitT visit) const {
  visitLeaves(
      tree_, box, CuboidFilter::kAll, [](NodeIndex /*leaf*/, int /*stage*/) {}, visit);
}

/// Removes a box from the locked ones. @param is_added  If true, locks the box itself.
void LockedBoxes::replace(const CellBox& box, bool is_added) {
  std::vector<NodeIndex> met;
  std::vector<CellBox> added;
  visitMet(box, [&](NodeIndex locked) {
    met.push_back(locked);
    for (const CellBox& piece : subtract(boxes_[locked], box)) added.push_back(piece);
    return Visit::kContinue;
  });
  if (is_added) added.push_back(box);
  const std::size_t end = boxes_.size() + added.size();
  if (end > boxes_.capacity()) boxes_.reserve(end + end / 2);
  if (end > free_.capacity()) free_.reserve(end + end / 2);
  tree_.reserve(added.size(), met.size(), end);  // Nothing throws after this.
  for (const NodeIndex locked : met) {
    tree_.remove(locked);
    boxes_[locked] = {};
    free_.push_back(locked);
  }
  for (const CellBox& piece : added) {
    if (free_.empty()) {
      free_.push_back(static_cast<NodeIndex>(boxes_.size()));
      boxes_.emplace_back();
    }
    boxes_[free_.back()] = piece;
    tree_.insert({piece, true, free_.back()});
    free_.pop_back();
  }
}

bool LockedBoxes::intersects(const CellBox& box) const {
  bool is_met = false;
  visitMet(box, [&is_met](NodeIndex /*locked*/) {
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
  std::copy_if(boxes_.begin(), boxes_.end(), std::back_inserter(boxes),
               [](const CellBox& box) { return !box.isEmpty(); });
  std::sort(boxes.begin(), boxes.end(),
            [](const CellBox& a, const CellBox& b) { return a.min < b.min; });
  return boxes;
}

std::vector<BrickUpdate> LockedBoxes::without(const std::vector<BrickUpdate>& update) const {
  std::vector<BrickUpdate> rest = update;
  for (BrickUpdate& brick : rest) {
    const CellBox cells = brickBox(brick.brick);
    visitMet(cells, [&](NodeIndex locked) {
      const BrickMask kept = ~BrickMask::ofBox(intersect(boxes_[locked], cells));
      brick.hits &= kept;
      brick.misses &= kept;
      brick.grazes &= kept;
      return Visit::kContinue;
    });
  }
  return rest;
}

}  // namespace cuboid_mapping
