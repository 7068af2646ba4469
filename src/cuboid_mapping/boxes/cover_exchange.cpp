// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/boxes/cover_exchange.h"

#include "cuboid_mapping/boxes/box_merger.h"

#include <algorithm>
#include <array>

namespace cuboid_mapping {
namespace {

using OptionalBox = std::optional<CellBox>;

void extend(OptionalBox& bounds, const CellBox& box) {
  bounds = bounds ? unite(*bounds, box) : box;
}

double volumeOf(const OptionalBox& box) { return box ? box->numVoxels() : 0.0; }

/// Bounds of the slices below and above each cut across an axis.
struct Cuts {
  std::vector<OptionalBox> below;
  std::vector<OptionalBox> above;
};

Cuts makeCuts(const std::vector<OptionalBox>& slices) {
  Cuts cuts{slices, slices};
  for (std::size_t i = 1; i < slices.size(); ++i) {
    if (cuts.below[i - 1]) extend(cuts.below[i], *cuts.below[i - 1]);
    const std::size_t k = slices.size() - 1 - i;
    if (cuts.above[k + 1]) extend(cuts.above[k], *cuts.above[k + 1]);
  }
  return cuts;
}

}  // namespace

void CoverExchange::improve(std::size_t max_boxes) {
  takeIfBetter(shrink(boxes_));
  if (boxes_.size() > kMostBoxes) return;
  for (std::size_t left = max_boxes; left > 0 && budget_.checkClock(); --left) {
    const std::vector<Split> splits = findSplits();
    const bool is_better = std::any_of(splits.begin(), splits.end(), [&](const Split& split) {
      return tryExchange(split, max_boxes);
    });
    if (!is_better) return;
  }
}

double CoverExchange::costOf(const std::vector<CellBox>& boxes) const {
  return cost_.ofCover(VoxelSet(budget_, boxes), occupied_.size());
}

template <typename VisitorT>
void CoverExchange::forEachOwn(const std::vector<CellBox>& boxes, std::size_t box,
                               VisitorT visit) const {
  std::vector<CellBox> others;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    if (i != box && boxes[i].intersects(boxes[box])) others.push_back(boxes[i]);
  }
  occupied_.forEachBrickIn(boxes[box], [&](const Cell& brick, BrickMask voxels) {
    for (const CellBox& other : others) {
      const CellBox part = intersect(other, brickBox(brick));
      if (!part.isEmpty()) voxels = voxels.without(BrickMask::ofBox(part));
    }
    forEachCell(brick, voxels, visit);
  });
}

std::optional<CellBox> CoverExchange::findOwn(const std::vector<CellBox>& boxes,
                                              std::size_t box) const {
  OptionalBox own;
  forEachOwn(boxes, box, [&](const Cell& cell) { extend(own, CellBox::ofCell(cell)); });
  return own;
}

std::vector<CellBox> CoverExchange::shrink(std::vector<CellBox> boxes) const {
  for (std::size_t i = 0; i < boxes.size();) {
    if (const OptionalBox own = findOwn(boxes, i)) {
      boxes[i++] = *own;
    } else {
      boxes.erase(boxes.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  return boxes;
}

CoverExchange::Split CoverExchange::findSplit(std::size_t box) const {
  const CellBox& whole = boxes_[box];
  std::array<std::vector<OptionalBox>, 3> slices;
  for (int axis = 0; axis < 3; ++axis) {
    slices[static_cast<std::size_t>(axis)].resize(static_cast<std::size_t>(whole.size()[axis]));
  }
  forEachOwn(boxes_, box, [&](const Cell& cell) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto slice = static_cast<std::size_t>(cell[axis] - whole.min[axis]);
      extend(slices[static_cast<std::size_t>(axis)][slice], CellBox::ofCell(cell));
    }
  });
  Split best;
  best.box = box;
  for (const std::vector<OptionalBox>& along : slices) {
    const Cuts cuts = makeCuts(along);
    for (std::size_t i = 1; i < along.size(); ++i) {
      if (!cuts.below[i - 1] || !cuts.above[i]) continue;
      const double num_saved =
          whole.numVoxels() - volumeOf(cuts.below[i - 1]) - volumeOf(cuts.above[i]);
      if (num_saved <= best.num_saved) continue;
      best = {num_saved, box, *cuts.below[i - 1], *cuts.above[i]};
    }
  }
  return best;
}

/// The kTriedSplits splits that save the most volume.
std::vector<CoverExchange::Split> CoverExchange::findSplits() const {
  std::vector<Split> splits;
  for (std::size_t i = 0; i < boxes_.size() && budget_.spend(); ++i) {
    const Split split = findSplit(i);
    if (split.num_saved > 0.0) splits.push_back(split);
  }
  std::stable_sort(splits.begin(), splits.end(),
                   [](const Split& a, const Split& b) { return a.num_saved > b.num_saved; });
  splits.resize(std::min(splits.size(), kTriedSplits));
  return splits;
}

bool CoverExchange::tryExchange(const Split& split, std::size_t max_boxes) {
  std::vector<CellBox> boxes = boxes_;
  boxes[split.box] = split.lower;
  boxes.push_back(split.upper);
  if (boxes.size() <= max_boxes) return takeIfBetter(shrink(std::move(boxes)));
  const std::vector<CellBox> unions = findUnions(boxes);
  return std::any_of(unions.begin(), unions.end(), [&](const CellBox& both) {
    return takeIfBetter(shrink(withUnion(boxes, both)));
  });
}

bool CoverExchange::takeIfBetter(std::vector<CellBox> boxes) {
  const double cost = costOf(boxes);
  if (budget_.isSpent() || cost > cost_of_boxes_) return false;
  if (cost == cost_of_boxes_ && boxes.size() >= boxes_.size()) return false;
  if (may_take_ && !may_take_(boxes)) return false;
  boxes_ = std::move(boxes);
  cost_of_boxes_ = cost;
  return true;
}

/// The union of two boxes at the least cost, and others in case that it may not be taken.
std::vector<CellBox> CoverExchange::findUnions(const std::vector<CellBox>& boxes) const {
  using Union = std::pair<double, CellBox>;
  const auto is_less = [](const Union& a, const Union& b) { return a.first < b.first; };
  std::vector<Union> unions;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const CellBox both = unite(boxes[i], boxes[k]);
      if (isAllowed(both, keep_free_, budget_)) {
        unions.emplace_back(countOutside(boxes[i], boxes[k]), both);
      }
    }
  }
  std::stable_sort(unions.begin(), unions.end(), is_less);
  unions.resize(std::min(unions.size(), kExactUnions));
  const VoxelSet covered(budget_, boxes);
  for (auto& [cost, both] : unions) cost = cost_.ofBox(both, covered);
  std::stable_sort(unions.begin(), unions.end(), is_less);
  if (!may_take_ && unions.size() > 1) unions.resize(1);
  std::vector<CellBox> best;
  best.reserve(unions.size());
  for (const Union& candidate : unions) best.push_back(candidate.second);
  return best;
}

}  // namespace cuboid_mapping
