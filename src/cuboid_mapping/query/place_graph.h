// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/fit_field.h"

#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// The places where a box fits, divided into boxes brick by brick: a graph of boxes that share a
/// face. Bricks are divided when a search reaches them, and have no nodes once the budget of the
/// obstacles is spent. Not thread-safe.
class PlaceGraph {
 public:
  /// Number of a node: constant, counted from 0 in the order of creation.
  using NodeIndex = std::uint32_t;
  /// No node has this number.
  static constexpr NodeIndex kNoNode = 0xFFFFFFFFU;

  /// @param region  Places outside are left out. @param field  Must outlive this object.
  PlaceGraph(FitField& field, const CellBox& region) : field_(field), region_(region) {}

  /// The nodes that share a place with a box, appended.
  void findNodes(const CellBox& places, std::vector<NodeIndex>& nodes);

  /// Places of a node. Valid until findNodes() or findNeighbors() is called.
  [[nodiscard]] const CellBox& box(NodeIndex node) const { return nodes_[node]; }
  /// Nodes of the bricks that were divided so far.
  [[nodiscard]] std::size_t numNodes() const { return nodes_.size(); }

  /// A neighbour of a node, and its places beside that node.
  struct Neighbor {
    NodeIndex node;  ///< The neighbour.
    CellBox places;  ///< Its places that share a face with those of the node, one layer.
  };
  /// All nodes that share a face with one. @param neighbors  Replaced.
  void findNeighbors(NodeIndex node, std::vector<Neighbor>& neighbors);

 private:
  /// The nodes of a brick.
  struct Range {
    Cell brick;
    NodeIndex first = 0;
    NodeIndex last = 0;
  };

  Range nodesIn(const Cell& brick);

  FitField& field_;
  CellBox region_;
  std::vector<CellBox> nodes_;
  BrickTable<Range> bricks_;
};

}  // namespace cuboid_mapping
