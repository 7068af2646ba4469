// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/site_parts.h"

namespace cuboid_mapping::site {
namespace {

/// A hole in a wall.
struct Opening {
  double from_m;  ///< Start along the wall.
  double to_m;
  double sill_m;  ///< Lower edge; 0 for a doorway.
  double top_m;
};

/// A wall around the line from `from_m` to `to_m`, along x or y.
struct Wall {
  int axis;         ///< 0: along x, 1: along y.
  double across_m;  ///< Coordinate of its middle on the other axis.
  double from_m;
  double to_m;
  std::vector<Opening> openings;  ///< In order, apart from each other.
};

Opening doorway(double from_m, double to_m) { return {from_m, to_m, 0.0, kDoorHeight_m}; }
Opening window(double from_m, double to_m) { return {from_m, to_m, 0.9, kDoorHeight_m}; }

/// Adds the piece of a wall between two places along it and two heights, unless it is empty.
void addPiece(Solids& solids, const Wall& wall, const Opening& piece) {
  if (piece.from_m >= piece.to_m || piece.sill_m >= piece.top_m) return;
  Eigen::Vector3d min_m(piece.from_m, piece.from_m, piece.sill_m);
  Eigen::Vector3d max_m(piece.to_m, piece.to_m, piece.top_m);
  min_m[1 - wall.axis] = wall.across_m - kWallThickness_m / 2;
  max_m[1 - wall.axis] = wall.across_m + kWallThickness_m / 2;
  addBox(solids, SolidKind::kWall, min_m, max_m);
}

void addWall(Solids& solids, const Wall& wall) {
  double from = wall.from_m;
  for (const Opening& opening : wall.openings) {
    addPiece(solids, wall, {from, opening.from_m, 0.0, kCeiling_m});
    addPiece(solids, wall, {opening.from_m, opening.to_m, 0.0, opening.sill_m});
    addPiece(solids, wall, {opening.from_m, opening.to_m, opening.top_m, kCeiling_m});
    from = opening.to_m;
  }
  addPiece(solids, wall, {from, wall.to_m, 0.0, kCeiling_m});
}

/// Adds eight steps at the north wall, up to a landing.
void addStairs(Solids& solids) {
  constexpr int kSteps = 8;
  constexpr double kRise_m = 0.17;
  constexpr double kTread_m = 0.28;
  constexpr double kStart_m = 12.0;
  for (int step = 0; step < kSteps; ++step) {
    const double from = kStart_m + step * kTread_m;
    addBox(solids, SolidKind::kStairs, {from, 10.7, 0.0},
           {from + kTread_m, 11.9, (step + 1) * kRise_m});
  }
  addBox(solids, SolidKind::kStairs, {kStart_m + kSteps * kTread_m, 10.7, 0.0},
         {16.5, 11.9, kSteps * kRise_m});
}

}  // namespace

void addGround(Solids& solids) {
  addBox(solids, SolidKind::kGround, {-30.0, -30.0, -0.5}, {64.0, 42.0, 0.0});
}

void addBuilding(Solids& solids) {
  const Wall walls[] = {
      // Outer walls: south, north, west, east.
      {0, 0.0, -0.1, 18.1, {window(1.5, 4.5), window(7.5, 10.5)}},
      {0, 12.0, -0.1, 18.1, {window(3.0, 6.0)}},
      {1, 0.0, 0.1, 11.9, {window(8.5, 10.5)}},
      {1, 18.0, 0.1, 11.9, {window(1.5, 3.5), doorway(5.3, 6.7), doorway(8.9, 10.1)}},
      // Walls along the corridor: rooms A, B, C, and the hall.
      {0,
       5.0,
       0.1,
       17.9,
       {doorway(2.9, 4.1), doorway(8.4, 9.6), doorway(kHingeX_m, kHingeX_m + kDoorWidth_m)}},
      {0, 7.0, 0.1, 17.9, {doorway(2.9, 4.1)}},
      // Walls between A and B, B and C, the hall and the stairs.
      {1, 6.0, 0.1, 4.9, {doorway(1.9, 3.1)}},
      {1, 12.0, 0.1, 4.9, {}},
      {1, 10.0, 7.1, 11.9, {doorway(8.9, 10.1)}},
  };
  for (const Wall& wall : walls) addWall(solids, wall);
  addBox(solids, SolidKind::kCeiling, {-0.1, -0.1, kCeiling_m}, {18.1, 12.1, kCeiling_m + 0.2});
  addStairs(solids);
  for (const double x : {13.0, 16.0}) {
    solids.push_back({SolidKind::kPillar, Cylinder{{x, 8.0}, 0.2, 0.0, kCeiling_m}});
  }
}

}  // namespace cuboid_mapping::site
