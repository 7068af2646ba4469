// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/world.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace cuboid_mapping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::uint64_t kNumSeeds = 30;

bool haveSameBounds(const Solid& a, const Solid& b) {
  const MetricBox box_a = computeBounds(a.shape);
  const MetricBox box_b = computeBounds(b.shape);
  return a.kind == b.kind && box_a.min_m == box_b.min_m && box_a.max_m == box_b.max_m;
}

Solid findSolid(const std::vector<Solid>& solids, SolidKind kind) {
  for (const Solid& solid : solids) {
    if (solid.kind == kind) return solid;
  }
  ADD_FAILURE() << "no such solid";
  return {};
}

Vector2d walkerAt(const World& world, double time_s) {
  const Solid walker = findSolid(world.computeSolids(time_s), SolidKind::kWalker);
  return std::get<Cylinder>(walker.shape).axis_m;
}

double rangeThrough(const std::vector<Solid>& solids, const Beam& beam) {
  double range = std::numeric_limits<double>::infinity();
  for (const Solid& solid : solids) range = std::min(range, computeRange(solid.shape, beam));
  return range;
}

TEST(World, isTheSameForTheSameSeed) {
  const World first(5);
  const World second(5);
  const std::vector<Solid> solids_first = first.computeSolids(12.3);
  const std::vector<Solid> solids_second = second.computeSolids(12.3);
  ASSERT_EQ(solids_first.size(), solids_second.size());
  for (std::size_t i = 0; i < solids_first.size(); ++i) {
    EXPECT_TRUE(haveSameBounds(solids_first[i], solids_second[i])) << i;
  }
}

TEST(World, variesWithTheSeedButForTheBuilding) {
  const World first(5);
  const World second(6);
  ASSERT_EQ(first.fixedSolids().size(), second.fixedSolids().size());
  std::map<SolidKind, int> differing;
  for (std::size_t i = 0; i < first.fixedSolids().size(); ++i) {
    const Solid& solid = first.fixedSolids()[i];
    if (!haveSameBounds(solid, second.fixedSolids()[i])) ++differing[solid.kind];
  }
  EXPECT_GT(differing[SolidKind::kFurniture], 30);
  EXPECT_GT(differing[SolidKind::kCar], 0);
  EXPECT_GT(differing[SolidKind::kCrate], 0);
  EXPECT_EQ(differing[SolidKind::kWall], 0);
  EXPECT_EQ(differing[SolidKind::kStairs], 0);
  EXPECT_GT((walkerAt(first, 0.0) - walkerAt(second, 0.0)).norm(), 0.01);
}

TEST(World, hasEverythingInIt) {
  std::map<SolidKind, int> count;
  for (const Solid& solid : World(1).computeSolids(0.0)) ++count[solid.kind];
  EXPECT_EQ(count.size(), 12U);
  EXPECT_GE(count[SolidKind::kWall], 20);
  EXPECT_GE(count[SolidKind::kStairs], 5);
  EXPECT_EQ(count[SolidKind::kDoor], 1);
  EXPECT_EQ(count[SolidKind::kWalker], 1);
}

TEST(World, furnitureStandsInTheBuildingAndOnTheGround) {
  for (std::uint64_t seed = 0; seed < kNumSeeds; ++seed) {
    const World world(seed);
    double lowest = 1.0;
    for (const Solid& solid : world.fixedSolids()) {
      if (solid.kind != SolidKind::kFurniture) continue;
      const MetricBox bounds = computeBounds(solid.shape);
      EXPECT_TRUE((bounds.min_m.array() >= Eigen::Array3d(0.1, 0.1, 0.03)).all()) << seed;
      EXPECT_TRUE((bounds.max_m.array() <= Eigen::Array3d(17.95, 11.95, 2.8)).all()) << seed;
      lowest = std::min(lowest, bounds.min_m.z());
    }
    EXPECT_DOUBLE_EQ(lowest, 0.03);
  }
}

