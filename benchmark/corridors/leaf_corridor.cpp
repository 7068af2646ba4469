// SPDX-License-Identifier: BSD-3-Clause
#include "corridors/leaf_corridor.h"

#include "octomap_descent.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <unordered_map>

namespace cuboid_mapping::bench {
namespace {

using octomap::OcTree;

/// Visits the free leaves that share a voxel with a box.
template <typename VisitorT>
void visitFreeLeaves(const OcTree& tree, const CellBox& box, VisitorT visit) {
  descend(tree, [&](const octomap::OcTreeNode* node, const CellBox& cube) {
    if (!cube.intersects(box)) return Descent::kSkip;
    if (!tree.nodeHasChildren(node) && !tree.isNodeOccupied(node)) visit(cube);
    return Descent::kEnter;
  });
}

double distance(const Cell& a, const Cell& b) {
  return std::hypot(static_cast<double>(a.x - b.x), static_cast<double>(a.y - b.y),
                    static_cast<double>(a.z - b.z));
}

Cell clampTo(const CellBox& box, const Cell& cell) {
  Cell clamped;
  for (int axis = 0; axis < 3; ++axis) {
    clamped[axis] = std::clamp(cell[axis], box.min[axis], box.max[axis] - 1);
  }
  return clamped;
}

/// A* over the leaves; a leaf is named by its least voxel.
class LeafSearch {
 public:
  LeafSearch(const OcTree& tree, const Cell& goal) : tree_(tree), goal_(goal) {}

  LeafCorridor run(const Cell& start) {
    LeafCorridor corridor;
    visitFreeLeaves(tree_, CellBox::ofCell(start),
                    [&](const CellBox& leaf) { reach(leaf, start, 0.0, leaf); });
    while (!open_.empty() && !corridor.is_found) {
      const Item item = open_.top();
      open_.pop();
      const State state = states_.at(item.leaf);
      if (item.cost > state.cost) continue;  // Reached on a shorter way since.
      corridor.is_found = state.box.contains(goal_);
      if (corridor.is_found) {
        corridor.leaves = toWay(state);
      } else {
        expand(state);
      }
    }
    corridor.num_reached = states_.size();
    return corridor;
  }

 private:
  struct State {
    double cost = std::numeric_limits<double>::infinity();
    CellBox box;
    CellBox parent;  ///< Itself at the start.
    Cell entry;
  };
  struct Item {
    double estimate;
    double cost;
    Cell leaf;
    bool operator<(const Item& other) const { return estimate > other.estimate; }
  };

  void reach(const CellBox& leaf, const Cell& entry, double cost, const CellBox& parent) {
    State& state = states_[leaf.min];
    if (cost >= state.cost) return;
    state = {cost, leaf, parent, entry};
    open_.push({cost + distance(entry, goal_), cost, leaf.min});
  }

  void expand(const State& from) {
    for (int face = 0; face < 6; ++face) {
      const int axis = face % 3;
      CellBox layer = from.box;
      layer.min[axis] = face < 3 ? from.box.min[axis] - 1 : from.box.max[axis];
      layer.max[axis] = layer.min[axis] + 1;
      visitFreeLeaves(tree_, layer, [&](const CellBox& leaf) {
        const Cell entry = clampTo(intersect(leaf, layer), from.entry);
        reach(leaf, entry, from.cost + distance(from.entry, entry), from.box);
      });
    }
  }

  [[nodiscard]] std::vector<CellBox> toWay(const State& last) const {
    std::vector<CellBox> way{last.box};
    for (const State* state = &last; state->parent != state->box;) {
      state = &states_.at(state->parent.min);
      way.push_back(state->box);
    }
    std::reverse(way.begin(), way.end());
    return way;
  }

  const OcTree& tree_;
  Cell goal_;
  std::unordered_map<Cell, State, CellHash> states_;
  std::priority_queue<Item> open_;
};

}  // namespace

LeafCorridor findLeafCorridor(const OcTree& tree, const Cell& start, const Cell& goal) {
  return LeafSearch(tree, goal).run(start);
}

std::vector<CellBox> linkLeaves(const std::vector<CellBox>& leaves) {
  std::vector<CellBox> boxes;
  for (const CellBox& leaf : leaves) {
    if (!boxes.empty()) {
      const CellBox before = boxes.back();
      CellBox link;
      for (int axis = 0; axis < 3; ++axis) {
        const bool is_across =
            before.max[axis] == leaf.min[axis] || leaf.max[axis] == before.min[axis];
        const std::int32_t from = std::max(before.min[axis], leaf.min[axis]);
        const std::int32_t to = std::min(before.max[axis], leaf.max[axis]);
        link.min[axis] = is_across ? from - 1 : from;
        link.max[axis] = is_across ? from + 1 : to;
      }
      boxes.push_back(link);
    }
    boxes.push_back(leaf);
  }
  return boxes;
}

double countFree(const OcTree& tree, const CellBox& box) {
  double count = 0.0;
  visitFreeLeaves(tree, box,
                  [&](const CellBox& leaf) { count += intersect(leaf, box).numVoxels(); });
  return count;
}

}  // namespace cuboid_mapping::bench
