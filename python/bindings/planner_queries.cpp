// SPDX-License-Identifier: BSD-3-Clause
// cuboid_map.Map: queries for planners.
#include "arrays.h"
#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/query/fit_query.h"
#include "cuboid_mapping/query/nearest_query.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/ray_query.h"
#include "map_access.h"
#include "planner_arrays.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cuboid_map_python {
namespace {

using namespace cuboid_mapping;
using py::literals::operator""_a;

/// Writes a row of three numbers.
void put(std::vector<double>& rows, std::size_t row, const Eigen::Vector3d& point) {
  std::copy(point.data(), point.data() + 3, &rows[3 * row]);
}

/// The edges of a robot.
Eigen::Vector3d toSize(const Doubles& array) {
  Eigen::Vector3d size = toVector(array, "size");
  require(size.allFinite() && size.minCoeff() > 0.0, "size must be three edges > 0, in metres");
  return size;
}

std::uint8_t toNumber(RayEnd end) {
  // The numbers of the service cast_rays.
  return end == RayEnd::kUnknown ? 0 : (end == RayEnd::kMaxRange ? 1 : 2);
}

py::object castRays(MapAccess& access, const Doubles& origin_array, const Doubles& direction_array,
                    double max_range_m, const std::string& unknown) {
  const UnknownPolicy policy = toUnknownPolicy(unknown);
  const std::vector<Eigen::Vector3d> directions = toPoints(direction_array, "directions");
  const bool is_one_origin = origin_array.ndim() == 1 && origin_array.size() == 3;
  const std::vector<Eigen::Vector3d> origins =
      is_one_origin ? std::vector(directions.size(), toVector(origin_array, "origins"))
                    : toPoints(origin_array, "origins");
  require(origins.size() == directions.size(),
          "there are " + std::to_string(origins.size()) + " origins and " +
              std::to_string(directions.size()) +
              " directions: give one origin for each direction, or one for all");
  std::vector<std::uint8_t> end(origins.size());
  std::vector<double> distance(origins.size());
  std::vector<double> points;
  std::vector<double> first_unknown(origins.size(), kInfinity);
  std::vector<double> unknown_length(origins.size());
  access.read([&](const CuboidMap& map) {
    Budget budget = toBudget();
    for (std::size_t i = 0; i < origins.size(); ++i) {
      const auto ray = valid(castRay(map, origins[i], directions[i], max_range_m, policy, budget),
                             element("origins", i) + ", " + element("directions", i));
      end[i] = toNumber(ray->end);
      distance[i] = ray->distance_m;
      append(points, ray->point_map);
      if (ray->first_unknown_m) first_unknown[i] = *ray->first_unknown_m;
      unknown_length[i] = ray->unknown_length_m;
    }
  });
  return makeResult("Rays", toArray(std::move(end)), toArray(std::move(distance)),
                    toRows(std::move(points), 3), toArray(std::move(first_unknown)),
                    toArray(std::move(unknown_length)));
}

/// Paths of n waypoints each, from an array (m, n, 3).
std::vector<std::vector<Eigen::Vector3d>> toPaths(const Doubles& array) {
  require(array.ndim() == 3 && array.shape(2) == 3 && array.shape(1) > 0,
          "paths must have the shape (m, n, 3), with n > 0; it has " +
              py::str(array.attr("shape")).cast<std::string>());
  std::vector<std::vector<Eigen::Vector3d>> paths;
  const auto num_points = static_cast<std::size_t>(array.shape(1));
  const double* next = array.data();
  for (py::ssize_t i = 0; i < array.shape(0); ++i) {
    std::vector<Eigen::Vector3d>& path = paths.emplace_back();
    for (std::size_t k = 0; k < num_points; ++k, next += 3) path.emplace_back(next);
  }
  return paths;
}

py::object checkPaths(MapAccess& access, const Doubles& array, const Doubles& size_array,
                      const std::string& unknown) {
  const UnknownPolicy policy = toUnknownPolicy(unknown);
  const auto paths = toPaths(array);
  const Eigen::Vector3d size = toSize(size_array);
  std::vector<std::uint8_t> free(paths.size());
  std::vector<double> free_length(paths.size());
  std::vector<double> length(paths.size());
  std::vector<std::int64_t> segment(paths.size(), -1);
  std::vector<double> points;
  access.read([&](const CuboidMap& map) {
    Budget budget = toBudget();
    for (std::size_t i = 0; i < paths.size(); ++i) {
      const auto path = valid(checkPath(map, paths[i], size, policy, budget), element("paths", i));
      free[i] = static_cast<std::uint8_t>(path.isNotFound());
      length[i] = lengthOf(paths[i]);
      free_length[i] = path.isFound() ? path->distance_m : length[i];
      if (path.isFound()) segment[i] = static_cast<std::int64_t>(path->segment);
      append(points, path.isFound() ? path->point_map : kNowhere);
    }
  });
  return makeResult("Paths", toArray(std::move(free)).attr("astype")("bool"),
                    toArray(std::move(free_length)), toArray(std::move(length)),
                    toArray(std::move(segment)), toRows(std::move(points), 3));
}

py::object findNearestCuboids(MapAccess& access, const Doubles& array, std::size_t k,
                              const std::string& classes, double max_distance_m) {
  const CuboidFilter filter = toFilter(classes);
  const std::vector<Eigen::Vector3d> points = toPoints(array, "points");
  // So few that the number of rows times columns does not overflow.
  require(k > 0 && k <= 1000000000 && max_distance_m >= 0.0,
          "k must be 1 to 1e9, and max_distance >= 0");
  const std::size_t count = points.size() * k;
  std::vector<double> distance(count, kInfinity);
  std::vector<double> closest(3 * count, NAN);
  std::vector<double> boxes(6 * count, NAN);
  std::vector<std::uint8_t> occupancy(count);
  access.read([&](const CuboidMap& map) {
    Budget budget = toBudget();
    for (std::size_t i = 0; i < points.size(); ++i) {
      std::size_t at = i * k;
      const auto nearest = valid(findNearest(map, points[i], k, filter, budget, max_distance_m),
                                 element("points", i));
      for (const NearestCuboid& near : nearest.value) {
        const MetricBox box = map.grid().toMetricBox(near.cuboid.box);
        distance[at] = near.distance_m;
        put(closest, at, near.closest_point_map);
        put(boxes, 2 * at, box.min_m);
        put(boxes, 2 * at + 1, box.max_m);
        occupancy[at++] = static_cast<std::uint8_t>(near.cuboid.occupancy);
      }
    }
  });
  const auto rows = static_cast<py::ssize_t>(points.size());
  const auto columns = static_cast<py::ssize_t>(k);
  return makeResult("Nearest", toArray(std::move(distance), {rows, columns}),
                    toArray(std::move(closest), {rows, columns, 3}),
                    toArray(std::move(boxes), {rows, columns, 6}),
                    toArray(std::move(occupancy), {rows, columns}));
}

py::array_t<double> findNearestFree(MapAccess& access, const Doubles& array,
                                    const Doubles& size_array, double max_distance_m,
                                    const std::string& unknown) {
  const UnknownPolicy policy = toUnknownPolicy(unknown);
  const std::vector<Eigen::Vector3d> points = toPoints(array, "points");
  const Eigen::Vector3d size = toSize(size_array);
  require(std::isfinite(max_distance_m) && max_distance_m >= 0.0,
          "max_distance must be finite and >= 0");
  std::vector<double> places;
  access.read([&](const CuboidMap& map) {
    Budget budget = toBudget();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto place =
          complete(findNearestFit(map, points[i], size, policy, max_distance_m, budget),
                   element("points", i));
      append(places, place.isFound() ? place->center_map : kNowhere);
    }
  });
  return toRows(std::move(places), 3);
}

