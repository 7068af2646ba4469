// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/corridor_query.h"

#include "cuboid_mapping/geometry/box_faces.h"
#include "cuboid_mapping/query/corridor_boxes.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/place_graph.h"
#include "cuboid_mapping/query/way_search.h"

#include <algorithm>
#include <cmath>
#include <queue>

namespace cuboid_mapping {
namespace {

using PlaceNode = PlaceGraph::NodeIndex;

double distance(const Cell& a, const Cell& b) { return (toVector(a) - toVector(b)).norm(); }

/// A* from the places of the start to the places of the goal.
class PlaceSearch {
 public:
  PlaceSearch(PlaceGraph& graph, const CellBox& start, const CellBox& goal)
      : graph_(graph), start_(start), goal_(goal) {}

  AnswerStatus run(Budget& budget) {
    std::vector<PlaceNode> first;
    graph_.findNodes(start_, first);
    for (const PlaceNode node : first) {
      const Cell entry = clampTo(intersect(graph_.box(node), start_), clampTo(goal_, start_.min));
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

  /// Places from start to goal; two successive ones lie in one box of the graph, or side by side.
  [[nodiscard]] std::vector<Cell> toWay() const {
    std::vector<Cell> way{clampTo(intersect(graph_.box(last_), goal_), states_[last_].entry)};
    for (PlaceNode node = last_; node != PlaceGraph::kNoNode; node = states_[node].parent) {
      const State& state = states_[node];
      way.push_back(state.entry);
      if (state.parent != PlaceGraph::kNoNode) {
        way.push_back(clampTo(graph_.box(state.parent), state.entry));
      }
    }
    std::reverse(way.begin(), way.end());
    return way;
  }

 private:
  /// The best way to a node so far.
  struct State {
    double cost = std::numeric_limits<double>::infinity();
    PlaceNode parent = PlaceGraph::kNoNode;
    Cell entry;
  };
  struct Item {
    double estimate;
    double cost;
    PlaceNode node;
    bool operator<(const Item& other) const { return estimate > other.estimate; }
  };

  void reach(PlaceNode node, const Cell& entry, double cost, PlaceNode parent) {
    if (states_.size() < graph_.numNodes()) states_.resize(graph_.numNodes());
    State& state = states_[node];
    if (cost >= state.cost) return;
    state = {cost, parent, entry};
    open_.push({cost + distance(entry, clampTo(goal_, entry)), cost, node});
  }

  void expand(PlaceNode node) {
    graph_.findNeighbors(node, neighbors_);
    const State from = states_[node];
    for (const PlaceGraph::Neighbor& neighbor : neighbors_) {
      const Cell entry = clampTo(neighbor.places, from.entry);
      reach(neighbor.node, entry, from.cost + distance(from.entry, entry), node);
    }
  }

  PlaceGraph& graph_;
  CellBox start_;
  CellBox goal_;
  std::vector<State> states_;  ///< By node.
  std::priority_queue<Item> open_;
  std::vector<PlaceGraph::Neighbor> neighbors_;
  PlaceNode last_ = PlaceGraph::kNoNode;
};

/// Start and goal of a task, in voxels.
struct CorridorVoxels {
  Cell size;
  CellBox start;  ///< Voxels that the robot covers at the start.
  CellBox goal;   ///< Voxels that it covers at the goal.
};

std::optional<CorridorVoxels> toVoxels(const Grid& grid, const CorridorTask& task) {
  const bool is_valid = std::isfinite(task.clearance_m) && task.clearance_m >= 0.0 &&
                        std::isfinite(task.inflation_m) && task.inflation_m >= 0.0;
  const Eigen::Vector3d size_m = task.size_m.array() + 2.0 * task.inflation_m;
  const auto size = grid.toSizeInCells(size_m);
  if (!is_valid || !size || task.size_m.minCoeff() <= 0.0) return std::nullopt;
  auto start = grid.toCellBox(boxAround(task.start_map, size_m));
  auto goal = grid.toCellBox(boxAround(task.goal_map, size_m));
  if (!start || !goal) return std::nullopt;
  for (int axis = 0; axis < 3; ++axis) {  // Rounding may have made the box thinner.
    start->max[axis] = std::max(start->max[axis], start->min[axis] + (*size)[axis]);
    goal->max[axis] = std::max(goal->max[axis], goal->min[axis] + (*size)[axis]);
  }
  return CorridorVoxels{*size, *start, *goal};
}

Answer<Corridor> notFound(Blocked where, std::size_t num_visited) {
  Corridor none;
  none.blocked = where;
  none.num_visited = num_visited;
  return {AnswerStatus::kNotFound, none};
}

/// One search.
Answer<Corridor> searchOnce(const CuboidMap& map, const CorridorTask& task,
                            const CorridorVoxels& ends, const Obstacles& obstacles) {
  Budget& budget = obstacles.budget();
  const CellBox region = task.region.value_or(
      regionAround(map, unite(ends.start, ends.goal), ends.size + Cell{1, 1, 1}));
  const auto is_blocked = [&](const CellBox& box) {
    return !region.contains(box) || obstacles.isAny(box);
  };
  const bool is_start_blocked = is_blocked(ends.start);
  const bool is_goal_blocked = !is_start_blocked && is_blocked(ends.goal);
  if (budget.isSpent()) return AnswerStatus::kBudgetSpent;
  if (is_start_blocked) return notFound(Blocked::kStart, 0);
  if (is_goal_blocked) return notFound(Blocked::kGoal, 0);

  FitField field(obstacles, ends.size);
  PlaceGraph graph(field, field.placesIn(region));
  PlaceSearch search(graph, field.placesIn(ends.start), field.placesIn(ends.goal));
  const AnswerStatus status = search.run(budget);
  if (status == AnswerStatus::kNotFound) return notFound(Blocked::kBetween, graph.numNodes());
  Corridor corridor;
  corridor.num_visited = graph.numNodes();
  if (status != AnswerStatus::kFound) return {status, std::move(corridor)};
  const CorridorBoxes boxes(obstacles, field, region);
  corridor.boxes = boxes.compute(ends.start, search.toWay(), ends.goal);
  const CorridorPortals portals =
      findPortals(map.grid(), corridor.boxes, ends.size, task.clearance_m);
  corridor.portals_map = portals.centers_map;
  corridor.path_map = pullTight(portals, task.start_map, task.goal_map, budget);
  corridor.length_m = lengthOf(corridor.path_map);
  return corridor;
}

}  // namespace

Answer<Corridor> findCorridor(const CuboidMap& map, const CorridorTask& task, UnknownPolicy policy,
                              Budget& budget) {
  const auto ends = toVoxels(map.grid(), task);
  if (!ends) {
    return Answer<Corridor>::invalid(
        "start, goal and size must be finite and within the range of the grid, with edges > 0, "
        "inflation >= 0 and clearance >= 0");
  }
  const Obstacles obstacles(map, policy, budget);
  return searchUntilItHolds(
      map, budget, [&] { return searchOnce(map, task, *ends, obstacles); },
      [&](const Corridor& corridor) {
        const Obstacles now(map, policy, Budget::unlimited());
        return std::none_of(corridor.boxes.begin(), corridor.boxes.end(),
                            [&](const CellBox& box) { return now.isAny(box); });
      });
}

}  // namespace cuboid_mapping
