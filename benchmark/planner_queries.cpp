// SPDX-License-Identifier: BSD-3-Clause
// Measures how long typical queries of planners take on a map of real scans, with one thread.
#include "command_line.h"
#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/query/cuboid_query.h"
#include "cuboid_mapping/query/fit_query.h"
#include "cuboid_mapping/query/nearest_query.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/pose_path.h"
#include "cuboid_mapping/query/ray_query.h"
#include "cuboid_mapping/query/sphere_query.h"
#include "mapped_scans.h"
#include "timing.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping::bench {
namespace {

struct Options {
  std::string dataset;
  double resolution_m = 0.2;
  double robot_m = 0.5;
  UnknownPolicy policy = UnknownPolicy::kObstacle;
  unsigned int seed = 1;
};

/// Random places, the same for the same seed.
class Places {
 public:
  Places(const MappedScans& scene, unsigned int seed)
      : scene_(scene), bounds_(scene.map.grid().toMetricBox(*scene.map.bounds())), engine_(seed) {}

  /// Anywhere in the bounds of the map.
  Eigen::Vector3d inBounds() {
    Eigen::Vector3d point;
    for (int axis = 0; axis < 3; ++axis) {
      point[axis] =
          std::uniform_real_distribution<>(bounds_.min_m[axis], bounds_.max_m[axis])(engine_);
    }
    return point;
  }
  /// Within some metres of a place where the sensor was.
  Eigen::Vector3d nearPose(double radius_m) {
    std::uniform_real_distribution<> offset(-radius_m, radius_m);
    const auto last = scene_.places_map.size() - 1;
    const auto pose = std::uniform_int_distribution<std::size_t>(0, last)(engine_);
    return scene_.places_map[pose] + Eigen::Vector3d(offset(engine_), offset(engine_), 0.0);
  }
  Eigen::Vector3d direction() {
    std::normal_distribution<> normal;
    const double x = normal(engine_);
    const double y = normal(engine_);
    return {x, y, 0.1 * normal(engine_)};
  }

