// SPDX-License-Identifier: BSD-3-Clause
// OMPL's RRT-Connect plans a path for a box-shaped robot in a room of 4 x 2 x 1 m with a wall across it.
#include <cuboid_mapping/interop/ompl.h>

#include <ompl/geometric/SimpleSetup.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>

#include <iostream>
#include <memory>

using namespace cuboid_mapping;
namespace ob = ompl::base;
namespace og = ompl::geometric;

int main() {
  MapConfig config;
  config.resolution_m = 0.1;
  CuboidMap map(config);
  map.replace(kAllCells, {UniformBox{{{0, 0, 0}, {40, 20, 10}}, -1.0F},
                          UniformBox{{{20, 0, 0}, {21, 12, 10}}, 1.0F}});

  auto space = std::make_shared<ob::RealVectorStateSpace>(3);
  ob::RealVectorBounds bounds(3);
  for (unsigned int axis = 0; axis < 3; ++axis) {
    const MetricBox all = map.grid().toMetricBox(*map.bounds());
    bounds.setLow(axis, all.min_m[axis]);
    bounds.setHigh(axis, all.max_m[axis]);
  }
  space->setBounds(bounds);

  const OmplRobot robot{map, {0.5, 0.5, 0.5}, UnknownPolicy::kObstacle};
  og::SimpleSetup setup(space);
  const ob::SpaceInformationPtr& information = setup.getSpaceInformation();
  setup.setStateValidityChecker(std::make_shared<OmplStateValidity>(information, robot));
  information->setMotionValidator(std::make_shared<OmplMotionValidity>(information, robot));
  setup.setPlanner(std::make_shared<og::RRTConnect>(information));

  ob::ScopedState<ob::RealVectorStateSpace> start(space);
  ob::ScopedState<ob::RealVectorStateSpace> goal(space);
  start[0] = start[1] = start[2] = 0.5;
  goal[0] = 3.5;
  goal[1] = goal[2] = 0.5;
  setup.setStartAndGoalStates(start, goal);
  if (setup.solve(1.0) != ob::PlannerStatus::EXACT_SOLUTION) return 1;
  setup.simplifySolution();
  std::cout << "around the wall: " << setup.getSolutionPath().length() << " m\n";
}
