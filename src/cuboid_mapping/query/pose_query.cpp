// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/pose_query.h"

#include "cuboid_mapping/query/body_probe.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace cuboid_mapping {
namespace {

/// Greatest distance of a point of a part from the origin of its body.
///@{
double reachOf(const BodySphere& sphere) { return sphere.center_body.norm() + sphere.radius_m; }
double reachOf(const BodyBox& box) {
  return box.T_body_box.translation().norm() + 0.5 * box.size_m.norm();
}
///@}

/// Reason why a part is invalid, from its size and its reach; empty if it is valid.
std::string findFault(double size_m, double reach_m, const Grid& grid) {
  const double min_m = Body::kMinSize * grid.resolution();
  const double max_m = Body::kMaxReach * grid.resolution();
  if (size_m >= min_m && reach_m <= max_m) return {};
  std::ostringstream text;
  if (!std::isfinite(reach_m) || !(size_m >= min_m)) {
    text << "radii and edges must be numbers of at least " << min_m << " m, and places finite";
  } else {
    text << "it reaches " << reach_m << " m from the origin of the body: at most " << max_m
         << " m (4096 voxels); give the body in metres, or in parts";
  }
  return text.str();
}

}  // namespace

double reachOf(const Body& body) {
  double reach_m = 0.0;
  for (const BodySphere& sphere : body.spheres) reach_m = std::max(reach_m, reachOf(sphere));
  for (const BodyBox& box : body.boxes) reach_m = std::max(reach_m, reachOf(box));
  return reach_m;
}

std::string findFault(const Body& body, const Grid& grid) {
  if (body.spheres.empty() && body.boxes.empty()) {
    return "the body has no part: give it a sphere or a box";
  }
  const auto name = [](const char* parts, const auto& all, const auto& part) {
    return std::string(parts) + '[' + std::to_string(&part - all.data()) + "]: ";
  };
  for (const BodySphere& sphere : body.spheres) {
    const std::string fault = findFault(sphere.radius_m, reachOf(sphere), grid);
    if (!fault.empty()) return name("spheres", body.spheres, sphere) + fault;
  }
  for (const BodyBox& box : body.boxes) {
    std::string fault = findFault(box.size_m.minCoeff(), reachOf(box), grid);
    if (fault.empty() && !isPose(box.T_body_box, reachOf(box))) {
      fault = "its orientation is no rotation: normalize the quaternion";
    }
    if (!fault.empty()) return name("boxes", body.boxes, box) + fault;
  }
  return {};
}

std::vector<Answer<PoseContact>> checkPoses(const CuboidMap& map, const Body& body,
                                            const std::vector<Eigen::Isometry3d>& T_map_body,
                                            UnknownPolicy policy, Budget& budget) {
  using ContactAnswer = Answer<PoseContact>;
  const Grid& grid = map.grid();
  std::string fault = findFault(body, grid);
  if (!fault.empty()) return {T_map_body.size(), ContactAnswer::invalid(std::move(fault))};
  const double range_m = rangeOf(body, grid);
  BodyProbe probe(map, body, policy, budget);
  const auto check = [&](const Eigen::Isometry3d& pose) -> ContactAnswer {
    if (!isPose(pose, range_m)) {
      return ContactAnswer::invalid(
          "the pose must be finite, a rotation, and within the range of the grid");
    }
    if (budget.isSpent()) return AnswerStatus::kBudgetSpent;
    if (const auto contact = probe.findContact(pose)) return *contact;
    return budget.isSpent() ? AnswerStatus::kBudgetSpent : AnswerStatus::kNotFound;
  };
  std::vector<ContactAnswer> answers;
  answers.reserve(T_map_body.size());
  for (const Eigen::Isometry3d& pose : T_map_body) answers.push_back(check(pose));
  return answers;
}

}  // namespace cuboid_mapping
