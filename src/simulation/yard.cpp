// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/site_parts.h"

namespace cuboid_mapping::site {
namespace {

constexpr double kWest_m = 18.2;
constexpr double kEast_m = 34.0;
constexpr double kSouth_m = -3.0;
constexpr double kNorth_m = 15.0;

/// Adds posts every two metres or less, and two rails with gaps that beams pass through.
/// @param axis  0: along x, 1: along y.
void addFence(Solids& solids, int axis, double across_m, double from_m, double to_m) {
  const int posts = static_cast<int>((to_m - from_m) / 2.0) + 2;
  for (int i = 0; i < posts; ++i) {
    Eigen::Vector2d place;
    place[axis] = from_m + (to_m - from_m) * i / (posts - 1);
    place[1 - axis] = across_m;
    solids.push_back({SolidKind::kFence, Cylinder{place, 0.06, 0.0, 1.3}});
  }
  for (const double bottom : {0.4, 0.9}) {
    Eigen::Vector3d min_m(0.0, 0.0, bottom);
    Eigen::Vector3d max_m(0.0, 0.0, bottom + 0.2);
    min_m[axis] = from_m;
    max_m[axis] = to_m;
    min_m[1 - axis] = across_m - 0.02;
    max_m[1 - axis] = across_m + 0.02;
    addBox(solids, SolidKind::kFence, min_m, max_m);
  }
}

void addTree(Solids& solids, const Eigen::Vector2d& place_m) {
  solids.push_back({SolidKind::kTree, Cylinder{place_m, 0.2, 0.0, 2.2}});
  solids.push_back({SolidKind::kTree, Cylinder{place_m, 1.3, 2.2, 3.4}});
  solids.push_back({SolidKind::kTree, Cylinder{place_m, 0.8, 3.4, 4.4}});
}

void addTurnedBox(Solids& solids, SolidKind kind, const RotatedBox& box) {
  solids.push_back({kind, box});
}

void addCar(Solids& solids, Random& random) {
  const Eigen::Vector3d center(random.uniform(22.5, 26.0), 13.4, 0.0);
  const double yaw = random.uniform(-0.1, 0.1);
  addTurnedBox(solids, SolidKind::kCar,
               {center + Eigen::Vector3d(0, 0, 0.6), {2.1, 0.9, 0.4}, yaw});
  addTurnedBox(solids, SolidKind::kCar,
               {center + Eigen::Vector3d(0, 0, 1.25), {1.1, 0.8, 0.25}, yaw});
}

/// Adds three crates, the third on the first.
void addCrates(Solids& solids, Random& random) {
  // One after the other: the order in which arguments are evaluated differs between processors.
  const double y = random.uniform(-1.5, -0.5);
  const Eigen::Vector3d corner(random.uniform(31.0, 32.0), y, 0.0);
  const Eigen::Vector3d places[] = {{0.0, 0.0, 0.4}, {1.1, 0.3, 0.4}, {0.0, 0.0, 1.1}};
  const double half_sizes[] = {0.4, 0.4, 0.3};
  for (int i = 0; i < 3; ++i) {
    addTurnedBox(
        solids, SolidKind::kCrate,
        {corner + places[i], Eigen::Vector3d::Constant(half_sizes[i]), random.uniform(-0.4, 0.4)});
  }
}

}  // namespace

void addYard(Solids& solids, Random& random) {
  addFence(solids, 0, kSouth_m, kWest_m, kEast_m);
  addFence(solids, 0, kNorth_m, kWest_m, kEast_m);
  addFence(solids, 1, kEast_m, kSouth_m, kNorth_m);
  addTree(solids, {26.5, 6.2});
  addTree(solids, {random.uniform(20.5, 22.0), random.uniform(-1.5, -0.5)});
  addCar(solids, random);
  addCrates(solids, random);
}

}  // namespace cuboid_mapping::site
