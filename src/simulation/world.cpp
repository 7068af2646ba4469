// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/world.h"

#include "simulation/site_parts.h"

#include <algorithm>
#include <cmath>

namespace cuboid_mapping {
namespace {

/// Origin of the site frame in the map frame; see World.
const Eigen::Vector3d kSiteOrigin_m = Eigen::Vector3d::Constant(0.03);

ClosedPath makePath(std::vector<Eigen::Vector2d> corners_site, double corner_radius_m) {
  for (Eigen::Vector2d& corner : corners_site) corner += kSiteOrigin_m.head<2>();
  return {corners_site, corner_radius_m};
}

/// Path from the corridor to the yard, back through stairs and hall, rooms A and B, to the corridor.
ClosedPath makeRobotPath() {
  return makePath({{9.0, 6.0},
                   {21.0, 6.0},
                   {23.5, 2.0},
                   {29.0, 2.0},
                   {31.0, 6.5},
                   {27.5, 11.5},
                   {22.0, 9.5},
                   {3.5, 9.5},
                   {3.5, 2.5},
                   {9.0, 2.5}},
                  1.0);
}

/// Path around the tree that the robot drives round.
ClosedPath makeWalkerPath() {
  return makePath({{25.0, 4.5}, {28.0, 4.5}, {28.0, 8.0}, {25.0, 8.0}}, 0.5);
}

/// Opening of the door, from 0 to 1: it opens from second 3 of every 30 on, and closes from
/// second 16 on; each takes 1.5 s.
double computeDoorOpening(double time_s) {
  const double in_period = std::fmod(time_s, 30.0);
  const double ramp = std::min((in_period - 3.0) / 1.5, (17.5 - in_period) / 1.5);
  return std::clamp(ramp, 0.0, 1.0);
}

double computeDoorOpening(DoorMotion motion, double time_s) {
  switch (motion) {
    case DoorMotion::kOpen: return 1.0;
    case DoorMotion::kClosed: return 0.0;
    case DoorMotion::kMoves: break;
  }
  return computeDoorOpening(time_s);
}

/// @param opening  How far it is open, from 0 to 1.
Solid makeDoor(double opening) {
  constexpr double kThickness_m = 0.05;
  const double yaw = -M_PI / 2 * opening;
  const Eigen::Vector3d half_size(site::kDoorWidth_m / 2, kThickness_m / 2,
                                  site::kDoorHeight_m / 2);
  const Eigen::Vector3d hinge(site::kHingeX_m, site::kHingeY_m, 0.0);
  const Eigen::Vector3d from_hinge(half_size.x() * std::cos(yaw), half_size.x() * std::sin(yaw),
                                   half_size.z());
  return {SolidKind::kDoor, RotatedBox{kSiteOrigin_m + hinge + from_hinge, half_size, yaw}};
}

Solid makeWalker(const Eigen::Vector2d& position_m) {
  const double ground = kSiteOrigin_m.z();
  return {SolidKind::kWalker, Cylinder{position_m, 0.25, ground, ground + 1.75}};
}

}  // namespace

World::World(std::uint64_t seed, DoorMotion door)
    : robot_path_(makeRobotPath()), walker_path_(makeWalkerPath()), door_(door) {
  site::Random random(seed);
  site::addGround(fixed_);
  site::addBuilding(fixed_);
  site::addFurniture(fixed_, random);
  site::addYard(fixed_, random);
  for (Solid& solid : fixed_) solid.shape = computeMoved(solid.shape, kSiteOrigin_m);
  walker_start_m_ = random.uniform(0.0, walker_path_.length());
}

std::vector<Solid> World::computeSolids(double time_s) const {
  constexpr double kWalkerSpeed = 1.2;  // metres per second
  std::vector<Solid> solids = fixed_;
  solids.push_back(makeDoor(computeDoorOpening(door_, time_s)));
  const double way = walker_start_m_ + time_s * kWalkerSpeed;
  solids.push_back(makeWalker(walker_path_.computePlace(way).position_m));
  return solids;
}

Eigen::Isometry3d World::computeRobotPose(double time_s) const {
  const ClosedPath::Place place = robot_path_.computePlace(time_s * kRobotSpeed);
  return Eigen::Translation3d(place.position_m.x(), place.position_m.y(), kSiteOrigin_m.z()) *
         Eigen::AngleAxisd(place.heading_rad, Eigen::Vector3d::UnitZ());
}

float computeReflectivity(SolidKind kind) {
  switch (kind) {
    case SolidKind::kGround: return 0.25F;
    case SolidKind::kWall: return 0.7F;
    case SolidKind::kCeiling: return 0.8F;
    case SolidKind::kStairs: return 0.5F;
    case SolidKind::kPillar: return 0.6F;
    case SolidKind::kFurniture: return 0.45F;
    case SolidKind::kFence: return 0.35F;
    case SolidKind::kTree: return 0.3F;
    case SolidKind::kCar: return 0.9F;
    case SolidKind::kCrate: return 0.4F;
    case SolidKind::kDoor: return 0.55F;
    case SolidKind::kWalker: return 0.2F;
  }
  return 0.0F;
}

}  // namespace cuboid_mapping
