// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/site_parts.h"

namespace cuboid_mapping::site {
namespace {

/// A table of 1.6 x 0.8 m with four legs and a stool.
void addTable(Solids& solids, const Eigen::Vector2d& center_m) {
  const Eigen::Vector3d center(center_m.x(), center_m.y(), 0.0);
  addBox(solids, SolidKind::kFurniture, center + Eigen::Vector3d(-0.8, -0.4, 0.71),
         center + Eigen::Vector3d(0.8, 0.4, 0.75));
  for (const double x : {-0.75, 0.75}) {
    for (const double y : {-0.35, 0.35}) {
      addBox(solids, SolidKind::kFurniture, center + Eigen::Vector3d(x - 0.03, y - 0.03, 0.0),
             center + Eigen::Vector3d(x + 0.03, y + 0.03, 0.71));
    }
  }
  solids.push_back(
      {SolidKind::kFurniture, Cylinder{center_m + Eigen::Vector2d(0.2, -0.45), 0.18, 0.0, 0.45}});
}

/// A round table with one leg.
void addRoundTable(Solids& solids, const Eigen::Vector2d& center_m) {
  solids.push_back({SolidKind::kFurniture, Cylinder{center_m, 0.6, 0.70, 0.74}});
  solids.push_back({SolidKind::kFurniture, Cylinder{center_m, 0.08, 0.0, 0.70}});
}

/// A shelf against a wall: two sides and five boards over the given ground.
/// @param axis  0: boards along x, 1: along y.
void addShelf(Solids& solids, const Eigen::Vector2d& min_m, int axis) {
  constexpr double kLength_m = 1.8;
  constexpr double kDepth_m = 0.4;
  constexpr double kHeight_m = 2.0;
  constexpr double kBoard_m = 0.03;
  const Eigen::Vector3d corner(min_m.x(), min_m.y(), 0.0);
  const Eigen::Vector3d along = Eigen::Vector3d::Unit(axis);
  const Eigen::Vector3d across = Eigen::Vector3d::Unit(1 - axis);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  for (const double from : {0.0, kLength_m - kBoard_m}) {
    addBox(solids, SolidKind::kFurniture, corner + along * from,
           corner + along * (from + kBoard_m) + across * kDepth_m + up * kHeight_m);
  }
  for (int board = 1; board <= 5; ++board) {
    const double top = kHeight_m * board / 5;
    addBox(solids, SolidKind::kFurniture, corner + up * (top - kBoard_m),
           corner + along * kLength_m + across * kDepth_m + up * top);
  }
}

/// A cupboard of 1.9 m height.
void addCupboard(Solids& solids, const Eigen::Vector2d& min_m, const Eigen::Vector2d& size_m) {
  addBox(solids, SolidKind::kFurniture, {min_m.x(), min_m.y(), 0.0},
         {min_m.x() + size_m.x(), min_m.y() + size_m.y(), 1.9});
}

}  // namespace

void addFurniture(Solids& solids, Random& random) {
  const Eigen::Vector2d along_x(1.0, 0.5);
  const Eigen::Vector2d along_y(0.5, 1.0);
  // Room A.
  addTable(solids, {random.uniform(1.2, 1.8), random.uniform(2.2, 3.8)});
  addCupboard(solids, {random.uniform(0.2, 4.8), 0.1}, along_x);
  addShelf(solids, {0.1, random.uniform(0.8, 3.0)}, 1);
  // Room B.
  addTable(solids, {random.uniform(10.7, 10.9), random.uniform(1.4, 2.8)});
  addCupboard(solids, {random.uniform(6.3, 8.0), 0.1}, along_x);
  addShelf(solids, {random.uniform(6.2, 6.5), 4.5}, 0);
  // Room C; the door needs space to open.
  addTable(solids, {random.uniform(13.2, 16.0), random.uniform(1.2, 2.4)});
  addCupboard(solids, {17.4, random.uniform(1.0, 3.8)}, along_y);
  addShelf(solids, {12.1, random.uniform(0.4, 2.8)}, 1);
  // The hall.
  addTable(solids, {random.uniform(5.5, 6.2), random.uniform(10.8, 11.1)});
  addTable(solids, {random.uniform(8.0, 8.8), random.uniform(10.8, 11.1)});
  addRoundTable(solids, {random.uniform(1.4, 1.9), random.uniform(10.4, 11.1)});
  addCupboard(solids, {random.uniform(4.8, 6.2), 7.1}, along_x);
  addCupboard(solids, {random.uniform(7.4, 8.8), 7.1}, along_x);
  addShelf(solids, {0.1, random.uniform(7.2, 8.4)}, 1);
}

}  // namespace cuboid_mapping::site