 private:
  const MappedScans& scene_;
  MetricBox bounds_;
  std::mt19937 engine_;
};

/// Prints how long one run takes: least and median of several.
void time(const std::string& name, int num_runs, const std::function<double()>& run) {
  std::vector<double> times_ms;
  double answer = 0.0;
  for (int i = 0; i < num_runs; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    answer = run();
    const std::chrono::duration<double, std::milli> passed =
        std::chrono::steady_clock::now() - begin;
    times_ms.push_back(passed.count());
  }
  std::sort(times_ms.begin(), times_ms.end());
  std::printf("| %-58s | %9.3f | %9.3f | %10.2f |\n", name.c_str(), times_ms.front(),
              times_ms[times_ms.size() / 2], answer);
}

void timeBoxes(const MappedScans& scene, const Options& options) {
  Places places(scene, options.seed);
  const auto boxes = [&](bool is_near) {
    std::vector<MetricBox> asked;
    asked.reserve(1000);
    for (int i = 0; i < 1000; ++i) {
      asked.push_back(boxAround(is_near ? places.nearPose(20.0) : places.inBounds(),
                                Eigen::Vector3d::Constant(2.0)));
    }
    return asked;
  };
  for (const bool is_near : {false, true}) {
    const auto asked = boxes(is_near);
    time(std::string("1,000 boxes of 2 m, ") + (is_near ? "near the way" : "anywhere"), 20, [&] {
      double occupied = 0.0;
      for (const MetricBox& box : asked) {
        occupied +=
            queryBox(scene.map, box, Budget::unlimited())->occupancy() == Occupancy::kOccupied
                ? 1.0
                : 0.0;
      }
      return occupied;
    });
  }
}

void timeRays(const MappedScans& scene, const Options& options) {
  Places places(scene, options.seed + 1);
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> rays;
  rays.reserve(1000);
  for (int i = 0; i < 1000; ++i) rays.emplace_back(places.nearPose(5.0), places.direction());
  time("1,000 rays of 30 m", 20, [&] {
    double hits = 0.0;
    for (const auto& [origin, direction] : rays) {
      const auto ray =
          castRay(scene.map, origin, direction, 30.0, UnknownPolicy::kFree, Budget::unlimited());
      hits += ray->end == RayEnd::kOccupied ? 1.0 : 0.0;
    }
    return hits;
  });
}

void timePlaces(const MappedScans& scene, const Options& options) {
  Places places(scene, options.seed + 2);
  const Eigen::Vector3d robot_m = Eigen::Vector3d::Constant(options.robot_m);
  std::vector<Eigen::Vector3d> points;
  points.reserve(100);
  for (int i = 0; i < 100; ++i) points.push_back(places.nearPose(10.0));
  time("100 paths of 10 m, the robot swept", 20, [&] {
    double blocked = 0.0;
    for (const Eigen::Vector3d& point : points) {
      const std::vector<Eigen::Vector3d> path{point, point + Eigen::Vector3d(8.0, 6.0, 0.0)};
      blocked += checkPath(scene.map, path, robot_m, options.policy, Budget::unlimited()).isFound()
                     ? 1.0
                     : 0.0;
    }
    return blocked;
  });
  time("100 points: 5 nearest occupied cuboids", 20, [&] {
    double found = 0.0;
    for (const Eigen::Vector3d& point : points) {
      found += static_cast<double>(
          findNearest(scene.map, point, 5, CuboidFilter::kOccupied, Budget::unlimited(), 20.0)
              .value.size());
    }
    return found;
  });
  time("100 points: nearest place of the robot, 5 m at most", 5, [&] {
    double found = 0.0;
    for (const Eigen::Vector3d& point : points) {
      found += findNearestFit(scene.map, point, robot_m, options.policy, 5.0, Budget::unlimited())
                       .isFound()
                   ? 1.0
                   : 0.0;
    }
    return found;
  });
}

void timeRegion(const MappedScans& scene, const Options& options) {
  const Eigen::Vector3d middle = scene.places_map[scene.places_map.size() / 2];
  const Grid& grid = scene.map.grid();
  const auto region = grid.toCellBox(boxAround(middle, Eigen::Vector3d::Constant(10.0)));
  const Cell passage = *grid.toSizeInCells(Eigen::Vector3d::Constant(options.robot_m));
  time("cuboids of a region of 10 m", 20, [&] {
    return static_cast<double>(
        selectCuboids(scene.map, *region, {}, Budget::unlimited()).value.size());
  });
  time("free graph of a region of 10 m: portals", 20, [&] {
    return static_cast<double>(
        buildFreeGraph(scene.map, *region, passage, Budget::unlimited()).value.portals.size());
  });
}

/// Whether a ball meets an obstacle, voxel by voxel.
bool isBallBlocked(const MappedScans& scene, const Eigen::Vector3d& center_map, double radius_m,
                   UnknownPolicy policy) {
  const Grid& grid = scene.map.grid();
  const auto box = grid.toCellBox(boxAround(center_map, Eigen::Vector3d::Constant(2.0 * radius_m)));
  const Eigen::Vector3d center = grid.toCellUnits(center_map);
  Cell cell;
  for (cell.z = box->min.z; cell.z < box->max.z; ++cell.z) {
    for (cell.y = box->min.y; cell.y < box->max.y; ++cell.y) {
      for (cell.x = box->min.x; cell.x < box->max.x; ++cell.x) {
        const Eigen::Vector3d low = toVector(cell);
        const Eigen::Vector3d nearest = center.cwiseMax(low).cwiseMin((low.array() + 1.0).matrix());
        if ((center - nearest).norm() >= radius_m / grid.resolution() - 1e-6) continue;
        const Occupancy occupancy = scene.map.voxels().at(cell);
        if (occupancy == Occupancy::kOccupied) return true;
        if (occupancy == Occupancy::kUnknown && policy == UnknownPolicy::kObstacle) return true;
      }
    }
  }
  return false;
}

/// The centres of an arm's 60 spheres: along three links of 0.5 m, from a base near the way.
std::vector<Eigen::Vector3d> randomArm(Places& places) {
  constexpr int kNumSpheres = 60;
  constexpr double kStep_m = 1.5 / kNumSpheres;
  Eigen::Vector3d place = places.nearPose(3.0);
  Eigen::Vector3d step = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> centers;
  for (int i = 0; i < kNumSpheres; ++i) {
    if (i % (kNumSpheres / 3) == 0) step = kStep_m * places.direction().normalized();
    centers.push_back(place += step);
  }
  return centers;
}

/// Wall time: asking for CPU time would take as long as the work.
template <typename WorkT>
double nanosecondsOf(const WorkT& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begin).count();
}