TEST(World, hasARoofOverTheBuildingOnly) {
  const World world(1);
  const Vector3d up = Vector3d::UnitZ();
  EXPECT_NEAR(rangeThrough(world.fixedSolids(), Beam({8.0, 6.0, 1.0}, up)), 1.83, 1e-9);
  EXPECT_TRUE(std::isinf(rangeThrough(world.fixedSolids(), Beam({30.0, 2.0, 1.0}, up))));
}

TEST(Door, opensAndClosesAgain) {
  const World world(1);
  // A beam from the corridor through the middle of the doorway; the door's face is at y = 5.055.
  const Beam beam({15.03, 6.0, 1.0}, {0, -1, 0});
  const double closed = 6.0 - 5.055;
  EXPECT_NEAR(rangeThrough(world.computeSolids(0.0), beam), closed, 1e-9);
  EXPECT_GT(rangeThrough(world.computeSolids(10.0), beam), 2.0);
  EXPECT_NEAR(rangeThrough(world.computeSolids(20.0), beam), closed, 1e-9);
  EXPECT_GT(rangeThrough(world.computeSolids(40.0), beam), 2.0);
}

TEST(Door, staysOpenOrClosed) {
  const Beam beam({15.03, 6.0, 1.0}, {0, -1, 0});
  for (const double time_s : {0.0, 10.0, 20.0}) {
    EXPECT_GT(rangeThrough(World(1, DoorMotion::kOpen).computeSolids(time_s), beam), 2.0);
    EXPECT_LT(rangeThrough(World(1, DoorMotion::kClosed).computeSolids(time_s), beam), 1.0);
  }
}

TEST(Door, isHalfWayOpenInBetween) {
  const World world(1);
  const Solid door = findSolid(world.computeSolids(3.75), SolidKind::kDoor);
  EXPECT_NEAR(std::get<RotatedBox>(door.shape).yaw_rad, -M_PI / 4, 1e-9);
}

TEST(Door, meetsNoFurniture) {
  for (std::uint64_t seed = 0; seed < kNumSeeds; ++seed) {
    const World world(seed);
    for (double time = 2.5; time < 18.0; time += 0.1) {
      const auto door =
          std::get<RotatedBox>(findSolid(world.computeSolids(time), SolidKind::kDoor).shape);
      for (const double along : {-0.5, -0.25, 0.0, 0.25, 0.5}) {
        const Vector3d middle =
            door.center_m + along * Vector3d(std::cos(door.yaw_rad), std::sin(door.yaw_rad), 0.0);
        for (const Solid& solid : world.fixedSolids()) {
          if (solid.kind != SolidKind::kFurniture) continue;
          for (double height = 0.1; height < 2.1; height += 0.2) {
            const Vector3d point(middle.x(), middle.y(), height);
            ASSERT_GT(computeSignedDistance(solid.shape, point), 0.03) << seed << ' ' << time;
          }
        }
      }
    }
  }
}

TEST(Walker, walksOnAndMeetsNothing) {
  for (std::uint64_t seed = 0; seed < kNumSeeds; ++seed) {
    const World world(seed);
    for (double time = 0.0; time < 30.0; time += 0.25) {
      const Vector2d here = walkerAt(world, time);
      const double step = (walkerAt(world, time + 0.25) - here).norm();
      ASSERT_GT(step, 0.25);
      ASSERT_LE(step, 0.3 + 1e-9);
      for (const Solid& solid : world.fixedSolids()) {
        ASSERT_GT(computeSignedDistance(solid.shape, {here.x(), here.y(), 1.0}), 0.25);
      }
    }
  }
}

TEST(RobotPath, takesAboutAMinute) {
  const double lap = World(1).lapDuration();
  EXPECT_GT(lap, 60.0);
  EXPECT_LT(lap, 90.0);
}

