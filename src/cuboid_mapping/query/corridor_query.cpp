// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/corridor_query.h"

#include "cuboid_mapping/query/corridor_boxes.h"
#include "cuboid_mapping/query/near_places.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/place_graph.h"
#include "cuboid_mapping/query/way_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <vector>

namespace cuboid_mapping {
namespace {

/// A robot: a box that does not turn.
struct RobotBox {
  Eigen::Vector3d size_m;  ///< Edges, inflation included.
  Cell size;               ///< Edges in voxels, rounded up.
};

/// The robot at an end of its way.
struct RobotEnd {
  Eigen::Vector3d center_map;
  CellBox box;  ///< Voxels that it covers.
};

std::optional<RobotBox> toRobot(const Grid& grid, const CorridorTask& task) {
  const auto is_least = [](double value) { return value >= 0.0; };  // False for NaN.
  const bool is_valid = std::isfinite(task.clearance_m) && is_least(task.clearance_m) &&
                        std::isfinite(task.inflation_m) && is_least(task.inflation_m) &&
                        is_least(task.start_tolerance_m) && is_least(task.goal_tolerance_m);
  const Eigen::Vector3d size_m = task.size_m.array() + 2.0 * task.inflation_m;
  const auto size = grid.toSizeInCells(size_m);
  if (!is_valid || !size || task.size_m.minCoeff() <= 0.0) return std::nullopt;
  return RobotBox{size_m, *size};
}

std::optional<RobotEnd> toEnd(const Grid& grid, const RobotBox& robot,
                              const Eigen::Vector3d& center_map) {
  auto box = grid.toCellBox(boxAround(center_map, robot.size_m));
  if (!box) return std::nullopt;
  for (int axis = 0; axis < 3; ++axis) {  // Rounding may have made the box thinner.
    box->max[axis] = std::max(box->max[axis], box->min[axis] + robot.size[axis]);
  }
  return RobotEnd{center_map, *box};
}

/// Edges of the robot after it has shrunk on all sides until it touches nothing occupied at an end.
Eigen::Vector3d coreAt(const RobotEnd& end, const CuboidMap& map, const RobotBox& robot,
                       Budget& budget) {
  const Grid& grid = map.grid();
  const Eigen::Vector3d half = 0.5 * grid.toCellUnits(robot.size_m);
  const Eigen::Vector3d center = grid.toCellUnits(end.center_map);
  double depth = 0.0;
  Obstacles(map, UnknownPolicy::kFree, budget).visit(end.box, [&](const Cell& voxel) {
    const Eigen::Vector3d beyond = center + half - toVector(voxel);
    const Eigen::Vector3d before = toVector(voxel) + Eigen::Vector3d::Ones() - (center - half);
    depth = std::max(depth, beyond.cwiseMin(before).minCoeff());
  });
  return robot.size_m.array() - 2.0 * depth * grid.resolution();
}

double distance(const Cell& a, const Cell& b) { return (toVector(a) - toVector(b)).norm(); }

/// Appends the places behind the first one of a straight line, each beside the one before. @return false: the robot
/// does not fit at all of them, and nothing is appended.
bool appendLine(FitField& field, const Cell& from, const Cell& to, std::vector<Cell>& way) {
  const std::size_t size_before = way.size();
  // Parts of the line: between two voxels along each axis, and up to the next one.
  const Eigen::Vector3d period = (toVector(to) - toVector(from)).cwiseAbs().cwiseInverse();
  Eigen::Vector3d next = 0.5 * period;
  for (Cell place = from; place != to;) {
    int axis = 0;
    next.minCoeff(&axis);
    next[axis] += period[axis];
    place[axis] += to[axis] > from[axis] ? 1 : -1;
    if (!field.fits(place)) {
      way.resize(size_before);
      return false;
    }
    way.push_back(place);
  }
  return true;
}

/// A way with straight lines where the robot fits along them. @param way  As of PlaceSearch::toWay().
std::vector<Cell> straighten(FitField& field, const std::vector<Cell>& way) {
  std::vector<Cell> straight{way.front()};
  for (std::size_t at = 0; at + 1 < way.size();) {
    std::size_t gap = way.size() - 1 - at;
    while (gap > 1 && !appendLine(field, way[at], way[at + gap], straight)) gap /= 2;
    at += gap;
    if (gap == 1) straight.push_back(way[at]);
  }
  return straight;
}

/// A* over a PlaceGraph, from starts to the places of a goal.
class PlaceSearch {
 public:
  /// @param graph  Must outlive this object. @param goal  Places.
  PlaceSearch(PlaceGraph& graph, const CellBox& goal) : graph_(graph), goal_(goal) {}