/// Batches of 60 spheres of one radius. The first one at a place reads its bricks; a planner asks there again and again.
void timeSpheres(const MappedScans& scene, const Options& options, double radius_m) {
  constexpr int kNumArms = 1000;
  constexpr int kNumSpheres = 60;
  Places places(scene, options.seed + 3);
  SphereChecker checker(scene.map, options.policy, Budget::unlimited());
  std::vector<double> first_ns;
  std::vector<double> later_ns;
  std::size_t num_blocked = 0;
  std::size_t num_wrong = 0;
  for (int i = 0; i < kNumArms; ++i) {
    std::vector<Sphere> spheres;
    for (const Eigen::Vector3d& center : randomArm(places)) spheres.push_back({center, radius_m});
    std::vector<AnswerStatus> answers;
    const auto check = [&] {
      return nanosecondsOf([&] { answers = checker.check(spheres); }) / kNumSpheres;
    };
    first_ns.push_back(check());
    double least_ns = std::numeric_limits<double>::infinity();
    for (int run = 0; run < 5; ++run) least_ns = std::min(least_ns, check());
    later_ns.push_back(least_ns);
    for (std::size_t k = 0; k < spheres.size(); ++k) {
      const bool is_blocked = isBallBlocked(scene, spheres[k].center_map, radius_m, options.policy);
      num_blocked += is_blocked ? 1 : 0;
      num_wrong += is_blocked == (answers[k] == AnswerStatus::kNotFound) ? 1 : 0;
    }
  }
  std::printf("| %.2f | %.1f | %.1f | %zu | %zu |\n", radius_m, median(first_ns), median(later_ns),
              num_blocked, num_wrong);
}

void timeCorridor(const MappedScans& scene, const Options& options) {
  const Eigen::Vector3d robot_m = Eigen::Vector3d::Constant(options.robot_m);
  // Where the sensor was first, and where it was farthest from there.
  std::optional<Eigen::Vector3d> start;
  std::optional<Eigen::Vector3d> goal;
  for (const Eigen::Vector3d& pose : scene.places_map) {
    const auto place =
        findNearestFit(scene.map, pose, robot_m, options.policy, 2.0, Budget::unlimited());
    if (!place.isFound()) continue;
    const Eigen::Vector3d& center_map = place->center_map;
    if (!start) start = center_map;
    if (!goal || (center_map - *start).norm() > (*goal - *start).norm()) goal = center_map;
  }
  if (!start) {
    std::printf("the robot fits nowhere near the sensor\n");
    return;
  }
  Answer<Corridor> corridor;
  CorridorTask task;
  task.start_map = *start;
  task.goal_map = *goal;
  task.size_m = robot_m;
  time("corridor from the first to the farthest place: boxes", 9, [&] {
    corridor = findCorridor(scene.map, task, options.policy, Budget::unlimited());
    return static_cast<double>(corridor.value.boxes.size());
  });
  std::printf("\ncorridor: status %d, %.1f m as the crow flies, path %.1f m, %zu boxes visited\n",
              static_cast<int>(corridor.status), (*goal - *start).norm(), corridor.value.length_m,
              corridor.value.num_visited);
}

