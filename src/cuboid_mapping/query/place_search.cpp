// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/place_search.h"

#include <algorithm>

namespace cuboid_mapping {
namespace {

double distance(const Cell& a, const Cell& b) { return (toVector(a) - toVector(b)).norm(); }

}  // namespace

AnswerStatus PlaceSearch::run(const CellBox& start, Budget& budget) {
  std::vector<Node> first;
  graph_.findNodes(start, first);
  for (const Node node : first) {
    if (isReached(node)) continue;
    const Cell entry = clampTo(intersect(graph_.box(node), start), clampTo(goal_, start.min));
    reach(node, entry, 0.0, PlaceGraph::kNoNode);
  }
  while (!open_.empty() && budget.spendAndUnlock()) {
    const Item item = open_.top();
    open_.pop();
    const State& state = states_[item.node];
    if (item.cost > state.cost) continue;  // A shorter way was found since.
    if (graph_.box(item.node).intersects(goal_)) {
      last_ = item.node;
      return AnswerStatus::kFound;
    }
    expand(item.node);
  }
  return budget.isSpent() ? AnswerStatus::kBudgetSpent : AnswerStatus::kNotFound;
}

std::vector<Cell> PlaceSearch::toWay() const {
  std::vector<Cell> way{clampTo(intersect(graph_.box(last_), goal_), states_[last_].entry)};
  for (Node node = last_; node != PlaceGraph::kNoNode; node = states_[node].parent) {
    const State& state = states_[node];
    way.push_back(state.entry);
    if (state.parent != PlaceGraph::kNoNode) {
      way.push_back(clampTo(graph_.box(state.parent), state.entry));
    }
  }
  std::reverse(way.begin(), way.end());
  return way;
}

std::optional<NearPlace> PlaceSearch::endNear(const NearPlaces& point, double max_distance) {
  std::optional<NearPlace> nearest;
  for (Node node = 0; node < states_.size(); ++node) {
    if (!isReached(node)) continue;
    const NearPlace place = point.nearestIn(graph_.box(node));
    if (place.squared > (nearest ? nearest->squared : max_distance * max_distance)) continue;
    if (nearest && place.squared == nearest->squared) continue;
    nearest = place;
    last_ = node;
  }
  if (nearest) goal_ = CellBox::ofCell(point.placeAt(nearest->center, graph_.box(last_)));
  return nearest;
}

void PlaceSearch::reach(Node node, const Cell& entry, double cost, Node parent) {
  if (states_.size() < graph_.numNodes()) states_.resize(graph_.numNodes());
  State& state = states_[node];
  if (cost >= state.cost) return;
  state = {cost, parent, entry};
  open_.push({cost + distance(entry, clampTo(goal_, entry)), cost, node});
}

void PlaceSearch::expand(Node node) {
  graph_.findNeighbors(node, neighbors_);
  const State from = states_[node];
  for (const PlaceGraph::Neighbor& neighbor : neighbors_) {
    const Cell entry = clampTo(neighbor.places, from.entry);
    reach(neighbor.node, entry, from.cost + distance(from.entry, entry), node);
  }
}

}  // namespace cuboid_mapping
