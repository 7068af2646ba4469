// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/interop/ompl.h"

#include "support/random_bricks.h"

#include <gtest/gtest.h>
#include <ompl/geometric/SimpleSetup.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>

#include <memory>

namespace cuboid_mapping {
namespace {

namespace ob = ompl::base;
using test::Random;

/// A free room of 4 x 2 x 1 m at 0.1 m with a wall that leaves 0.8 m.
CuboidMap makeRoom() {
  MapConfig config;
  config.resolution_m = 0.1;
  CuboidMap map(config);
  map.replace(kAllCells, {UniformBox{{{0, 0, 0}, {40, 20, 10}}, -1.0F},
                          UniformBox{{{20, 0, 0}, {21, 12, 10}}, 1.0F}});
  return map;
}

class Ompl : public testing::Test {
 protected:
  Ompl() : map_(makeRoom()), space_(std::make_shared<ob::RealVectorStateSpace>(3)) {
    ob::RealVectorBounds bounds(3);
    bounds.setLow(0.0);
    bounds.setHigh(4.0);
    space_->setBounds(bounds);
    setup_ = std::make_unique<ompl::geometric::SimpleSetup>(space_);
    const auto& information = setup_->getSpaceInformation();
    setup_->setStateValidityChecker(std::make_shared<OmplStateValidity>(information, robot_));
    information->setMotionValidator(std::make_shared<OmplMotionValidity>(information, robot_));
  }
  ob::ScopedState<> state(const Eigen::Vector3d& at) const {
    ob::ScopedState<> state(space_);
    for (unsigned int axis = 0; axis < 3; ++axis) state[axis] = at[axis];
    return state;
  }

  CuboidMap map_;
  OmplRobot robot_{map_, {0.5, 0.5, 0.5}, UnknownPolicy::kObstacle};
  std::shared_ptr<ob::RealVectorStateSpace> space_;
  std::unique_ptr<ompl::geometric::SimpleSetup> setup_;
};

TEST_F(Ompl, IsToldOfEveryStateAndMotionWhatTheMapSays) {
  Random random(3960);
  const auto& information = setup_->getSpaceInformation();
  int num_free = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto random_point = [&] {
      return Eigen::Vector3d(random.real(-0.5, 4.5), random.real(0.0, 2.0), random.real(0.2, 0.8));
    };
    const Eigen::Vector3d from = random_point();
    const Eigen::Vector3d to = random_point();
    const bool is_inside = from.x() >= 0.0 && from.x() <= 4.0;
    EXPECT_EQ(information->isValid(state(from).get()),
              is_inside &&
                  isFree(map_, boxAround(from, robot_.size_m), robot_.policy, Budget::unlimited()));
    const auto swept =
        checkPath(map_, {from, to}, robot_.size_m, robot_.policy, Budget::unlimited());
    const auto& motion = information->getMotionValidator();
    EXPECT_EQ(motion->checkMotion(state(from).get(), state(to).get()), swept.isNotFound());
    auto last = state({0, 0, 0});
    std::pair<ob::State*, double> last_valid{last.get(), -1.0};
    EXPECT_EQ(motion->checkMotion(state(from).get(), state(to).get(), last_valid),
              swept.isNotFound());
    num_free += swept.isNotFound() ? 1 : 0;
    if (swept.isNotFound()) continue;
    EXPECT_NEAR(last_valid.second * (to - from).norm(), swept->distance_m, 1e-9);
    EXPECT_LT((OmplRobot::centerOf(last.get()) - swept->point_map).norm(), 1e-9);
  }
  EXPECT_GT(num_free, 100);
  EXPECT_EQ(setup_->getSpaceInformation()->getMotionValidator()->getCheckedMotionCount(), 4000U);
}

TEST_F(Ompl, RefusesARobotWithoutASize) {
  for (const double wrong : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(OmplRobot(map_, {0.5, wrong, 0.5}, UnknownPolicy::kFree), std::invalid_argument);
  }
}

TEST_F(Ompl, FindsAWayAroundAWall) {
  setup_->setPlanner(std::make_shared<ompl::geometric::RRTConnect>(setup_->getSpaceInformation()));
  setup_->setStartAndGoalStates(state({0.5, 0.5, 0.5}), state({3.5, 0.5, 0.5}));
  ASSERT_EQ(setup_->solve(20.0), ob::PlannerStatus::EXACT_SOLUTION);
  std::vector<Eigen::Vector3d> path;
  for (const ob::State* each : setup_->getSolutionPath().getStates()) {
    path.push_back(OmplRobot::centerOf(each));
  }
  EXPECT_TRUE(
      checkPath(map_, path, robot_.size_m, robot_.policy, Budget::unlimited()).isNotFound());
}

}  // namespace
}  // namespace cuboid_mapping