/// A base between places of the sensor some 10 m apart, in any headings in which it is free.
void timePosePaths(const MappedScans& scene, const Options& options) {
  std::mt19937 engine(options.seed + 4);
  const auto pick_pose = [&] {
    const auto place =
        std::uniform_int_distribution<std::size_t>(0, scene.places_map.size() - 1)(engine);
    const double yaw = std::uniform_real_distribution<>(-M_PI, M_PI)(engine);
    return Eigen::Isometry3d(Eigen::Translation3d(scene.places_map[place]) *
                             Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  };
  PosePathTask task;
  task.body.boxes.push_back({Eigen::Isometry3d::Identity(), {1.0, 0.6, 0.3}});
  std::printf(
      "\nways for a base of 1.0 x 0.6 x 0.3 m that turns\n\n"
      "| status | as the crow flies [m] | path [m] | poses of it | poses looked at | time [ms] |\n"
      "|---|---|---|---|---|---|\n");
  for (int tries = 0, num_left = 20; tries < 10000 && num_left > 0; ++tries) {
    task.start_map = pick_pose();
    task.goal_map = pick_pose();
    const double distance_m = (task.goal_map.translation() - task.start_map.translation()).norm();
    if (distance_m < 9.0 || distance_m > 11.0 || !findFault(task, scene.map.grid()).empty())
      continue;
    const auto begin = std::chrono::steady_clock::now();
    const auto answer = findPosePath(scene.map, task, options.policy, Budget::unlimited());
    const PosePath& path = answer.value;
    const std::chrono::duration<double, std::milli> passed =
        std::chrono::steady_clock::now() - begin;
    if (answer.isNotFound() && path.blocked != Blocked::kBetween) continue;
    --num_left;
    std::printf("| %d | %.1f | %.1f | %zu | %zu | %.1f |\n", static_cast<int>(answer.status),
                distance_m, path.length_m, path.T_map_body.size(), path.num_poses, passed.count());
  }
}

void measure(const Options& options) {
  const MappedScans scene = mapScans(options.dataset, options.resolution_m);
  std::printf("%s at %.2f m: %zu clouds, %zu cuboids, robot %.2f m\n\n", options.dataset.c_str(),
              options.resolution_m, scene.places_map.size(), countCuboids(scene.map).total(),
              options.robot_m);
  std::printf("| what | least [ms] | median [ms] | answer |\n|---|---|---|---|\n");
  timeBoxes(scene, options);
  timeRays(scene, options);
  timePlaces(scene, options);
  timeRegion(scene, options);
  timeCorridor(scene, options);
  timePosePaths(scene, options);
  std::printf(
      "\n1,000 batches of 60 spheres, medians\n\n"
      "| radius [m] | first batch at a place [ns a sphere] | later [ns a sphere] | spheres blocked "
      "| "
      "wrong |\n"
      "|---|---|---|---|---|\n");
  for (const double radius_m : {0.05, 0.1, 0.15, 0.2, 0.3}) timeSpheres(scene, options, radius_m);
}

int run(int argc, char** argv) {
  Options options;
  bool unknown_passes = false;
  CommandLine line("planner_queries",
                   "Measures how long typical queries of planners take on a map of real scans, "
                   "with one thread.");
  line.addArgument("dataset", options.dataset, "folder of scans, or .graph file");
  line.addNumber("resolution", options.resolution_m, "edge of a voxel [m]", {0.001, 100.0});
  line.addNumber("robot", options.robot_m, "edge of the robot's box [m]", {0.001, 100.0});
  line.addFlag("unknown-passes", unknown_passes, "the robot may drive through unknown space");
  line.addNumber("seed", options.seed, "seed of the random places");
  if (const auto status = line.parse(argc, argv)) return *status;
  if (unknown_passes) options.policy = UnknownPolicy::kFree;
  measure(options);
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("planner_queries", argc, argv, cuboid_mapping::bench::run);
}
