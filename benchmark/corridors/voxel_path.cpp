// SPDX-License-Identifier: BSD-3-Clause
#include "corridors/voxel_path.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <queue>
#include <unordered_map>

namespace cuboid_mapping::bench {
namespace {

/// Length of the shortest path through empty space.
double estimate(const Cell& from, const Cell& to) {
  std::array<int, 3> steps{std::abs(to.x - from.x), std::abs(to.y - from.y),
                           std::abs(to.z - from.z)};
  std::sort(steps.begin(), steps.end());
  return std::sqrt(3.0) * steps[0] + std::sqrt(2.0) * (steps[1] - steps[0]) + (steps[2] - steps[1]);
}

/// The 27 voxels around one, itself in the middle; a step is the number of the voxel it leads to.
class Surroundings {
 public:
  static constexpr int kNumSteps = 27;

  Surroundings(const VoxelStore& voxels, const Cell& center) {
    for (int step = 0; step < kNumSteps; ++step) {
      is_free_[static_cast<std::size_t>(step)] =
          voxels.at(center + offset(step)) == Occupancy::kFree;
    }
  }

  static constexpr Cell offset(int step) { return {step % 3 - 1, step / 3 % 3 - 1, step / 9 - 1}; }

  /// Whether all voxels are free that the robot meets on a step: those between the two, axis by axis.
  [[nodiscard]] bool isFree(int step) const {
    const Cell to = offset(step);
    for (int met = 0; met < kNumSteps; ++met) {
      const Cell at = offset(met);
      const bool is_between =
          (at.x == 0 || at.x == to.x) && (at.y == 0 || at.y == to.y) && (at.z == 0 || at.z == to.z);
      if (is_between && !is_free_[static_cast<std::size_t>(met)]) return false;
    }
    return true;
  }

 private:
  std::array<bool, kNumSteps> is_free_{};
};

struct State {
  double cost = std::numeric_limits<double>::infinity();
  Cell parent;
};

struct Item {
  double estimate;
  double cost;
  Cell voxel;
  /// Of equal estimates the one nearest to the goal comes first.
  bool operator<(const Item& other) const {
    return estimate != other.estimate ? estimate > other.estimate : cost < other.cost;
  }
};

using States = std::unordered_map<Cell, State, CellHash>;

std::vector<Cell> toWay(const States& states, const Cell& start, const Cell& goal) {
  std::vector<Cell> way{goal};
  while (way.back() != start) way.push_back(states.at(way.back()).parent);
  std::reverse(way.begin(), way.end());
  return way;
}

}  // namespace

VoxelPath findVoxelPath(const VoxelStore& voxels, const Cell& start, const Cell& goal) {
  States states;
  std::priority_queue<Item> open;
  VoxelPath path;
  states[start] = {0.0, start};
  open.push({estimate(start, goal), 0.0, start});
  while (!open.empty()) {
    const Item item = open.top();
    open.pop();
    if (item.cost > states.at(item.voxel).cost) continue;  // Reached on a shorter way since.
    if (item.voxel == goal) {
      path.voxels = toWay(states, start, goal);
      path.length = item.cost;
      break;
    }
    const Surroundings around(voxels, item.voxel);
    for (int step = 0; step < Surroundings::kNumSteps; ++step) {
      if (!around.isFree(step)) continue;
      const Cell next = item.voxel + Surroundings::offset(step);
      const double cost = item.cost + estimate(item.voxel, next);
      State& state = states[next];
      if (cost >= state.cost) continue;
      state = {cost, item.voxel};
      open.push({cost + estimate(next, goal), cost, next});
    }
  }
  path.num_reached = states.size();
  return path;
}

}  // namespace cuboid_mapping::bench
