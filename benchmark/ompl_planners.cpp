// SPDX-License-Identifier: BSD-3-Clause
// Plans with OMPL's RRT-Connect on a map of real scans: against the map, and against an fcl::OcTree with the same voxels.
#include "command_line.h"
#include "cuboid_mapping/interop/ompl.h"
#include "cuboid_mapping/query/fit_query.h"
#include "mapped_scans.h"
#include "timing.h"

#include <fcl/geometry/octree/octree.h>
#include <fcl/narrowphase/collision.h>
#include <ompl/base/DiscreteMotionValidator.h>
#include <ompl/geometric/SimpleSetup.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <memory>
#include <numeric>
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
  double range_m = 0.0;  ///< Longest motion; 0: OMPL chooses it.
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
      return findNearestFit(scene.map, place, kRobot_m, UnknownPolicy::kFree, 1.0,
                            Budget::unlimited());
    };
    const auto start = fit(places[any(engine)]);
    const auto goal = fit(places[any(engine)]);
    if (!start.isFound() || !goal.isFound()) continue;
    const Eigen::Vector3d& start_map = start->center_map;
    const Eigen::Vector3d& goal_map = goal->center_map;
    if ((start_map - goal_map).norm() > 5.0) scene.tasks.emplace_back(start_map, goal_map);
  }
  return scene;
}

/// The robot in an octree of the occupied voxels.
class OctreeValidity : public ob::StateValidityChecker {
 public:
  using Octree = std::shared_ptr<fcl::OcTreed>;

  OctreeValidity(const ob::SpaceInformationPtr& space, const Octree& octree)
      : StateValidityChecker(space),
        octree_(octree, fcl::Transform3d::Identity()),
        box_(std::make_shared<fcl::Boxd>(kRobot_m - Eigen::Vector3d::Constant(1e-6))) {}

  static Octree makeOctree(const CuboidMap& map) {
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

  bool isValid(const ob::State* state) const override {
    if (!si_->satisfiesBounds(state)) return false;
    fcl::CollisionObjectd robot(box_, Eigen::Matrix3d::Identity(), OmplRobot::centerOf(state));
    fcl::CollisionResultd result;
    return fcl::collide(&octree_, &robot, fcl::CollisionRequestd(), result) == 0;
  }

 private:
  fcl::CollisionObjectd octree_;
  std::shared_ptr<fcl::Boxd> box_;
};

/// Answers to a planner's questions about motions, in their order.
struct Answers {
  std::vector<bool> are_free;
  std::size_t num_given = 0;
  bool is_replay = false;

  [[nodiscard]] bool isOver() const { return is_replay && num_given == are_free.size(); }
};

/// Records the answers of another validator, or gives them again at no cost: OMPL's own time is left.
class RecordedMotions : public ob::MotionValidator {
 public:
  RecordedMotions(const ob::SpaceInformationPtr& space, ob::MotionValidatorPtr motions,
                  Answers& answers)
      : MotionValidator(space), motions_(std::move(motions)), answers_(answers) {}

  bool checkMotion(const ob::State* from, const ob::State* to) const override {
    if (answers_.is_replay) return !answers_.isOver() && answers_.are_free[answers_.num_given++];
    answers_.are_free.push_back(motions_->checkMotion(from, to));
    return answers_.are_free.back();
  }
  bool checkMotion(const ob::State* from, const ob::State* to,
                   std::pair<ob::State*, double>& /*last_valid*/) const override {
    return checkMotion(from, to);
  }

