// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/pose_path.h"

#include "cuboid_mapping/query/pose_search.h"
#include "cuboid_mapping/query/way_search.h"

#include <algorithm>
#include <cmath>

namespace cuboid_mapping {
namespace {

using PoseWay = std::vector<Eigen::Isometry3d>;

bool isUpright(const Eigen::Isometry3d& pose) {
  constexpr double kTolerance = 1e-6;
  return (pose.linear().col(2) - Eigen::Vector3d::UnitZ()).norm() < kTolerance;
}

std::string findFault(const Eigen::Isometry3d& pose, const std::string& name, double range_m) {
  if (!isPose(pose, range_m)) {
    return name + " must be finite and within the range of the grid, with a quaternion of length 1";
  }
  if (isUpright(pose)) return {};
  return name + " tilts: the search turns about z only, so put the tilt into the body's parts";
}

/// Voxels that the body may use.
CellBox findRegion(const CuboidMap& map, const PosePathTask& task, UnknownPolicy policy) {
  const Grid& grid = map.grid();
  const auto cell_at = [&](const Eigen::Isometry3d& pose) {
    return CellBox::ofCell(*grid.toCell(pose.translation()));
  };
  const auto room =
      static_cast<std::int32_t>(std::ceil(2.0 * reachOf(task.body) * grid.inverseResolution())) + 1;
  return searchRegion(task.region, map, unite(cell_at(task.start_map), cell_at(task.goal_map)),
                      {room, room, room}, policy);
}

/// Joins steps of a way: fewer poses, with free motions between them that keep the room of the steps.
class StepJoiner {
 public:
  StepJoiner(PoseWay way, PoseClearance& clearance) : way_(std::move(way)), clearance_(clearance) {
    for (const Eigen::Isometry3d& pose : way_) levels_.push_back(clearance.levelAt(pose));
  }

  PoseWay join() {
    PoseWay joined{way_.front()};
    for (std::size_t at = 0; at + 1 < way_.size();) {
      at = findFarthest(at);
      joined.push_back(way_[at]);
    }
    return joined;
  }

 private:
  bool isFreeTo(std::size_t from, std::size_t to) {
    const auto first = levels_.begin() + static_cast<std::ptrdiff_t>(from);
    const auto last = levels_.begin() + static_cast<std::ptrdiff_t>(to) + 1;
    return clearance_.isFreeAt(*std::min_element(first, last), BodyMotion(way_[from], way_[to]));
  }

  /// Index of a late pose that a free straight motion reaches; at least the next one.
  std::size_t findFarthest(std::size_t from) {
    std::size_t farthest = from + 1;
    std::size_t step = 2;  // It is doubled while motions are free, then halved.
    while (from + step < way_.size() && isFreeTo(from, from + step)) {
      farthest = from + step;
      step *= 2;
    }
    for (step /= 2; step > 0; step /= 2) {
      if (farthest + step < way_.size() && isFreeTo(from, farthest + step)) farthest += step;
    }
    return farthest;
  }