py::object searchCorridor(MapAccess& access, const CorridorTask& task, UnknownPolicy policy,
                          double time_limit_s) {
  Answer<Corridor> answer;
  const Corridor& corridor = answer.value;
  std::vector<double> boxes;
  access.read([&](const CuboidMap& map) {
    Budget budget = toBudget(time_limit_s);
    answer = valid(findCorridor(map, task, policy, budget), "corridor");
    for (const CellBox& box : corridor.boxes) append(boxes, map.grid().toMetricBox(box));
  });
  std::vector<double> portals;
  for (const Eigen::Vector3d& point : corridor.portals_map) append(portals, point);
  std::vector<double> path;
  for (const Eigen::Vector3d& point : corridor.path_map) append(path, point);
  return makeResult("Corridor", toCorridorEnd(answer), toRows(std::move(boxes), 6),
                    toRows(std::move(portals), 3), toRows(std::move(path), 3), corridor.length_m,
                    corridor.num_visited, corridor.start_distance_m, corridor.goal_distance_m,
                    toPointOf(access.grid(), corridor.met));
}

void bindCorridor(MapClass& map) {
  map.def(
      "find_corridor",
      [](MapAccess& access, const Doubles& start, const Doubles& goal, const Doubles& size,
         const std::string& unknown, double time_limit_s, const py::object& region,
         double inflation_m, double clearance_m, double start_tolerance_m,
         double goal_tolerance_m) {
        CorridorTask task;
        task.inflation_m = inflation_m;
        task.clearance_m = clearance_m;
        task.start_tolerance_m = start_tolerance_m;
        task.goal_tolerance_m = goal_tolerance_m;
        task.start_map = toVector(start, "start");
        task.goal_map = toVector(goal, "goal");
        task.size_m = toSize(size);
        if (!region.is_none()) {
          const Grid grid = access.read([](const CuboidMap& m) { return m.grid(); });
          task.region = toCellBox(grid, region.cast<Doubles>(), "region");
        }
        return searchCorridor(access, task, toUnknownPolicy(unknown), time_limit_s);
      },
      "start"_a, "goal"_a, "size"_a, "unknown"_a = "obstacle", "time_limit"_a = kInfinity,
      "region"_a = py::none(), "inflation"_a = 0.0, "clearance"_a = 0.0, "start_tolerance"_a = 0.0,
      "goal_tolerance"_a = 0.0,
      R"(Finds a corridor of overlapping boxes without obstacles from a start to a goal, and a path in it.

start, goal: (3,), metres: centre of the robot.
size: (3,), metres: edges of the robot, a box that does not turn; rounded up to voxels.
unknown: 'obstacle' or 'free'.
time_limit: seconds, >= 0. region: (6,), metres: the robot may not leave it; None: the map and some room
around it, with unknown "free" between the heights of start and goal.
inflation: metres, added on all sides of the robot.
clearance: metres along x and y that the path keeps from the faces of the boxes; where there is less room, it goes
through the middle.
start_tolerance: longest way out of obstacles that the robot touches at the start, metres; 0: START_BLOCKED.
goal_tolerance: largest distance from the goal at which the path may end if the robot cannot reach it, metres; inf: any.
Returns results.Corridor. A corridor is found if and only if the robot can go from voxel to voxel; it need not be the
shortest. O(bricks that the search reaches).)");
}

}  // namespace

