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
CellBox findRegion(const CuboidMap& map, const PosePathTask& task) {
  if (task.region) return *task.region;
  const Grid& grid = map.grid();
  const auto cell_at = [&](const Eigen::Isometry3d& pose) {
    return CellBox::ofCell(*grid.toCell(pose.translation()));
  };
  const auto room =
      static_cast<std::int32_t>(std::ceil(2.0 * reachOf(task.body) * grid.inverseResolution())) + 1;
  return regionAround(map, unite(cell_at(task.start_map), cell_at(task.goal_map)),
                      {room, room, room});
}

/// Index of a pose as late as possible that a free straight motion reaches; at least the next one.
std::size_t findFarthest(const PoseWay& way, std::size_t from, BodyProbe& probe) {
  const auto is_free = [&](std::size_t to) {
    return isFree(probe, BodyMotion(way[from], way[to]));
  };
  std::size_t farthest = from + 1;
  std::size_t step = 2;  // It is doubled while motions are free, then halved.
  while (from + step < way.size() && is_free(from + step)) {
    farthest = from + step;
    step *= 2;
  }
  for (step /= 2; step > 0; step /= 2) {
    if (farthest + step < way.size() && is_free(farthest + step)) farthest += step;
  }
  return farthest;
}

/// Joins steps: fewer poses, with free motions between them.
PoseWay joinSteps(const PoseWay& way, BodyProbe& probe) {
  PoseWay joined{way.front()};
  for (std::size_t at = 0; at + 1 < way.size();) {
    at = findFarthest(way, at, probe);
    joined.push_back(way[at]);
  }
  return joined;
}

/// One search; length_m is not set.
Answer<PosePath> searchOnce(const CuboidMap& map, const PosePathTask& task, UnknownPolicy policy,
                            Budget& budget) {
  const CellBox region = findRegion(map, task);
  BodyProbe probe(map, task.body, policy, budget, region);
  PosePath path;
  const bool is_start_blocked = probe.findContact(task.start_map).has_value();
  const bool is_goal_blocked = !is_start_blocked && probe.findContact(task.goal_map);
  path.num_poses = probe.numPoses();
  if (budget.isSpent()) return {AnswerStatus::kBudgetSpent, path};
  if (is_start_blocked || is_goal_blocked) {
    path.blocked = is_start_blocked ? Blocked::kStart : Blocked::kGoal;
    return {AnswerStatus::kNotFound, path};
  }
  PoseSearch search(map, task, policy, region, probe);
  const AnswerStatus status = search.run();
  if (status == AnswerStatus::kFound) path.T_map_body = joinSteps(search.toWay(), probe);
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
        return checkMotion(map, task.body, found.T_map_body, policy, Budget::unlimited())
            .isNotFound();
      });
  if (!path.isFound()) return path;
  if (!budget.isSpent() && !budget.addEntries(path->T_map_body.size())) {
    return AnswerStatus::kBudgetSpent;
  }
  path.value.length_m = lengthOf(path->T_map_body);
  return path;
}

}  // namespace cuboid_mapping