  /// Searches from the places of a start that no earlier start has reached. kFound: see toWay().
  AnswerStatus run(const CellBox& start, Budget& budget) {
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

  /// Places from a start to the end; two successive ones lie in one box of the graph, or side by side.
  /// @pre run() or endNear() has found the end.
  [[nodiscard]] std::vector<Cell> toWay() const {
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

  /// Ends the way at the reached position that is nearest to a point. @param point  The positions around it.
  /// @return That position; nothing if all are farther than max_distance.
  [[nodiscard]] std::optional<NearPlace> endNear(const NearPlaces& point, double max_distance) {
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
  void reach(Node node, const Cell& entry, double cost, Node parent) {
    if (states_.size() < graph_.numNodes()) states_.resize(graph_.numNodes());
    State& state = states_[node];
    if (cost >= state.cost) return;
    state = {cost, parent, entry};
    open_.push({cost + distance(entry, clampTo(goal_, entry)), cost, node});
  }

  void expand(Node node) {
    graph_.findNeighbors(node, neighbors_);
    const State from = states_[node];
    for (const PlaceGraph::Neighbor& neighbor : neighbors_) {
      const Cell entry = clampTo(neighbor.places, from.entry);
      reach(neighbor.node, entry, from.cost + distance(from.entry, entry), node);
    }
  }

  PlaceGraph& graph_;
  CellBox goal_;
  std::vector<State> states_;  ///< By node.
  std::priority_queue<Item> open_;
  std::vector<PlaceGraph::Neighbor> neighbors_;
  Node last_ = PlaceGraph::kNoNode;
};

/// One search.
class CorridorSearch {
 public:
  CorridorSearch(const CuboidMap& map, const CorridorTask& task, const RobotBox& robot,
                 const RobotEnd& start, const RobotEnd& goal, const Obstacles& obstacles,
                 const CellBox& region)
      : map_(map),
        task_(task),
        robot_(robot),
        start_(start),
        goal_(goal),
        obstacles_(obstacles),
        region_(region),
        field_(obstacles, robot.size),
        graph_(field_, field_.placesIn(region)) {}

  Answer<Corridor> run() {
    const bool is_start_blocked = isBlocked(start_);
    const std::optional<Cell> met_at_start = corridor_.met;
    if (is_start_blocked && !(task_.start_tolerance_m > 0.0)) return notFound(Blocked::kStart);
    if (isBlocked(goal_) && !moveGoal()) return notFound(Blocked::kGoal);
    if (is_start_blocked) {
      corridor_.met = met_at_start;
    } else if (const std::vector<Cell> way = straightWay(); !way.empty()) {
      makeCorridor(way);  // In the open, where a search would reach many places.
      return std::move(corridor_);
    }
    PlaceSearch search(graph_, field_.placesIn(goal_.box));
    AnswerStatus status =
        is_start_blocked ? leaveStart(search) : search.run(field_.placesIn(start_.box), budget());
    if (is_start_blocked && exits_.empty()) return notFound(Blocked::kStart);
    if (status == AnswerStatus::kNotFound && endNear(search)) status = AnswerStatus::kFound;
    if (status == AnswerStatus::kNotFound) return notFound(Blocked::kBetween);
    corridor_.num_visited = graph_.numNodes();
    if (status == AnswerStatus::kFound) makeCorridor(straighten(field_, search.toWay()));
    return {status, std::move(corridor_)};
  }

 private:
  [[nodiscard]] Budget& budget() const { return obstacles_.budget(); }
  [[nodiscard]] Eigen::Vector3d toUnits(const Eigen::Vector3d& metres) const {
    return map_.grid().toCellUnits(metres);
  }
  [[nodiscard]] NearPlaces placesAround(const Eigen::Vector3d& center_map) {
    return {field_, toUnits(center_map), toUnits(robot_.size_m), field_.placesIn(region_)};
  }
  [[nodiscard]] RobotEnd endAt(const NearPlace& place) const {
    return *toEnd(map_.grid(), robot_, map_.grid().toMetres(place.center));
  }

  Answer<Corridor> notFound(Blocked where) {
    if (budget().isSpent()) return AnswerStatus::kBudgetSpent;
    corridor_.blocked = where;
    corridor_.num_visited = graph_.numNodes();
    return {AnswerStatus::kNotFound, std::move(corridor_)};
  }

  /// Whether the robot cannot be at an end; notes the voxel that it touches.
  bool isBlocked(const RobotEnd& end) {
    if (region_.contains(end.box) && !obstacles_.isAny(end.box)) return false;
    corridor_.met = Obstacles(map_, UnknownPolicy::kFree, budget()).findAny(end.box);
    if (!corridor_.met) corridor_.met = obstacles_.findAny(end.box);
    return true;
  }

  /// The straight way between the nearest places of start and goal; empty: the robot does not fit along it.
  [[nodiscard]] std::vector<Cell> straightWay() {
    const CellBox goal = field_.placesIn(goal_.box);
    const Cell from = clampTo(field_.placesIn(start_.box), goal.min);
    std::vector<Cell> way{from};
    if (!appendLine(field_, from, clampTo(goal, from), way)) way.clear();
    return way;
  }

  /// Moves the goal to the nearest free place.
  bool moveGoal() {
    const auto place = placesAround(goal_.center_map)
                           .findNearest(task_.goal_tolerance_m * map_.grid().inverseResolution());
    if (place) goal_ = endAt(*place);
    return place.has_value();
  }

  /// Ends the way at the reached place nearest to the goal of the task.
  bool endNear(PlaceSearch& search) {
    if (!(task_.goal_tolerance_m > 0.0)) return false;
    const auto place = search.endNear(placesAround(task_.goal_map),
                                      task_.goal_tolerance_m * map_.grid().inverseResolution());
    if (place) goal_ = endAt(*place);
    return place.has_value();
  }

  /// Searches from the nearest place that the robot can leave the start for, then from the next ones.
  AnswerStatus leaveStart(PlaceSearch& search) {
    constexpr double kFirstRadius = 4.0;  // Voxels.
    const RobotEnd start = start_;
    const Eigen::Vector3d core_m = coreAt(start, map_, robot_, budget());
    if (core_m.minCoeff() <= 0.0) return AnswerStatus::kNotFound;
    NearPlaces around = placesAround(start.center_map);
    const double last_radius =
        std::min(task_.start_tolerance_m * map_.grid().inverseResolution(), around.farthest());
    double tried_squared = -1.0;
    for (double radius = kFirstRadius; !budget().isSpent(); radius *= 2.0) {
      radius = std::min(radius, last_radius);
      for (const NearPlace& place : around.findAll(radius)) {
        if (place.squared <= tried_squared) continue;
        start_ = endAt(place);
        const std::vector<Eigen::Vector3d> way_out{start.center_map, start_.center_map};
        if (!isPathFree(map_, way_out, core_m, UnknownPolicy::kFree, budget())) continue;
        exits_.push_back(start_);
        const AnswerStatus status = search.run(field_.placesIn(start_.box), budget());
        if (status != AnswerStatus::kNotFound) return status;
      }
      if (radius >= last_radius) return AnswerStatus::kNotFound;
      tried_squared = radius * radius;
    }
    return AnswerStatus::kBudgetSpent;
  }

  void makeCorridor(const std::vector<Cell>& way) {
    for (const RobotEnd& exit : exits_) {
      if (!field_.placesIn(exit.box).contains(way.front())) continue;
      start_ = exit;
      break;
    }
    const CorridorBoxes boxes(obstacles_, field_, region_);
    corridor_.boxes = boxes.compute(start_.box, way, goal_.box);
    const CorridorPortals portals =
        findPortals(map_.grid(), corridor_.boxes, robot_.size, task_.clearance_m);
    corridor_.portals_map = portals.centers_map;
    corridor_.path_map = pullTight(portals, start_.center_map, goal_.center_map);
    if (!exits_.empty()) {
      corridor_.path_map.insert(corridor_.path_map.begin(), task_.start_map);
    }
    corridor_.length_m = lengthOf(corridor_.path_map);
    corridor_.start_distance_m = (start_.center_map - task_.start_map).norm();
    corridor_.goal_distance_m = (goal_.center_map - task_.goal_map).norm();
  }

  const CuboidMap& map_;
  const CorridorTask& task_;
  const RobotBox& robot_;
  RobotEnd start_;
  RobotEnd goal_;
  const Obstacles& obstacles_;
  CellBox region_;
  FitField field_;
  PlaceGraph graph_;
  std::vector<RobotEnd> exits_;  ///< Places that the robot can leave a blocked start for.
  Corridor corridor_;
};

}  // namespace

Answer<Corridor> findCorridor(const CuboidMap& map, const CorridorTask& task, UnknownPolicy policy,
                              Budget& budget) {
  const auto robot = toRobot(map.grid(), task);
  const auto start = robot ? toEnd(map.grid(), *robot, task.start_map) : std::nullopt;
  const auto goal = robot ? toEnd(map.grid(), *robot, task.goal_map) : std::nullopt;
  if (!start || !goal) {
    return Answer<Corridor>::invalid(
        "start, goal and size must be finite and within the range of the grid, with edges > 0, "
        "and inflation, clearance and tolerances >= 0");
  }
  const Obstacles obstacles(map, policy, budget);
  const auto search = [&] {
    Cell room = robot->size + Cell{1, 1, 1};
    if (policy == UnknownPolicy::kFree) room.z = 0;
    const CellBox ends = unite(start->box, goal->box);
    const CellBox region = searchRegion(task.region, map, ends, room, policy);
    return CorridorSearch(map, task, *robot, *start, *goal, obstacles, region).run();
  };
  return searchUntilItHolds(map, budget, search, [&](const Corridor& corridor) {
    Budget& unlimited = Budget::unlimited();
    const Obstacles now(map, policy, unlimited);
    if (std::any_of(corridor.boxes.begin(), corridor.boxes.end(),
                    [&](const CellBox& box) { return now.isAny(box); })) {
      return false;
    }
    return corridor.start_distance_m == 0.0 ||
           isPathFree(map, {corridor.path_map[0], corridor.path_map[1]},
                      coreAt(*start, map, *robot, unlimited), UnknownPolicy::kFree, unlimited);
  });
}

}  // namespace cuboid_mapping