TEST(RobotPath, leadsThroughRoomsCorridorAndYard) {
  const ClosedPath path = World(1).robotPath();
  const MetricBox places[] = {{{0.1, 0.1, 0}, {5.9, 4.9, 0}},       // room A
                              {{6.1, 0.1, 0}, {11.9, 4.9, 0}},      // room B
                              {{0.1, 5.1, 0}, {17.9, 6.9, 0}},      // corridor
                              {{0.1, 7.1, 0}, {9.9, 11.9, 0}},      // hall
                              {{10.1, 7.1, 0}, {17.9, 11.9, 0}},    // stairs
                              {{18.1, -3.0, 0}, {34.0, 15.0, 0}}};  // yard
  for (const MetricBox& place : places) {
    double way_inside = 0.0;
    for (double way = 0.0; way < path.length(); way += 0.1) {
      const Vector2d position = path.computePlace(way).position_m;
      if (computeSignedDistance(place, {position.x(), position.y(), 0.0}) <= 0.0 &&
          (position.array() > place.min_m.head<2>().array()).all() &&
          (position.array() < place.max_m.head<2>().array()).all()) {
        way_inside += 0.1;
      }
    }
    EXPECT_GT(way_inside, 2.0) << place.min_m.transpose();
  }
}

/// Least distance from the robot's axis to a solid, over its height.
double computeClearance(const Solid& solid, const Eigen::Isometry3d& T_map_base) {
  double clearance = std::numeric_limits<double>::infinity();
  for (double height = 0.05; height <= World::kRobotHeight_m; height += 0.05) {
    const Vector3d point = T_map_base * Vector3d(0.0, 0.0, height);
    clearance = std::min(clearance, computeSignedDistance(solid.shape, point));
  }
  return clearance;
}

TEST(RobotPath, doesNotRunThroughSolids) {
  for (std::uint64_t seed = 0; seed < kNumSeeds; ++seed) {
    const World world(seed);
    for (double time = 0.0; time < world.lapDuration(); time += 0.1) {
      const Eigen::Isometry3d T_map_base = world.computeRobotPose(time);
      for (const Solid& solid : world.fixedSolids()) {
        if (solid.kind == SolidKind::kGround) continue;
        ASSERT_GT(computeClearance(solid, T_map_base), World::kRobotRadius_m)
            << "seed " << seed << ", time " << time << ", kind " << static_cast<int>(solid.kind);
      }
    }
  }
}

TEST(RobotPath, meetsNeitherDoorNorWalkerInTenLaps) {
  for (std::uint64_t seed = 0; seed < kNumSeeds; ++seed) {
    const World world(seed);
    for (double time = 0.0; time < 10 * world.lapDuration(); time += 0.25) {
      const std::vector<Solid> solids = world.computeSolids(time);
      for (const SolidKind kind : {SolidKind::kDoor, SolidKind::kWalker}) {
        ASSERT_GT(computeClearance(findSolid(solids, kind), world.computeRobotPose(time)),
                  World::kRobotRadius_m)
            << "seed " << seed << ", time " << time;
      }
    }
  }
}

TEST(RobotPose, standsOnTheGroundAndLooksAhead) {
  const World world(1);
  for (double time = 0.0; time < world.lapDuration(); time += 0.7) {
    const Eigen::Isometry3d T_map_base = world.computeRobotPose(time);
    EXPECT_DOUBLE_EQ(T_map_base.translation().z(), 0.03);
    EXPECT_TRUE((T_map_base.linear() * Vector3d::UnitZ()).isApprox(Vector3d::UnitZ()));
    const Vector3d step = world.computeRobotPose(time + 0.01).translation() -
                          world.computeRobotPose(time - 0.01 + world.lapDuration()).translation();
    EXPECT_NEAR(step.norm(), 0.02 * World::kRobotSpeed, 1e-4);
    EXPECT_GT(step.normalized().dot(T_map_base.linear().col(0)), 0.999);
  }
}

}  // namespace
}  // namespace cuboid_mapping
