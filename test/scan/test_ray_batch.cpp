// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/ray_batch.h"

#include "support/random_shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace cuboid_mapping {
namespace {

constexpr double kNoRange = std::numeric_limits<double>::infinity();

/// Checks that every ray of a batch has the bits of RayOrigin::computeRay(). @return Rays that are set up.
int checkBatch(const RayOrigin& origin, const std::vector<Eigen::Vector3f>& ends,
               double max_range_m) {
  RayBatch rays;
  computeRays(origin, ends.data(), static_cast<int>(ends.size()), max_range_m, rays);
  for (std::size_t i = 0; i < ends.size(); ++i) {
    Eigen::Vector3f end = ends[i];
    const bool is_cut = std::isfinite(max_range_m) && cutBeam(origin.point(), max_range_m, end);
    Ray ray;
    const bool is_taken =
        origin.computeRay(end, ray) && ray.length_m > 0.0 && isWithinReach(ray.start, ray.end);
    EXPECT_EQ(rays.taken >> i & 1U, is_taken ? 1U : 0U) << end.transpose();
    if (!is_taken) continue;
    EXPECT_EQ(rays.cut >> i & 1U, is_cut ? 1U : 0U);
    EXPECT_EQ(rays.startOf(i), ray.start);
    EXPECT_EQ(rays.endOf(i), ray.end);
    EXPECT_EQ(rays.length_m[i], ray.length_m);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(rays.t_max[axis][i], ray.t_max[axis]) << end.transpose();
      EXPECT_EQ(rays.t_delta[axis][i], ray.t_delta[axis]) << end.transpose();
    }
  }
  EXPECT_EQ(rays.taken & ~RayBatch::all(static_cast<int>(ends.size())), 0U);
  return __builtin_popcount(rays.taken);
}

class RayBatches : public testing::Test {
 protected:
  void SetUp() override {
    if (!hasLanes()) GTEST_SKIP() << "this processor has neither AVX2 nor NEON";
  }
};

TEST_F(RayBatches, hasTheBitsOfSingleRays) {
  test::Random random(21);
  int num_taken = 0;
  for (std::size_t i = 0; i < 2000; ++i) {
    const double resolution_m = std::vector<double>{0.02, 0.05, 0.1, 0.3, 1.0}[i % 5];
    const Eigen::Vector3d anchor_map =
        i % 3 == 0 ? Eigen::Vector3d(1024.0 * 400, -1024.0, 0.0) : Eigen::Vector3d(0.0, 0.0, 0.0);
    test::ScanShape shape;
    shape.resolution_m = resolution_m;
    shape.half_edge_m = 300.0 * resolution_m;
    shape.lattice_ratio = 0.3;  // Share of ends on borders of voxels.
    const RayOrigin origin(Grid(resolution_m), anchor_map, test::randomEndPoint(random, shape));
    std::vector<Eigen::Vector3f> ends(i % RayBatch::kSize + 1);
    for (Eigen::Vector3f& end : ends) end = test::randomEndPoint(random, shape);
    num_taken += checkBatch(origin, ends, i % 2 == 0 ? kNoRange : 100.0 * resolution_m);
    ASSERT_FALSE(HasFailure()) << test::seedNote(i);
  }
  EXPECT_GT(num_taken, 30000);
}

TEST_F(RayBatches, leavesOutWhatIsNoRay) {
  const Eigen::Vector3f point(1.0F, 2.0F, 3.0F);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  std::vector<Eigen::Vector3f> ends{point, {1.0F, 2.0F, 4.0F}};
  for (const float bad : {std::nanf(""), kInfinity, -kInfinity, 1.1e6F, -1.1e6F, 3e38F, 1e-30F}) {
    for (int axis = 0; axis < 3; ++axis) {
      ends.push_back(point);
      ends.back()[axis] = bad;
    }
  }
  const RayOrigin origin(Grid(0.001), Eigen::Vector3d::Zero(), point);
  EXPECT_EQ(checkBatch(origin, ends, kNoRange), 4) << "the second and those of 1e-30";
  EXPECT_EQ(checkBatch(origin, ends, 10.0), 10) << "those of 1.1e6 and -1.1e6, which are cut, too";
}

}  // namespace
}  // namespace cuboid_mapping
