// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/geometry/voxel_motion.h"

#include "cuboid_mapping/geometry/grid.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <limits>

namespace cuboid_mapping {
namespace {

using test::Random;

constexpr double kResolution_m = 0.05;

/// A rotation by quarter turns about x, then y, then z.
Eigen::Matrix3d turnBy(int about_x, int about_y, int about_z) {
  const auto quarters = [](int count, int axis) {
    return Eigen::AngleAxisd(count * M_PI / 2.0, Eigen::Vector3d::Unit(axis));
  };
  return (quarters(about_z, 2) * quarters(about_y, 1) * quarters(about_x, 0)).toRotationMatrix();
}

TEST(VoxelMotion, TakesBoxesWhereTheirPointsGo) {
  Random random;
  for (int i = 0; i < 64; ++i) {
    Eigen::Isometry3d T_target_map = Eigen::Isometry3d::Identity();
    T_target_map.linear() = turnBy(i % 4, i / 4 % 4, i / 16);
    const Cell shift{random.integer(-900, 900), random.integer(-9, 9), random.integer(-90, 90)};
    T_target_map.translation() = kResolution_m * toVector(shift);
    const auto motion = VoxelMotion::of(T_target_map, kResolution_m);
    ASSERT_TRUE(motion) << i;
    const Cell min{random.integer(-50, 50), random.integer(-50, 50), random.integer(-50, 50)};
    const CellBox box{min, min + Cell{3, 1, 7}};
    const CellBox moved = (*motion)(box);
    EXPECT_EQ(moved.numVoxels(), box.numVoxels());
    for (std::int32_t x = box.min.x; x < box.max.x; ++x) {
      const Eigen::Vector3d middle(x + 0.5, box.min.y + 0.5, box.min.z + 0.5);
      const Eigen::Vector3d there = T_target_map * (kResolution_m * middle) / kResolution_m;
      EXPECT_TRUE(moved.contains(Cell{static_cast<std::int32_t>(std::floor(there.x())),
                                      static_cast<std::int32_t>(std::floor(there.y())),
                                      static_cast<std::int32_t>(std::floor(there.z()))}))
          << i << ' ' << moved;
    }
  }
}

TEST(VoxelMotion, CutsWhatWouldLieOutsideTheLimitsOfAMap) {
  constexpr std::int32_t kMax = Grid::kMaxCell;
  const Eigen::Isometry3d T_target_map(Eigen::Translation3d(10.0 * kResolution_m, 0.0, 0.0));
  const auto motion = VoxelMotion::of(T_target_map, kResolution_m);
  ASSERT_TRUE(motion);
  EXPECT_EQ((*motion)({{kMax - 15, 0, 0}, {kMax - 5, 1, 1}}),
            (CellBox{{kMax - 5, 0, 0}, {kMax, 1, 1}}));
  EXPECT_TRUE((*motion)({{kMax - 9, 0, 0}, {kMax - 5, 1, 1}}).isEmpty());
}

TEST(VoxelMotion, IsNothingElse) {
  const auto is_motion = [](const Eigen::Isometry3d& transform) {
    return VoxelMotion::of(transform, kResolution_m).has_value();
  };
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  EXPECT_TRUE(is_motion(transform));
  transform.translation().x() = 0.5 * kResolution_m;
  EXPECT_FALSE(is_motion(transform)) << "half a voxel";
  transform.translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(is_motion(transform));
  transform = Eigen::Isometry3d(Eigen::AngleAxisd(1e-6, Eigen::Vector3d::UnitZ()));
  EXPECT_FALSE(is_motion(transform)) << "a voxel per million";
  transform = Eigen::Isometry3d::Identity();
  transform.linear()(0, 0) = -1.0;
  EXPECT_FALSE(is_motion(transform)) << "a mirror";
  transform.linear() = Eigen::Matrix3d::Zero();
  EXPECT_FALSE(is_motion(transform));
  transform.linear() = 2.0 * Eigen::Matrix3d::Identity();
  EXPECT_FALSE(is_motion(transform));
}

}  // namespace
}  // namespace cuboid_mapping