void bindPlannerQueries(MapClass& map) {
  map.def("cast_rays", castRays, "origins"_a, "directions"_a, "max_range"_a,
          "unknown"_a = "obstacle", R"(Casts rays up to the first obstacle.

origins: (n, 3), metres, or (3,) for all rays. directions: (n, 3), of any length but zero.
max_range: length of all rays, metres.
unknown: 'obstacle': rays end at unknown space; 'free': they pass it.
Returns results.Rays: arrays with an element for each ray. O(voxels passed).)");
  map.def("check_paths", checkPaths, "paths"_a, "size"_a, "unknown"_a = "obstacle",
          R"(Finds the first obstacle that a box meets along straight segments. Exact.

paths: (m, n, 3), metres: m paths of n waypoints for the centre of the box; for one path [waypoints].
size: (3,), metres: edges of the box, which does not turn.
unknown: 'obstacle' or 'free'.
Returns results.Paths: arrays with an element for each path. O(bricks swept).)");
  map.def("nearest", findNearestCuboids, "points"_a, "k"_a = 1, "classes"_a = "occupied",
          "max_distance"_a = kInfinity, R"(Finds the k cuboids nearest to each point, nearest first.

points: (n, 3), metres. classes: 'all', 'free' or 'occupied'. max_distance: metres.
Returns results.Nearest: arrays (n, k, ...); missing cuboids have distance inf, and NaN. O((k + log n) log n) for each
point.)");
  map.def("nearest_free", findNearestFree, "points"_a, "size"_a, "max_distance"_a,
          "unknown"_a = "obstacle",
          R"(Finds the place nearest to each point at which a box meets no obstacle.

points: (n, 3), metres. size: (3,), metres: edges of the box, which does not turn.
max_distance: maximum distance of a place from its point, metres. unknown: 'obstacle' or 'free'.
Returns (n, 3), metres: centres of the box; NaN without a place.
O(bricks within the distance of the answer).)");
  bindCorridor(map);
}

}  // namespace cuboid_map_python
