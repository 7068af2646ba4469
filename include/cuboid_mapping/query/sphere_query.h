// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     SphereChecker arm(map, UnknownPolicy::kObstacle, Budget::unlimited());
//     const auto answers = arm.check({{{0.5, 0.5, 0.5}, 0.2}, {{2, 1, 0.5}, 0.2}});
//     if (answers[0] == AnswerStatus::kNotFound) std::cout << "the first ball is free\n";
//     if (answers[1] == AnswerStatus::kFound) std::cout << "the second one meets an obstacle\n";
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/answer.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace cuboid_mapping {

/// A ball in a map, such as a part of an arm.
struct Sphere {
  Eigen::Vector3d center_map = Eigen::Vector3d::Zero();  ///< Metres.
  double radius_m = 0.0;                                 ///< > 0.
};

/// Whether balls meet an obstacle: one batch after the other, such as an arm at the states of a plan.
///
/// Exact against the voxels, as checkPoses(). Keeps obstacles that it has looked at, at most 220 kB, until the map's
/// revision changes; a map that is assigned needs a new checker. One thread at a time may use it.
class SphereChecker {
 public:
  /// @param map, budget  Must outlive this object. The budget counts bricks that are looked at; another one may be
  ///                     assigned to it between two batches.
  SphereChecker(const CuboidMap& map, UnknownPolicy policy, Budget& budget);
  /// Takes over what another checker keeps; that one can only be destroyed or assigned to.
  ///@{
  SphereChecker(SphereChecker&& other) noexcept;
  SphereChecker& operator=(SphereChecker&& other) noexcept;
  ///@}
  ~SphereChecker();

  /// Whether each of some balls meets an obstacle: kFound, or kNotFound if it is free. Balls that touch the one before
  /// are faster.
  ///
  /// Cases:
  ///   - a number that is not finite, a radius below Body::kMinSize or above Body::kMaxReach voxels, a ball that
  ///     reaches out of the grid's range: kInvalid;
  ///   - the budget is spent: kBudgetSpent for this ball and those after it.
  ///
  /// @complexity O(bricks that a ball overlaps, and voxels in the way near it), until the first contact; for each
  /// ball.
  [[nodiscard]] std::vector<AnswerStatus> check(const std::vector<Sphere>& spheres);

 private:
  struct Kept;

  const CuboidMap* map_;
  UnknownPolicy policy_;
  Budget* budget_;
  std::uint64_t revision_;
  std::unique_ptr<Kept> kept_;  ///< Obstacles of this revision.
};

}  // namespace cuboid_mapping
