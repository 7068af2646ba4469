// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/answer.h"
#include "cuboid_mapping/query/near_places.h"
#include "cuboid_mapping/query/place_graph.h"

#include <limits>
#include <queue>
#include <vector>

namespace cuboid_mapping {

/// A* over a PlaceGraph, from starts to the places of a goal.
class PlaceSearch {
 public:
  /// @param graph  Must outlive this object. @param goal  Places.
  PlaceSearch(PlaceGraph& graph, const CellBox& goal) : graph_(graph), goal_(goal) {}

  /// Searches from the places of a start that no earlier start has reached. kFound: see toWay().
  AnswerStatus run(const CellBox& start, Budget& budget);

  /// Places from a start to the end; two successive ones lie in one box of the graph, or side by side.
  /// @pre run() or endNear() has found the end.
  [[nodiscard]] std::vector<Cell> toWay() const;

  /// Ends the way at the reached position that is nearest to a point. @param point  The positions around it.
  /// @return That position; nothing if all are farther than max_distance.
  [[nodiscard]] std::optional<NearPlace> endNear(const NearPlaces& point, double max_distance);

 private:
  using Node = PlaceGraph::NodeIndex;

  /// The best way to a node so far.
  struct State {
    double cost = std::numeric_limits<double>::infinity();
    Node parent = PlaceGraph::kNoNode;
    Cell entry;
  };
  struct Item {
    double estimate;
    double cost;
    Node node;
    bool operator<(const Item& other) const { return estimate > other.estimate; }
  };

  [[nodiscard]] bool isReached(Node node) const {
    return node < states_.size() && states_[node].cost < std::numeric_limits<double>::infinity();
  }
  void reach(Node node, const Cell& entry, double cost, Node parent);
  void expand(Node node);

  PlaceGraph& graph_;
  CellBox goal_;
  std::vector<State> states_;  ///< By node.
  std::priority_queue<Item> open_;
  std::vector<PlaceGraph::Neighbor> neighbors_;
  Node last_ = PlaceGraph::kNoNode;
};

}  // namespace cuboid_mapping
