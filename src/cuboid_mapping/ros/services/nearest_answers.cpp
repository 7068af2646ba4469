// SPDX-License-Identifier: BSD-3-Clause
// Answers about the nearest cuboids and places.
#include "cuboid_mapping/ros/services/answers.h"

#include "cuboid_mapping/query/fit_query.h"
#include "cuboid_mapping/query/nearest_query.h"
#include "cuboid_mapping/query/path_query.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cuboid_mapping_ros {
namespace {

constexpr Entries kNearestPoints{"points", 133};
constexpr Entries kPlacePoints{"points", 33};

}  // namespace

void answer(ServiceCall& call, const FindNearest::Request& request,
            FindNearest::Response& response) {
  const auto filter = ServiceCall::classes(request.classes);
  const auto points = call.points(request.points, kNearestPoints);
  const double inflation_m = ServiceCall::notNegative(request.inflation, "inflation");
  double max_m = ServiceCall::notNegative(request.max_distance, "max_distance");
  max_m = max_m == 0.0 ? std::numeric_limits<double>::infinity() : max_m + inflation_m;
  if (request.k == 0) throw Refusal("k is 0: ask for at least one cuboid");
  const Eigen::Vector3d reach_m = Eigen::Vector3d::Constant(2.0 * max_m);
  for (const Eigen::Vector3d& point : points) {
    const auto box = std::isfinite(max_m) ? call.map().grid().toCellBox(boxAround(point, reach_m))
                                          : std::nullopt;
    call.requireLoaded(box.value_or(kAllCells));
  }
  const auto answer_point = [&](const CuboidMap& map, std::size_t i, Budget& budget) {
    const auto nearest = findNearest(map, points[i], request.k, filter, max_m, budget);
    if (budget.isSpent()) return;
    response.counts.push_back(static_cast<std::uint32_t>(nearest.size()));
    for (const NearestCuboid& near : nearest) {
      response.distance.push_back(std::max(0.0, near.distance_m - inflation_m));
      response.closest.push_back(toPoint(near.closest_point_map));
      response.direction.push_back(toVector3(near.direction_map));
      response.cuboids.push_back(cuboidMessage(map, near.cuboid, Budget::unlimited()));
    }
  };
  call.readEach(kNearestPoints, points.size(), answer_point);
}

void answer(ServiceCall& call, const FindNearestFree::Request& request,
            FindNearestFree::Response& response) {
  const auto points = call.points(request.points, kPlacePoints);
  const Eigen::Vector3d size_m = call.size(request.size, request.inflation);
  const auto policy = ServiceCall::policy(request.unknown);
  const double max_m = ServiceCall::positive(request.max_distance, "max_distance");
  for (const Eigen::Vector3d& point : points) {
    call.requireCells(boxAround(point, size_m.array() + 2.0 * max_m));
    response.place.push_back(toPoint(point));
  }
  response.found.assign(points.size(), static_cast<std::uint8_t>(false));
  response.distance.assign(points.size(), std::numeric_limits<double>::infinity());
  const auto answer_point = [&](const CuboidMap& map, std::size_t i, Budget& budget) {
    const auto place = findNearestFit(map, points[i], size_m, policy, max_m, budget);
    if (!place) return;
    response.found[i] = static_cast<std::uint8_t>(true);
    response.place[i] = toPoint(*place);
    response.distance[i] = (*place - points[i]).norm();
  };
  call.readEach(kPlacePoints, points.size(), answer_point);
}

}  // namespace cuboid_mapping_ros
