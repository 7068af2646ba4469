// SPDX-License-Identifier: BSD-3-Clause
// Validity checks for OMPL 1.5 or later. Header only: link OMPL and cuboid_mapping::core.
#pragma once

#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/path_query.h"

#include <ompl/base/MotionValidator.h>
#include <ompl/base/SpaceInformation.h>
#include <ompl/base/StateValidityChecker.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>

#include <stdexcept>
#include <utility>
#include <vector>

namespace cuboid_mapping {

/// A robot that is a box and does not turn, in a map.
struct OmplRobot {
  const CuboidMap& map;    ///< Must outlive the planner, and not change while it plans.
  Eigen::Vector3d size_m;  ///< Edges, > 0.
  UnknownPolicy policy;    ///< Meaning of unknown space.

  /// A robot with these edges in a map. @throws std::invalid_argument  No map can hold a box with these edges.
  OmplRobot(const CuboidMap& in_map, const Eigen::Vector3d& edges_m, UnknownPolicy unknown)
      : map(in_map), size_m(edges_m), policy(unknown) {
    if (map.grid().toSizeInCells(size_m)) return;
    throw std::invalid_argument("the edges of the robot must be > 0, finite, and within the grid");
  }

  /// Centre of the robot. @param state  State of a three-dimensional ompl::base::RealVectorStateSpace: x, y, z,
  /// metres.
  [[nodiscard]] static Eigen::Vector3d centerOf(const ompl::base::State* state) {
    return Eigen::Map<const Eigen::Vector3d>(
        state->as<ompl::base::RealVectorStateSpace::StateType>()->values);
  }
  /// Whether the robot fits at a place. @param center_map  Centre of its box.
  [[nodiscard]] bool isFreeAt(const Eigen::Vector3d& center_map) const {
    return isFree(map, boxAround(center_map, size_m), policy, Budget::unlimited());
  }
};

/// Checks whether a robot fits, exactly in voxels. Threads may call it side by side.
class OmplStateValidity : public ompl::base::StateValidityChecker {
 public:
  /// @param space  Space of the states that OmplRobot::centerOf() reads.
  OmplStateValidity(const ompl::base::SpaceInformationPtr& space, const OmplRobot& robot)
      : StateValidityChecker(space), robot_(robot) {}

  /// Whether a state is inside the bounds of the space, and the robot fits there.
  [[nodiscard]] bool isValid(const ompl::base::State* state) const override {
    return si_->satisfiesBounds(state) && robot_.isFreeAt(OmplRobot::centerOf(state));
  }

 private:
  OmplRobot robot_;
};

/// Checks straight motions of a robot by its swept box: exact, without a step size that could miss obstacles.
/// Ignores the bounds of the space.
class OmplMotionValidity : public ompl::base::MotionValidator {
 public:
  /// @param space  As for OmplStateValidity.
  OmplMotionValidity(const ompl::base::SpaceInformationPtr& space, const OmplRobot& robot)
      : MotionValidator(space), robot_(robot) {}

  /// Whether the robot can move from one state to the other.
  [[nodiscard]] bool checkMotion(const ompl::base::State* from,
                                 const ompl::base::State* to) const override {
    // Most motions of a planner are blocked: checks of single places find this faster than the sweep.
    const Eigen::Vector3d start = OmplRobot::centerOf(from);
    const Eigen::Vector3d motion = OmplRobot::centerOf(to) - start;
    for (const double part : {1.0, 0.5}) {
      if (!robot_.isFreeAt(start + part * motion)) return count(false);
    }
    return count(isPathFree(robot_.map, {start, start + motion}, robot_.size_m, robot_.policy,
                            Budget::unlimited()));
  }
  /// As above. @param last_valid  Unless null, gets the last place before the obstacle of a blocked motion, and
  /// its fraction of the motion, 0 to 1.
  [[nodiscard]] bool checkMotion(const ompl::base::State* from, const ompl::base::State* to,
                                 std::pair<ompl::base::State*, double>& last_valid) const override {
    const std::vector<Eigen::Vector3d> way{OmplRobot::centerOf(from), OmplRobot::centerOf(to)};
    const auto contact =
        checkPath(robot_.map, way, robot_.size_m, robot_.policy, Budget::unlimited());
    if (contact.isNotFound()) return count(true);
    const double length_m = lengthOf(way);
    last_valid.second = length_m > 0.0 ? contact.value.distance_m / length_m : 0.0;
    if (last_valid.first != nullptr) {
      si_->getStateSpace()->interpolate(from, to, last_valid.second, last_valid.first);
    }
    return count(false);
  }

 private:
  /// Counts the result for OMPL's statistics.
  bool count(bool is_valid) const {
    ++(is_valid ? valid_ : invalid_);
    return is_valid;
  }

  OmplRobot robot_;
};

}  // namespace cuboid_mapping
