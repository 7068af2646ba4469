// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/pose_lattice.h"

#include <array>

namespace cuboid_mapping {
namespace {

int toHeading(int number) {
  constexpr int kNum = PoseLattice::kNumHeadings;
  return (number % kNum + kNum) % kNum;
}

/// The one or two integers less than 1 away from a value.
std::vector<std::int32_t> wholesAround(double value) {
  constexpr double kSame = 1e-6;
  const double nearest = std::round(value);
  if (std::abs(value - nearest) < kSame) return {static_cast<std::int32_t>(nearest)};
  const auto below = static_cast<std::int32_t>(std::floor(value));
  return {below, below + 1};
}

}  // namespace

double headingOf(const Eigen::Isometry3d& pose) {
  return std::atan2(pose.linear()(1, 0), pose.linear()(0, 0));
}

Eigen::Isometry3d PoseLattice::pose(const LatticePose& at) const {
  Eigen::Isometry3d pose(Eigen::Translation3d(position(at.place)));
  pose.linear() =
      Eigen::AngleAxisd(kTurn * at.heading, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

void PoseLattice::findNeighbors(const LatticePose& at, std::vector<LatticePose>& neighbors) const {
  constexpr std::array<Cell, 10> kSteps{{{1, 0, 0},
                                         {-1, 0, 0},
                                         {0, 1, 0},
                                         {0, -1, 0},
                                         {1, 1, 0},
                                         {1, -1, 0},
                                         {-1, 1, 0},
                                         {-1, -1, 0},
                                         {0, 0, 1},
                                         {0, 0, -1}}};
  neighbors.clear();
  for (const Cell& step : kSteps) {
    if (step.z != 0 && !has_planes_) continue;
    neighbors.push_back({at.place + step, at.heading});
  }
  for (const int turn : {1, -1}) neighbors.push_back({at.place, toHeading(at.heading + turn)});
}

std::vector<LatticePose> PoseLattice::findAround(const Eigen::Isometry3d& pose) const {
  const Eigen::Vector3d position = pose.translation();
  const double plane = has_planes_ ? (position.z() - height_m_) / edge_m_ : 0.0;
  std::vector<LatticePose> around;
  for (const std::int32_t x : wholesAround(position.x() / edge_m_ - 0.5)) {
    for (const std::int32_t y : wholesAround(position.y() / edge_m_ - 0.5)) {
      for (const std::int32_t z : wholesAround(plane)) {
        for (const std::int32_t heading : wholesAround(headingOf(pose) / kTurn)) {
          around.push_back({{x, y, z}, toHeading(heading)});
        }
      }
    }
  }
  return around;
}

}  // namespace cuboid_mapping
