// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/interop/fcl_obstacles.h"

#include "cuboid_mapping/query/cuboid_query.h"

#include <fcl/geometry/shape/box.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <algorithm>
#include <limits>

namespace cuboid_mapping {

FclObstacles::FclObstacles(const CuboidMap& map, const CellBox& region) {
  CuboidSelection selection;
  selection.filter = CuboidFilter::kOccupied;
  std::vector<fcl::CollisionObjectd*> objects;
  const auto occupied = selectCuboids(map, region, selection, Budget::unlimited());
  for (const Cuboid& cuboid : occupied.value) {
    const MetricBox box = map.grid().toMetricBox(cuboid.box);
    fcl::Transform3d pose = fcl::Transform3d::Identity();
    pose.translation() = map.grid().centerOf(cuboid.box);
    const auto shape = std::make_shared<fcl::Boxd>(fcl::Vector3d(box.max_m - box.min_m));
    objects_.push_back(std::make_unique<fcl::CollisionObjectd>(shape, pose));
    objects.push_back(objects_.back().get());
  }
  manager_.registerObjects(objects);
  manager_.setup();
}

bool FclObstacles::collides(fcl::CollisionObjectd& object) {
  bool is_met = false;
  manager_.collide(&object, &is_met,
                   [](fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data) {
                     fcl::CollisionResultd result;
                     fcl::collide(a, b, fcl::CollisionRequestd(), result);
                     bool& is_any = *static_cast<bool*>(data);
                     is_any = is_any || result.isCollision();
                     return is_any;  // The search ends with the first.
                   });
  return is_met;
}

double FclObstacles::computeDistance_m(fcl::CollisionObjectd& object) {
  double least_m = std::numeric_limits<double>::infinity();
  manager_.distance(
      &object, &least_m,
      [](fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data, double& distance_m) {
        fcl::DistanceResultd result;
        double& least = *static_cast<double*>(data);
        least =
            std::min(least, std::max(0.0, fcl::distance(a, b, fcl::DistanceRequestd(), result)));
        distance_m = least;
        return least <= 0.0;
      });
  return least_m;
}

}  // namespace cuboid_mapping