 private:
  ob::MotionValidatorPtr motions_;
  Answers& answers_;
};

/// Plans of all tasks.
struct Plans {
  std::vector<double> times_s;  ///< One for each task.
  double length_m = 0.0;
  int num_solved = 0;
  int num_that_touch = 0;  ///< Paths.
};

std::shared_ptr<ob::RealVectorStateSpace> makeSpace(const CuboidMap& map) {
  auto space = std::make_shared<ob::RealVectorStateSpace>(3);
  const MetricBox all = map.grid().toMetricBox(*map.bounds());
  ob::RealVectorBounds bounds(3);
  for (unsigned int axis = 0; axis < 3; ++axis) {
    bounds.setLow(axis, all.min_m[axis]);
    bounds.setHigh(axis, all.max_m[axis]);
  }
  space->setBounds(bounds);
  return space;
}

/// Plans one task. @param prepare  (og::SimpleSetup&): sets the validity of states, and of motions.
/// @param is_over  Ends it, as the time does.
template <typename PrepareT>
void plan(const Scene& scene, const Task& task, const PrepareT& prepare, double range_m,
          const ob::PlannerTerminationCondition& is_over, Plans& plans) {
  const auto space = makeSpace(scene.map);
  og::SimpleSetup setup(space);
  prepare(setup);
  const auto planner = std::make_shared<og::RRTConnect>(setup.getSpaceInformation());
  planner->setRange(range_m);
  setup.setPlanner(planner);
  ob::ScopedState<> from(space);
  ob::ScopedState<> to(space);
  for (unsigned int axis = 0; axis < 3; ++axis) {
    from[axis] = task.first[axis];
    to[axis] = task.second[axis];
  }
  setup.setStartAndGoalStates(from, to);
  setup.setup();
  bool is_solved = false;
  plans.times_s.push_back(
      timeOf([&] { is_solved = setup.solve(is_over) == ob::PlannerStatus::EXACT_SOLUTION; }).cpu_s);
  if (!is_solved) return;
  ++plans.num_solved;
  plans.length_m += setup.getSolutionPath().length();
  std::vector<Eigen::Vector3d> path;
  for (const ob::State* state : setup.getSolutionPath().getStates()) {
    path.push_back(OmplRobot::centerOf(state));
  }
  const auto swept =
      checkPath(scene.map, path, kRobot_m, UnknownPolicy::kFree, Budget::unlimited());
  plans.num_that_touch += swept.isNotFound() ? 0 : 1;
}

/// A way to check states and motions, and its plans.
struct Validity {
  const char* name;
  /// Sets the validity of states. @return That of motions.
  std::function<ob::MotionValidatorPtr(og::SimpleSetup&)> make_motions;
  Plans plans;
  Plans replayed;  ///< With the same answers at no cost.
};

/// @param seed  The same for all validities, so that they are asked the same at first.
void planTwice(const Scene& scene, const Task& task, const Options& options, unsigned int seed,
               Validity& validity) {
  Answers answers;
  const auto prepare = [&](og::SimpleSetup& setup) {
    const auto& space = setup.getSpaceInformation();
    auto motions = validity.make_motions(setup);
    space->setMotionValidator(
        std::make_shared<RecordedMotions>(space, std::move(motions), answers));
  };
  for (Plans* plans : {&validity.plans, &validity.replayed}) {
    ompl::RNG::setSeed(seed);
    answers.is_replay = plans == &validity.replayed;
    plan(scene, task, prepare, options.range_m,
         ob::plannerOrTerminationCondition(
             ob::timedPlannerTerminationCondition(options.time_s),
             ob::PlannerTerminationCondition([&] { return answers.isOver(); })),
         *plans);
  }
}

/// fcl::OcTree with a state each so many metres.
Validity makeOctreeValidity(const char* name, const OctreeValidity::Octree& octree, double step_m) {
  return {name,
          [=](og::SimpleSetup& setup) {
            const auto& space = setup.getSpaceInformation();
            setup.setStateValidityChecker(std::make_shared<OctreeValidity>(space, octree));
            space->setStateValidityCheckingResolution(step_m / space->getMaximumExtent());
            return std::make_shared<ob::DiscreteMotionValidator>(space);
          },
          {},
          {}};
}

std::vector<Validity> makeValidities(const Scene& scene, double resolution_m) {
  const auto make_exact = [&](og::SimpleSetup& setup) {
    const OmplRobot robot{scene.map, kRobot_m, UnknownPolicy::kFree};
    const auto& space = setup.getSpaceInformation();
    setup.setStateValidityChecker(std::make_shared<OmplStateValidity>(space, robot));
    return std::make_shared<OmplMotionValidity>(space, robot);
  };
  const OctreeValidity::Octree octree = OctreeValidity::makeOctree(scene.map);
  return {{"this map: exact motions", make_exact, {}, {}},
          makeOctreeValidity("fcl::OcTree: 1 state a voxel", octree, resolution_m),
          makeOctreeValidity("fcl::OcTree: 4 states a voxel", octree, resolution_m / 4.0),
          makeOctreeValidity("fcl::OcTree: 10 states a voxel", octree, resolution_m / 10.0)};
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) /
         std::max<double>(1.0, static_cast<double>(values.size()));
}

void measure(const Options& options) {
  ompl::msg::setLogLevel(ompl::msg::LOG_NONE);  // It does not like that seeds are set anew.
  const Scene scene = makeScene(options);
  std::vector<Validity> validities = makeValidities(scene, options.resolution_m);
  unsigned int seed = options.seed;
  for (const Task& task : scene.tasks) {
    ++seed;
    for (Validity& validity : validities) planTwice(scene, task, options, seed, validity);
  }
  std::printf(
      "%s at %.2f m, robot 0.6 x 0.6 x 0.3 m, unknown space passes, RRT-Connect, range %.1f m, "
      "%.1f s "
      "at most; CPU times, the same answers at no cost in brackets\n\n"
      "| validity | median plan [ms] | times ours, median of the plans | mean [ms] | solved | "
      "mean length [m] | that touch an obstacle |\n"
      "|---|---|---|---|---|---|---|\n",
      options.dataset.c_str(), options.resolution_m, options.range_m, options.time_s);
  const std::vector<double>& ours_s = validities[0].plans.times_s;
  for (const auto& [name, make_motions, plans, replayed] : validities) {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < ours_s.size(); ++i) {
      ratios.push_back(plans.times_s[i] / std::max(1e-6, ours_s[i]));
    }
    std::printf("| %s | %.2f (%.2f) | %.1f | %.1f (%.1f) | %d of %zu | %.1f | %d |\n", name,
                1e3 * median(plans.times_s), 1e3 * median(replayed.times_s), median(ratios),
                1e3 * mean(plans.times_s), 1e3 * mean(replayed.times_s), plans.num_solved,
                scene.tasks.size(), plans.length_m / std::max(1, plans.num_solved),
                plans.num_that_touch);
  }
}

int run(int argc, char** argv) {
  Options options;
  CommandLine line("ompl_planners",
                   "Plans with OMPL on a map of real scans: against the map, and against an "
                   "fcl::OcTree with the same voxels.");
  line.addArgument("dataset", options.dataset, "folder of scans, or .graph file");
  line.addNumber("resolution", options.resolution_m, "edge of a voxel [m]", {0.001, 100.0});
  line.addNumber("plans", options.num_plans, "plans to make", {1, 1e6});
  line.addNumber("time", options.time_s, "largest time of a plan [s]", {0.001, 1e6});
  line.addNumber("range", options.range_m, "longest motion [m]; 0: OMPL chooses it", {0.0, 1e6});
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
