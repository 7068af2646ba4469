// SPDX-License-Identifier: BSD-3-Clause
// Plans with OMPL's RRT-Connect on a map of real scans: against the map, and against an fcl::OcTree with the same voxels.
#include "command_line.h"
#include "cuboid_mapping/interop/ompl.h"
#include "cuboid_mapping/query/fit_query.h"
#include "mapped_scans.h"

#include <fcl/geometry/octree/octree.h>
#include <fcl/narrowphase/collision.h>
#include <ompl/geometric/SimpleSetup.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping::bench {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;

struct Options {
  std::string dataset;
  double resolution_m = 0.05;
  int num_plans = 50;
  double time_s = 5.0;
  unsigned int seed = 1;
};

const Eigen::Vector3d kRobot_m(0.6, 0.6, 0.3);

/// A plan to make: places where the robot fits.
using Task = std::pair<Eigen::Vector3d, Eigen::Vector3d>;

struct Scene {
  CuboidMap map;
  std::vector<Task> tasks;
};

Scene makeScene(const Options& options) {
  MappedScans mapped = mapScans(options.dataset, options.resolution_m);
  Scene scene{std::move(mapped.map), {}};
  const std::vector<Eigen::Vector3d>& places = mapped.places_map;
  std::mt19937 engine(options.seed);
  std::uniform_int_distribution<std::size_t> any(0, places.size() - 1);
  for (int tries = 0; tries < 100 * options.num_plans; ++tries) {
    if (static_cast<int>(scene.tasks.size()) == options.num_plans) break;
    const auto fit = [&](const Eigen::Vector3d& place) {
      return findNearestFit(scene.map, place, kRobot_m, UnknownPolicy::kPass, 1.0);
    };
    const auto start = fit(places[any(engine)]);
    const auto goal = fit(places[any(engine)]);
    if (start && goal && (*start - *goal).norm() > 5.0) scene.tasks.emplace_back(*start, *goal);
  }
  return scene;
}

/// The robot in an octree of the occupied voxels.
class OctreeValidity : public ob::StateValidityChecker {
 public:
  OctreeValidity(const ob::SpaceInformationPtr& space, const CuboidMap& map)
      : StateValidityChecker(space),
        octree_(makeOctree(map), fcl::Transform3d::Identity()),
        box_(std::make_shared<fcl::Boxd>(kRobot_m - Eigen::Vector3d::Constant(1e-6))) {}

  bool isValid(const ob::State* state) const override {
    if (!si_->satisfiesBounds(state)) return false;
    fcl::CollisionObjectd robot(box_, Eigen::Matrix3d::Identity(), OmplRobot::centerOf(state));
    fcl::CollisionResultd result;
    return fcl::collide(&octree_, &robot, fcl::CollisionRequestd(), result) == 0;
  }

 private:
  static std::shared_ptr<fcl::OcTreed> makeOctree(const CuboidMap& map) {
    auto tree = std::make_shared<octomap::OcTree>(map.grid().resolution());
    map.voxels().forEach([&](const VoxelBrick& brick) {
      forEachCell(brick.brick, brick.voxels.occupied(), [&](const Cell& cell) {
        const Eigen::Vector3d at = map.grid().centerOf(CellBox::ofCell(cell));
        tree->setNodeValue(at.x(), at.y(), at.z(), 3.5F, true);
      });
    });
    tree->updateInnerOccupancy();
    tree->prune();
    return std::make_shared<fcl::OcTreed>(tree);
  }
  fcl::CollisionObjectd octree_;
  std::shared_ptr<fcl::Boxd> box_;
};