  PoseWay way_;
  PoseClearance& clearance_;
  std::vector<int> levels_;  ///< Room at each pose.
};

/// A body that is smaller on all sides; parts that vanish are left out.
Body shrink(const Body& body, double by_m, const Grid& grid) {
  const double least_m = 2.0 * Body::kMinSize * grid.resolution();
  Body smaller;
  for (BodySphere sphere : body.spheres) {
    sphere.radius_m -= by_m;
    if (sphere.radius_m >= least_m) smaller.spheres.push_back(sphere);
  }
  for (BodyBox box : body.boxes) {
    box.size_m.array() -= 2.0 * by_m;
    if (box.size_m.minCoeff() >= least_m) smaller.boxes.push_back(box);
  }
  return smaller;
}

bool hasParts(const Body& body) { return !body.spheres.empty() || !body.boxes.empty(); }

/// A smaller body that touches nothing occupied at a pose, nor when it begins to move; without parts if none does.
Body findCore(const CuboidMap& map, const Body& body, const Eigen::Isometry3d& T_map_body,
              Budget& budget) {
  constexpr int kHalvings = 20;
  constexpr double kMotionRoom = 0.1;  // Voxels; checkMotion() may refuse a motion with less.
  const auto is_free = [&](const Body& core) {
    BodyProbe probe(map, core, UnknownPolicy::kFree, budget);
    return !probe.findContact(T_map_body);
  };
  double least_m = 0.0;
  double most_m = is_free(body) ? 0.0 : reachOf(body);
  for (int i = 0; i < kHalvings && most_m > 0.0; ++i) {
    const double middle_m = 0.5 * (least_m + most_m);
    (is_free(shrink(body, middle_m, map.grid())) ? most_m : least_m) = middle_m;
  }
  return shrink(body, most_m + kMotionRoom * map.grid().resolution(), map.grid());
}

Answer<PosePath> notFound(PosePath& path, Blocked where) {
  path.blocked = where;
  return {AnswerStatus::kNotFound, std::move(path)};
}

/// One search; length_m is not set.
Answer<PosePath> searchOnce(const CuboidMap& map, const PosePathTask& task, UnknownPolicy policy,
                            Budget& budget) {
  const CellBox region = findRegion(map, task, policy);
  PoseClearance clearance(map, task.body, policy, budget, region, task.clearance_m);
  BodyProbe& probe = clearance.body();
  PoseSearch search(map, task, policy, region, clearance);
  PosePath path;
  const auto is_blocked = [&](const Eigen::Isometry3d& pose) {
    const bool is_met = probe.findContact(pose).has_value();
    path.num_poses = probe.numPoses();
    if (!is_met) return false;
    path.met.reset();
    BodyProbe anywhere(map, task.body, policy, budget);  // Not in the region only.
    if (const auto contact = anywhere.findContact(pose)) path.met = contact->voxel;
    return true;
  };
  const bool is_start_blocked = is_blocked(task.start_map);
  const std::optional<Cell> met_at_start = path.met;
  const Body core = is_start_blocked ? findCore(map, task.body, task.start_map, budget) : Body();
  const bool may_leave = task.start_tolerance_m > 0.0 && hasParts(core);
  if (budget.isSpent()) return {AnswerStatus::kBudgetSpent, path};
  if (is_start_blocked && !may_leave) return notFound(path, Blocked::kStart);
  const bool is_goal_blocked = is_blocked(task.goal_map) && !search.moveGoal();
  if (budget.isSpent()) return {AnswerStatus::kBudgetSpent, path};
  if (is_goal_blocked) return notFound(path, Blocked::kGoal);
  if (is_start_blocked) path.met = met_at_start;

  BodyProbe core_probe(map, core, UnknownPolicy::kFree, budget);
  if (is_start_blocked) search.leaveStart(core_probe);
  AnswerStatus status = search.run();
  path.num_poses = probe.numPoses() + search.numPoses();
  if (status == AnswerStatus::kNotFound && search.endNear()) status = AnswerStatus::kFound;
  if (status == AnswerStatus::kNotFound && is_start_blocked && !search.hasLeft()) {
    return notFound(path, Blocked::kStart);
  }
  if (status != AnswerStatus::kFound) return {status, std::move(path)};
  PoseWay way = search.toWay();
  if (is_start_blocked) {
    path.start_distance_m = search.cost(way[0], way[1]);
    path.T_map_body.push_back(way.front());
    way.erase(way.begin());
  }
  path.goal_distance_m = (way.back().translation() - task.goal_map.translation()).norm();
  const PoseWay joined = StepJoiner(std::move(way), clearance).join();
  path.T_map_body.insert(path.T_map_body.end(), joined.begin(), joined.end());
  path.num_poses = probe.numPoses() + search.numPoses();
  return {status, std::move(path)};
}

}  // namespace

std::string findFault(const PosePathTask& task, const Grid& grid) {
  std::string fault = findFault(task.body, grid);
  if (!fault.empty()) return fault;
  const double range_m = rangeOf(task.body, grid);
  fault = findFault(task.start_map, "start", range_m);
  if (fault.empty()) fault = findFault(task.goal_map, "goal", range_m);
  if (!fault.empty()) return fault;
  const auto is_least = [](double value) { return value >= 0.0; };  // False for NaN.
  if (!std::isfinite(task.clearance_m) || !is_least(task.clearance_m) ||
      !is_least(task.start_tolerance_m) || !is_least(task.goal_tolerance_m)) {
    return "clearance and tolerances must be numbers >= 0";
  }
  const double rise_m =
      std::abs(task.goal_map.translation().z() - task.start_map.translation().z());
  if (!task.may_climb && rise_m >= grid.resolution()) {
    return "goal is a voxel or more above or below start: give both the same z, or let the robot "
           "climb";
  }
  return {};
}

Answer<PosePath> findPosePath(const CuboidMap& map, const PosePathTask& task, UnknownPolicy policy,
                              Budget& budget) {
  std::string fault = findFault(task, map.grid());
  if (!fault.empty()) return Answer<PosePath>::invalid(std::move(fault));
  auto path = searchUntilItHolds(
      map, budget, [&] { return searchOnce(map, task, policy, budget); },
      [&](const PosePath& found) {
        const PoseWay& poses = found.T_map_body;
        const bool leaves = found.start_distance_m > 0.0;
        const PoseWay free(poses.begin() + (leaves ? 1 : 0), poses.end());
        Budget& unlimited = Budget::unlimited();
        if (!checkMotion(map, task.body, free, policy, unlimited).isNotFound()) return false;
        if (!leaves) return true;
        const Body core = findCore(map, task.body, task.start_map, unlimited);
        BodyProbe probe(map, core, UnknownPolicy::kFree, unlimited);
        return hasParts(core) && isFree(probe, BodyMotion(poses[0], poses[1]));
      });
  if (!path.isFound()) return path;
  if (!budget.isSpent() && !budget.addEntries(path->T_map_body.size())) {
    return AnswerStatus::kBudgetSpent;
  }
  path.value.length_m = lengthOf(path->T_map_body);
  return path;
}

}  // namespace cuboid_mapping
