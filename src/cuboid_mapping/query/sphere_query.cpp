// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/sphere_query.h"

#include "cuboid_mapping/query/near_obstacles.h"
#include "cuboid_mapping/query/pose_query.h"

namespace cuboid_mapping {

struct SphereChecker::Kept {
  ObstacleCache cache;
  NearObstacles near{cache};
};

SphereChecker::SphereChecker(const CuboidMap& map, UnknownPolicy policy, Budget& budget)
    : map_(&map),
      policy_(policy),
      budget_(&budget),
      revision_(map.revision()),
      kept_(new Kept{{map, policy, budget}}) {}

SphereChecker::SphereChecker(SphereChecker&& other) noexcept = default;
SphereChecker& SphereChecker::operator=(SphereChecker&& other) noexcept = default;
SphereChecker::~SphereChecker() = default;

std::vector<AnswerStatus> SphereChecker::check(const std::vector<Sphere>& spheres) {
  if (revision_ != map_->revision()) *this = SphereChecker(*map_, policy_, *budget_);
  const Grid& grid = map_->grid();
  const double max_radius = Body::kMaxReach;
  const double range = Grid::kMaxCell - 1;
  std::vector<AnswerStatus> answers(spheres.size(), AnswerStatus::kInvalid);
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    const Eigen::Vector3d center = grid.toCellUnits(spheres[i].center_map);
    const double radius = spheres[i].radius_m * grid.inverseResolution();
    const bool is_size = radius >= Body::kMinSize && radius <= max_radius;
    if (!is_size || !(center.array().abs() <= range - radius).all()) continue;
    const bool is_met = !budget_->isSpent() && kept_->near.findMet(Ball(center, radius)) != nullptr;
    answers[i] = is_met               ? AnswerStatus::kFound
                 : budget_->isSpent() ? AnswerStatus::kBudgetSpent
                                      : AnswerStatus::kNotFound;
  }
  return answers;
}

}  // namespace cuboid_mapping
