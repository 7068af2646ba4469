// SPDX-License-Identifier: BSD-3-Clause
// Searches of an OctoMap by recursion from its root, which is quicker than by its iterators.
#pragma once

#include "cuboid_mapping/geometry/cell_box.h"

#include <octomap/OcTree.h>

#include <cstdint>

namespace cuboid_mapping::bench {

/// Where a descent goes on behind a node.
enum class Descent : unsigned char {
  kEnter,  ///< With its children, if it has any.
  kSkip,   ///< Without them.
  kStop,   ///< Nowhere.
};

/// As descend(), below one node. @param cube  Of the node.
template <typename VisitorT>
bool descendFrom(const octomap::OcTree& tree, const octomap::OcTreeNode* node, const CellBox& cube,
                 VisitorT& visit) {
  const Descent descent = visit(node, cube);
  if (descent != Descent::kEnter || !tree.nodeHasChildren(node)) return descent == Descent::kStop;
  const std::int32_t half = (cube.max.x - cube.min.x) / 2;
  for (unsigned i = 0; i < 8; ++i) {
    if (!tree.nodeChildExists(node, i)) continue;
    Cell min = cube.min;
    for (int axis = 0; axis < 3; ++axis) min[axis] += (i >> axis & 1U) != 0 ? half : 0;
    const CellBox child{min, min + Cell{half, half, half}};
    if (descendFrom(tree, tree.getNodeChild(node, i), child, visit)) return true;
  }
  return false;
}

/// Visits the nodes of an OctoMap of 16 levels, parents first.
/// @param visit  (const octomap::OcTreeNode*, const CellBox& cube) -> Descent.
/// @return Whether it was stopped.
template <typename VisitorT>
bool descend(const octomap::OcTree& tree, VisitorT visit) {
  constexpr std::int32_t kCenter = 1 << 15;
  constexpr CellBox kAll{{-kCenter, -kCenter, -kCenter}, {kCenter, kCenter, kCenter}};
  return tree.getRoot() != nullptr && descendFrom(tree, tree.getRoot(), kAll, visit);
}

/// Sum of the least x of all occupied leaves. Subtrees whose greatest log-odds is free are skipped.
/// @pre Inner nodes are up to date.
[[nodiscard]] inline double sumOccupied(const octomap::OcTree& tree) {
  double sum = 0.0;
  descend(tree, [&](const octomap::OcTreeNode* node, const CellBox& cube) {
    if (!tree.isNodeOccupied(node)) return Descent::kSkip;
    if (!tree.nodeHasChildren(node)) sum += cube.min.x;
    return Descent::kEnter;
  });
  return sum;
}

/// Whether any voxel of a box is occupied. Subtrees whose greatest log-odds is free are skipped, and
/// one inside the box with an occupied one is an answer.
/// @pre Inner nodes are up to date.
[[nodiscard]] inline bool isAnyOccupied(const octomap::OcTree& tree, const CellBox& box) {
  return descend(tree, [&](const octomap::OcTreeNode* node, const CellBox& cube) {
    if (!cube.intersects(box) || !tree.isNodeOccupied(node)) return Descent::kSkip;
    const bool is_answer = box.contains(cube) || !tree.nodeHasChildren(node);
    return is_answer ? Descent::kStop : Descent::kEnter;
  });
}

}  // namespace cuboid_mapping::bench
