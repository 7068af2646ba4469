// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/motion_query.h"

#include "cuboid_mapping/query/body_motion.h"

#include <algorithm>
#include <cmath>

namespace cuboid_mapping {
namespace {

/// Sway of the first pieces of a motion, in voxels: the space within this distance of a body is mostly free.
constexpr double kFirstSway = 4.0;

/// Finds the first contact of a motion by repeated halving.
class MotionHalving {
 public:
  MotionHalving(BodyProbe& probe, const BodyMotion& motion)
      : probe_(probe),
        motion_(motion),
        sway_(0.5 * motion.travel(reachOf(probe.body())) * probe.grid().inverseResolution()) {}

  std::optional<FirstContact> run() {
    const double num_pieces = std::max(1.0, std::ceil(sway_ / kFirstSway));
    for (double i = 0.0; i < num_pieces && !probe_.budget().isSpent(); ++i) {
      if (const auto first = find(i / num_pieces, (i + 1.0) / num_pieces)) return first;
    }
    return std::nullopt;
  }

 private:
  std::optional<FirstContact> find(double from, double to) {
    if (!probe_.budget().spendAndUnlock()) return std::nullopt;
    const double middle = 0.5 * (from + to);
    const double half = 0.5 * (to - from);
    const Eigen::Isometry3d T_map_body = motion_.at(middle);
    const auto met = probe_.findContact(T_map_body, motion_.swayAround(T_map_body, half));
    if (!met) return std::nullopt;
    if (sway_ * (to - from) <= kMotionTolerance) return FirstContact{from, *met};
    const auto first = find(from, middle);
    return first ? first : find(middle, to);
  }

  BodyProbe& probe_;
  const BodyMotion& motion_;
  double sway_;  ///< Sway of the whole motion, in voxels.
};

}  // namespace

BodyMotion::BodyMotion(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to)
    : from_(from), shift_map_(to.translation() - from.translation()) {
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(from.linear().transpose() * to.linear()));
  axis_body_ = turn.axis();
  angle_ = turn.angle();
}

bool BodyMotion::isHalfTurn() const {
  constexpr double kSame = 1e-6;
  return angle_ > M_PI - kSame;
}

Eigen::Isometry3d BodyMotion::at(double part) const {
  Eigen::Isometry3d pose = from_;
  pose.translation() += part * shift_map_;
  pose.linear() = from_.linear() * Eigen::AngleAxisd(part * angle_, axis_body_).toRotationMatrix();
  return pose;
}

Sway BodyMotion::swayAround(const Eigen::Isometry3d& T_map_body, double half) const {
  return {half * (T_map_body.linear().transpose() * shift_map_), half * angle_ * axis_body_};
}

std::optional<FirstContact> findFirst(BodyProbe& probe, const BodyMotion& motion) {
  return MotionHalving(probe, motion).run();
}

bool isFree(BodyProbe& probe, const BodyMotion& motion) {
  return !motion.isHalfTurn() && !findFirst(probe, motion) && !probe.budget().isSpent();
}

std::string findFault(const Body& body, const std::vector<Eigen::Isometry3d>& T_map_body,
                      const Grid& grid, const std::string& name) {
  std::string fault = findFault(body, grid);
  if (!fault.empty()) return fault;
  if (T_map_body.empty()) return "there are no " + name + ": give at least one";
  const auto name_of = [&](std::size_t i) { return name + '[' + std::to_string(i) + ']'; };
  const double range_m = rangeOf(body, grid);
  for (std::size_t i = 0; i < T_map_body.size(); ++i) {
    if (!isPose(T_map_body[i], range_m)) {
      return name_of(i) +
             " must be finite and within the range of the grid, with a quaternion of length 1";
    }
    if (i != 0 && BodyMotion(T_map_body[i - 1], T_map_body[i]).isHalfTurn()) {
      return name_of(i - 1) + " to " + name_of(i) +
             " is half a turn, which could go either way: give a pose in between";
    }
  }
  return {};
}

Answer<MotionContact> checkMotion(const CuboidMap& map, const Body& body,
                                  const std::vector<Eigen::Isometry3d>& T_map_body,
                                  UnknownPolicy policy, Budget& budget) {
  std::string fault = findFault(body, T_map_body, map.grid());
  if (!fault.empty()) return Answer<MotionContact>::invalid(std::move(fault));
  BodyProbe probe(map, body, policy, budget);
  double length_m = 0.0;
  const std::size_t num_segments = std::max<std::size_t>(1, T_map_body.size() - 1);
  for (std::size_t i = 0; i < num_segments; ++i) {
    const BodyMotion motion(T_map_body[i], T_map_body[std::min(i + 1, T_map_body.size() - 1)]);
    const auto first = findFirst(probe, motion);
    if (budget.isSpent()) return AnswerStatus::kBudgetSpent;
    if (first) {
      return MotionContact{i, length_m + first->part * motion.length(), motion.at(first->part),
                           first->contact};
    }
    length_m += motion.length();
  }
  return AnswerStatus::kNotFound;
}

double lengthOf(const std::vector<Eigen::Isometry3d>& T_map_body) {
  double length_m = 0.0;
  for (std::size_t i = 1; i < T_map_body.size(); ++i) {
    length_m += (T_map_body[i].translation() - T_map_body[i - 1].translation()).norm();
  }
  return length_m;
}

}  // namespace cuboid_mapping