/// @param prepare  (og::SimpleSetup&): sets the validity of states, and of motions.
template <typename PrepareT>
void plan(const char* name, const Scene& scene, const Options& options, const PrepareT& prepare) {
  auto space = std::make_shared<ob::RealVectorStateSpace>(3);
  const MetricBox all = scene.map.grid().toMetricBox(*scene.map.bounds());
  ob::RealVectorBounds bounds(3);
  for (unsigned int axis = 0; axis < 3; ++axis) {
    bounds.setLow(axis, all.min_m[axis]);
    bounds.setHigh(axis, all.max_m[axis]);
  }
  space->setBounds(bounds);
  og::SimpleSetup setup(space);
  prepare(setup);
  setup.setPlanner(std::make_shared<og::RRTConnect>(setup.getSpaceInformation()));
  double passed_s = 0.0;
  double length_m = 0.0;
  int num_solved = 0;
  int num_wrong = 0;
  for (const auto& [start, goal] : scene.tasks) {
    ob::ScopedState<> from(space);
    ob::ScopedState<> to(space);
    for (unsigned int axis = 0; axis < 3; ++axis) {
      from[axis] = start[axis];
      to[axis] = goal[axis];
    }
    setup.clear();
    setup.setStartAndGoalStates(from, to);
    const std::clock_t begin = std::clock();
    const bool is_solved = setup.solve(options.time_s) == ob::PlannerStatus::EXACT_SOLUTION;
    passed_s += static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    if (!is_solved) continue;
    ++num_solved;
    length_m += setup.getSolutionPath().length();
    std::vector<Eigen::Vector3d> path;
    for (const ob::State* state : setup.getSolutionPath().getStates()) {
      path.push_back(OmplRobot::centerOf(state));
    }
    const auto swept = checkPath(scene.map, path, kRobot_m, UnknownPolicy::kPass);
    num_wrong += swept.isFree() ? 0 : 1;
  }
  std::printf("| %s | %.2f | %d of %zu | %.1f | %d |\n", name,
              static_cast<double>(scene.tasks.size()) / passed_s, num_solved, scene.tasks.size(),
              length_m / std::max(1, num_solved), num_wrong);
}

void measure(const Options& options) {
  ompl::msg::setLogLevel(ompl::msg::LOG_ERROR);
  ompl::RNG::setSeed(options.seed);
  const Scene scene = makeScene(options);
  std::printf(
      "%s at %.2f m, robot 0.6 x 0.6 x 0.3 m, unknown space passes, RRT-Connect, %.1f s at most\n\n"
      "| validity | plans a CPU second | solved | mean length [m] | that touch an obstacle |\n"
      "|---|---|---|---|---|\n",
      options.dataset.c_str(), options.resolution_m, options.time_s);
  plan("this map: exact motions", scene, options, [&](og::SimpleSetup& setup) {
    const OmplRobot robot{scene.map, kRobot_m, UnknownPolicy::kPass};
    const auto& information = setup.getSpaceInformation();
    setup.setStateValidityChecker(std::make_shared<OmplStateValidity>(information, robot));
    information->setMotionValidator(std::make_shared<OmplMotionValidity>(information, robot));
  });
  plan("fcl::OcTree: a state each voxel", scene, options, [&](og::SimpleSetup& setup) {
    const auto& information = setup.getSpaceInformation();
    setup.setStateValidityChecker(std::make_shared<OctreeValidity>(information, scene.map));
    information->setStateValidityCheckingResolution(options.resolution_m /
                                                    information->getMaximumExtent());
  });
}

int run(int argc, char** argv) {
  Options options;
  CommandLine line("ompl_planners",
                   "Plans with OMPL on a map of real scans: against the map, and against an "
                   "fcl::OcTree with the same voxels.");
  line.addArgument("dataset", options.dataset, "folder of scans, or .graph file");
  line.addNumber("resolution", options.resolution_m, "edge of a voxel [m]", {0.001, 100.0});
  line.addNumber("plans", options.num_plans, "plans to make", {1, 1e6});
  line.addNumber("time", options.time_s, "of each plan at most [s]", {0.001, 1e6});
  line.addNumber("seed", options.seed, "seed of places and planners");
  if (const auto status = line.parse(argc, argv)) return *status;
  measure(options);
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("ompl_planners", argc, argv, cuboid_mapping::bench::run);
}
