// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/pose_clearance.h"
#include "cuboid_mapping/query/pose_lattice.h"
#include "cuboid_mapping/query/pose_path.h"

#include <cstdint>
#include <queue>
#include <unordered_map>
#include <vector>

namespace cuboid_mapping {

/// A* over a PoseLattice from start to goal. Checks each motion only when the search is about to use it.
class PoseSearch {
 public:
  /// @param task  Must outlive this object. @param clearance  That of the task, with its body and budget; as long.
  /// @pre findFault(task) is empty.
  PoseSearch(const CuboidMap& map, const PosePathTask& task, UnknownPolicy policy,
             const CellBox& region, PoseClearance& clearance);

  /// The body at the start touches obstacles: it leaves them first. @param core  Probe of a smaller body, which moves
  /// out without a contact.
  void leaveStart(BodyProbe& core) { core_ = &core; }
  /// Moves the goal to the nearest place of the lattice where the body fits with the same heading, if its distance is
  /// within the tolerance. @return Whether there is one.
  bool moveGoal();

  /// Runs the search. @pre Start and goal are free, or the functions above were called.
  AnswerStatus run();
  /// Whether the search has reached any pose from the start.
  [[nodiscard]] bool hasLeft() const;
  /// Ends the way at the reached pose that is nearest to the task's goal. @pre run() has found no way.
  /// @return Whether there is one within the tolerance.
  bool endNear();
  /// The poses of the way. @pre run() or endNear() has found one.
  [[nodiscard]] std::vector<Eigen::Isometry3d> toWay() const;
  /// Cost of a motion in metres; a turn counts as the path of the point that moves most.
  [[nodiscard]] double cost(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to) const;
  /// Number of poses of the enclosing box that were looked up.
  [[nodiscard]] std::size_t numPoses() const { return space_.numPoses(); }

 private:
  using Number = std::uint32_t;
  static constexpr Number kStart = 0;
  static constexpr Number kGoal = 1;

  enum class Fit : unsigned char { kNotKnown, kFits, kBlocked };
  /// A pose of the search.
  struct Node {
    LatticePose at;  ///< Not set for start and goal.
    double cost;     ///< Cost of the best way that is known to be free.
    Number parent = kStart;
    Fit fit = Fit::kNotKnown;
    bool is_closed = false;
    signed char level = -1;  ///< See PoseClearance; -1: not known.
  };
  struct Item {
    double estimate;
    double cost;
    Number node;
    Number parent;
    bool operator<(const Item& other) const { return estimate > other.estimate; }
  };

  Number numberOf(const LatticePose& at);
  [[nodiscard]] Eigen::Isometry3d pose(Number number) const;
  [[nodiscard]] double costPerMetre(Number number);
  [[nodiscard]] bool isWide(const Cell& place);
  void reachExits();
  [[nodiscard]] double farthest(const Eigen::Vector3d& center) const;
  void findPlacesAround(const Eigen::Vector3d& center, double radius_m,
                        std::vector<Cell>& places) const;
  [[nodiscard]] double estimate(const Eigen::Isometry3d& from) const;
  void reach(Number node, Number from, double step_cost);
  void expand(Number node);
  [[nodiscard]] bool isStepFree(Number from, Number to);
  [[nodiscard]] bool isOpen(const Cell& place);
  [[nodiscard]] bool isOpen(Number from, Number to);

  const PosePathTask& task_;
  CellBox known_;  ///< Voxels of the region that can be free.
  PoseClearance& clearance_;
  BodyProbe& body_;
  Body space_body_;
  BodyProbe space_;
  BodyProbe wide_space_;  ///< With the clearance.
  BodyProbe* core_ = nullptr;
  Eigen::Isometry3d goal_map_;
  Number last_ = kGoal;
  PoseLattice lattice_;
  double turn_cost_m_;  ///< Cost of a radian.
  std::vector<Node> nodes_;
  /// Numbers of nodes by place; z has plane and heading.
  std::unordered_map<Cell, Number, CellHash> numbers_;
  /// Whether every heading and step fits there.
  std::unordered_map<Cell, bool, CellHash> open_places_;
  /// Whether every heading has all of the clearance there.
  std::unordered_map<Cell, bool, CellHash> wide_places_;
  std::vector<LatticePose> before_goal_;
  std::vector<LatticePose> neighbors_;
  std::priority_queue<Item> open_;
};

}  // namespace cuboid_mapping
