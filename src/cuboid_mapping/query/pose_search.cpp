// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/pose_search.h"

#include <algorithm>
#include <cmath>

namespace cuboid_mapping {
namespace {

/// Cost of a node, for its memory.
constexpr std::uint64_t kPoseNode = 16;
/// Cost of a metre of the way out of obstacles at the start.
constexpr double kLeavingCost = 10.0;
/// Additional cost of a metre without any clearance.
constexpr double kNarrowCost = 2.0;

Cell keyOf(const LatticePose& at) {
  return {at.place.x, at.place.y, at.place.z * PoseLattice::kNumHeadings + at.heading};
}

bool isSame(const LatticePose& a, const LatticePose& b) {
  return a.place == b.place && a.heading == b.heading;
}

/// Length of a way along edges and diagonals of squares.
double diagonalDistance(const Eigen::Vector2d& away) {
  const Eigen::Vector2d size = away.cwiseAbs();
  return size.maxCoeff() + (M_SQRT2 - 1.0) * size.minCoeff();
}

/// A box at heading 0 that encloses the body in every heading.
Body turningSpace(const Body& body) {
  double reach_m = 0.0;
  double low_m = std::numeric_limits<double>::infinity();
  double high_m = -low_m;
  const auto add = [&](const Eigen::Vector3d& point, double radius_m) {
    reach_m = std::max(reach_m, point.head<2>().norm() + radius_m);
    low_m = std::min(low_m, point.z() - radius_m);
    high_m = std::max(high_m, point.z() + radius_m);
  };
  for (const BodySphere& sphere : body.spheres) add(sphere.center_body, sphere.radius_m);
  for (const BodyBox& box : body.boxes) {
    for (int corner = 0; corner < 8; ++corner) add(cornerOf(box, corner), 0.0);
  }
  BodyBox space;
  space.T_body_box.translation().z() = 0.5 * (low_m + high_m);
  space.size_m = {2.0 * reach_m, 2.0 * reach_m, high_m - low_m};
  return {{}, {space}};
}

}  // namespace

PoseSearch::PoseSearch(const CuboidMap& map, const PosePathTask& task, UnknownPolicy policy,
                       const CellBox& region, PoseClearance& clearance)
    : task_(task),
      known_(policy == UnknownPolicy::kFree ? region
                                            : intersect(region, map.bounds().value_or(CellBox()))),
      clearance_(clearance),
      body_(clearance.body()),
      space_body_(turningSpace(task.body)),
      space_(map, space_body_, policy, body_.budget(), region),
      wide_space_(map, space_body_, policy, body_.budget(), region,
                  {task.clearance_m, task.clearance_m, 0.0}),
      goal_map_(task.goal_map),
      lattice_(map.grid(), task.start_map.translation().z(), task.may_climb),
      turn_cost_m_(0.5 * space_body_.boxes[0].size_m.x()),
      nodes_(2, Node{{}, std::numeric_limits<double>::infinity()}),
      before_goal_(lattice_.findAround(task.goal_map)) {
  nodes_[kStart].fit = nodes_[kGoal].fit = Fit::kFits;
}

AnswerStatus PoseSearch::run() {
  open_.push({estimate(task_.start_map), 0.0, kStart, kStart});
  while (!open_.empty() && body_.budget().spendAndUnlock()) {
    const Item item = open_.top();
    open_.pop();
    if (nodes_[item.node].is_closed) continue;
    if (item.node != kStart && !isStepFree(item.parent, item.node)) continue;
    Node& node = nodes_[item.node];
    node.is_closed = true;
    node.cost = item.cost;
    node.parent = item.parent;
    if (item.node == kGoal) return AnswerStatus::kFound;
    expand(item.node);
  }
  return body_.budget().isSpent() ? AnswerStatus::kBudgetSpent : AnswerStatus::kNotFound;
}

std::vector<Eigen::Isometry3d> PoseSearch::toWay() const {
  std::vector<Eigen::Isometry3d> way{pose(last_)};
  for (Number node = last_; node != kStart; node = nodes_[node].parent) {
    way.push_back(pose(nodes_[node].parent));
  }
  std::reverse(way.begin(), way.end());
  return way;
}

PoseSearch::Number PoseSearch::numberOf(const LatticePose& at) {
  const auto [found, is_new] = numbers_.emplace(keyOf(at), static_cast<Number>(nodes_.size()));
  if (is_new) {
    nodes_.push_back({at, std::numeric_limits<double>::infinity()});
    (void)body_.budget().spend(kPoseNode);  // If it is spent, run() ends.
  }
  return found->second;
}

Eigen::Isometry3d PoseSearch::pose(Number number) const {
  if (number == kStart) return task_.start_map;
  return number == kGoal ? goal_map_ : lattice_.pose(nodes_[number].at);
}

double PoseSearch::cost(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to) const {
  return (to.translation() - from.translation()).norm() +
         turn_cost_m_ * angleBetween(headingOf(from), headingOf(to));
}

double PoseSearch::estimate(const Eigen::Isometry3d& from) const {
  const Eigen::Vector3d away = goal_map_.translation() - from.translation();
  return diagonalDistance(away.head<2>()) + std::abs(away.z()) +
         turn_cost_m_ * angleBetween(headingOf(from), headingOf(goal_map_));
}

void PoseSearch::reach(Number number, Number from, double step_cost) {
  Node& node = nodes_[number];
  const double cost = nodes_[from].cost + step_cost;
  if (node.is_closed || node.fit == Fit::kBlocked || cost >= node.cost) return;
  if (isOpen(from, number)) node.cost = cost;
  open_.push({cost + estimate(pose(number)), cost, number, from});
}

void PoseSearch::expand(Number number) {
  const Eigen::Isometry3d from = pose(number);
  const auto step_to = [&](Number to) {
    reach(to, number, cost(from, pose(to)) * costPerMetre(to));
  };
  if (number == kStart && core_ != nullptr) return reachExits();
  if (number == kStart) {
    for (const LatticePose& at : lattice_.findAround(from)) step_to(numberOf(at));
    step_to(kGoal);
    return;
  }
  const LatticePose at = nodes_[number].at;
  lattice_.findNeighbors(at, neighbors_);
  for (const LatticePose& neighbor : neighbors_) step_to(numberOf(neighbor));
  const bool is_before_goal =
      std::any_of(before_goal_.begin(), before_goal_.end(),
                  [&](const LatticePose& before) { return isSame(before, at); });
  if (is_before_goal) step_to(kGoal);
}

bool PoseSearch::isStepFree(Number from, Number to) {
  if (isOpen(from, to)) return true;
  const Eigen::Isometry3d T_map_body = pose(to);
  Node& node = nodes_[to];
  if (node.fit == Fit::kNotKnown) {
    node.fit = body_.findContact(T_map_body) ? Fit::kBlocked : Fit::kFits;
  }
  BodyProbe& moved = from == kStart && core_ != nullptr ? *core_ : body_;
  return node.fit == Fit::kFits && isFree(moved, BodyMotion(pose(from), T_map_body));
}

/// 1 with all of the clearance, more with less of it.
double PoseSearch::costPerMetre(Number number) {
  if (clearance_.last() == 0 || number == kGoal) return 1.0;
  Node& node = nodes_[number];
  if (node.level < 0) {
    const int level = isWide(node.at.place) ? clearance_.last() : clearance_.levelAt(pose(number));
    node.level = static_cast<signed char>(level);
  }
  return 1.0 + kNarrowCost * (clearance_.last() - node.level) / clearance_.last();
}

bool PoseSearch::isWide(const Cell& place) {
  const auto [found, is_new] = wide_places_.emplace(place, false);
  if (!is_new) return found->second;
  found->second =
      !wide_space_.findContact(Eigen::Isometry3d(Eigen::Translation3d(lattice_.position(place))));
  return found->second;
}

/// Distance of a point from the farthest corner of the voxels that can be free, metres.
double PoseSearch::farthest(const Eigen::Vector3d& center) const {
  const MetricBox region = body_.grid().toMetricBox(known_);
  return (center - region.min_m).cwiseAbs().cwiseMax((center - region.max_m).cwiseAbs()).norm();
}

/// The places of the lattice within a radius, in no particular order.
void PoseSearch::findPlacesAround(const Eigen::Vector3d& center, double radius_m,
                                  std::vector<Cell>& places) const {
  places.clear();
  const double edge_m = body_.grid().resolution();
  constexpr std::int32_t kMost = Grid::kMaxCell;
  const auto reach = static_cast<std::int32_t>(std::min(std::ceil(radius_m / edge_m), 1.0 * kMost));
  const Cell middle =
      lattice_.findAround(Eigen::Isometry3d(Eigen::Translation3d(center))).front().place;
  CellBox around{middle - Cell{reach, reach, 0}, middle + Cell{reach + 2, reach + 2, 1}};
  if (task_.may_climb) {  // Start and goal may lie at both ends of the grid.
    around.min.z = std::max(middle.z, reach - 2 * kMost) - reach;
    around.max.z = std::min(middle.z, 2 * kMost - reach) + reach + 1;
  }
  for (const int axis : {0, 1}) {  // z counts planes.
    around.min[axis] = std::max(around.min[axis], known_.min[axis]);
    around.max[axis] = std::min(around.max[axis], known_.max[axis]);
  }
  for (Cell at = around.min; at.z < around.max.z; ++at.z) {
    for (at.y = around.min.y; at.y < around.max.y; ++at.y) {
      for (at.x = around.min.x; at.x < around.max.x; ++at.x) {
        if (!body_.budget().spendAndUnlock()) return;
        if ((lattice_.position(at) - center).norm() <= radius_m) places.push_back(at);
      }
    }
  }
}

/// The poses that the body may leave a blocked start for.
void PoseSearch::reachExits() {
  const Eigen::Vector3d center = task_.start_map.translation();
  std::vector<Cell> places;
  findPlacesAround(center, std::min(task_.start_tolerance_m, farthest(center)), places);
  for (const Cell& place : places) {
    if (!body_.budget().spendAndUnlock()) return;
    for (int heading = 0; heading < PoseLattice::kNumHeadings; ++heading) {
      const Number exit = numberOf({place, heading});
      const double length_m = cost(task_.start_map, pose(exit));
      if (length_m <= task_.start_tolerance_m) reach(exit, kStart, kLeavingCost * length_m);
    }
  }
}

bool PoseSearch::moveGoal() {
  const Eigen::Vector3d wanted = task_.goal_map.translation();
  const double edge_m = body_.grid().resolution();
  const double last_m = std::min(task_.goal_tolerance_m, farthest(wanted));
  std::vector<Cell> places;
  double tried_m = -1.0;
  for (double radius_m = 4.0 * edge_m; !body_.budget().isSpent(); radius_m *= 2.0) {
    radius_m = std::min(radius_m, last_m);
    findPlacesAround(wanted, radius_m, places);
    const auto distance = [&](const Cell& place) {
      return (lattice_.position(place) - wanted).norm();
    };
    std::stable_sort(places.begin(), places.end(),
                     [&](const Cell& a, const Cell& b) { return distance(a) < distance(b); });
    for (const Cell& place : places) {
      if (distance(place) <= tried_m) continue;
      if (!body_.budget().spendAndUnlock()) return false;
      Eigen::Isometry3d pose = task_.goal_map;
      pose.translation() = lattice_.position(place);
      if (body_.findContact(pose)) continue;
      goal_map_ = pose;
      before_goal_ = lattice_.findAround(pose);
      return !body_.budget().isSpent();
    }
    if (radius_m >= last_m) return false;
    tried_m = radius_m;
  }
  return false;
}

bool PoseSearch::hasLeft() const {
  return std::any_of(nodes_.begin() + kGoal + 1, nodes_.end(),
                     [](const Node& node) { return node.is_closed; });
}

bool PoseSearch::endNear() {
  double least = std::numeric_limits<double>::infinity();
  for (Number number = kGoal + 1; number < nodes_.size(); ++number) {
    if (!nodes_[number].is_closed) continue;
    const Eigen::Isometry3d at = pose(number);
    const double each = cost(task_.goal_map, at);
    const bool is_near =
        (at.translation() - task_.goal_map.translation()).norm() <= task_.goal_tolerance_m;
    if (!is_near || each >= least) continue;
    least = each;
    last_ = number;
  }
  return last_ != kGoal;
}

/// Whether a step is free without a check of its motion.
bool PoseSearch::isOpen(Number from, Number to) {
  return from > kGoal && to > kGoal && isOpen(nodes_[from].at.place) && isOpen(nodes_[to].at.place);
}

bool PoseSearch::isOpen(const Cell& place) {
  const auto [found, is_new] = open_places_.emplace(place, false);
  if (!is_new) return found->second;
  // Half a step, and the tolerance of checkMotion(), so that both give the same answer.
  const double half_m = (0.5 + 2.0 * kMotionTolerance) * body_.grid().resolution();
  const Sway sway{Eigen::Vector3d(half_m, half_m, task_.may_climb ? half_m : 0.0),
                  Eigen::Vector3d::Zero()};
  const Eigen::Isometry3d T_map_body(Eigen::Translation3d(lattice_.position(place)));
  found->second = !space_.findContact(T_map_body, sway) && !body_.budget().isSpent();
  return found->second;
}

}  // namespace cuboid_mapping
