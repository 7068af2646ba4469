// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/slab_walk.h"

#include "support/random_shapes.h"
#include "support/walk_cells.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

namespace cuboid_mapping {
namespace {

constexpr std::int32_t kBase = -(1 << 23);

/// The cells that are marked, with the base at kBase on each axis.
std::set<Cell> markedCells(const BeamMarks& marks) {
  std::set<Cell> cells;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const BrickMask misses = marks[i].collectMisses();
    for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
      if ((misses[static_cast<std::size_t>(voxel >> 6)] >> (voxel & 63) & 1) == 0) continue;
      Cell cell;
      for (int axis = 0; axis < 3; ++axis) {
        const auto brick = static_cast<std::int32_t>(marks.key(i) >> (kBrickKeyBits * axis) &
                                                     ((1U << kBrickKeyBits) - 1));
        cell[axis] = kBase + brick * kBrickEdge + (voxel >> (3 * axis) & 7);
      }
      cells.insert(cell);
    }
  }
  return cells;
}

bool markOne(const RayOrigin& origin, const Eigen::Vector3f& end, BeamMarks& marks) {
  RayBatch one;
  computeRays(origin, &end, 1, std::numeric_limits<double>::infinity(), one);
  return markSlabs(one, Cell{kBase, kBase, kBase}, marks) != 0;
}

/// Numbers of beams that the function has decided, and that it has left to walkRay().
struct Counts {
  std::size_t marked = 0;
  std::size_t given_up = 0;
};

void checkBeam(const Grid& grid, const Eigen::Vector3d& anchor_map, const Eigen::Vector3f& origin,
               const Eigen::Vector3f& end, Counts& counts) {
  const auto ray = test::computeRay(grid, anchor_map, origin, end);
  ASSERT_TRUE(ray.has_value());
  const std::vector<Cell> walked = test::walkCells(*ray);
  std::set<Cell> expected(walked.begin(), walked.end());
  expected.insert(ray->end);
  BeamMarks marks;
  if (markOne(RayOrigin(grid, anchor_map, origin), end, marks)) {
    ++counts.marked;
    ASSERT_EQ(markedCells(marks), expected);
  } else {
    ++counts.given_up;
    for (const Cell& cell : markedCells(marks)) ASSERT_EQ(expected.count(cell), 1U) << cell;
  }
}

class SlabWalk : public testing::Test {
 protected:
  void SetUp() override {
    if (!hasLanes()) GTEST_SKIP() << "this processor has neither AVX2 nor NEON";
  }
};

TEST_F(SlabWalk, marksTheVoxelsOfTheRayWalkForBeamsInAllDirections) {
  test::Random random(11);
  Counts counts;
  std::size_t num_cases = 0;
  for (const double resolution_m : {0.02, 0.05, 0.1, 0.2, 0.3, 1.0}) {
    const Grid grid(resolution_m);
    for (const double extent : {3.0, 20.0, 200.0}) {
      for (int i = 0; i < 1000; ++i, ++num_cases) {
        const double half_edge_m = extent * resolution_m;
        const Eigen::Vector3f origin = test::randomPoint(random, half_edge_m).cast<float>();
        const Eigen::Vector3f end = test::randomPoint(random, half_edge_m).cast<float>();
        checkBeam(grid, Eigen::Vector3d::Zero(), origin, end, counts);
        ASSERT_FALSE(HasFatalFailure()) << resolution_m << " m, " << test::seedNote(num_cases);
      }
    }
  }
  EXPECT_EQ(counts.marked + counts.given_up, 18000U);
  EXPECT_LT(counts.given_up, 500U) << "those in a voxel or two";
}

TEST_F(SlabWalk, marksTheVoxelsOfTheRayWalkAlongEdgesAndDiagonals) {
  // Ends on a lattice of half voxels: beams along faces, edges and diagonals, and through corners.
  test::Random random(12);
  Counts counts;
  for (const double resolution_m : {0.05, 0.1, 0.25, 0.3, 1.0}) {
    test::ScanShape shape;
    shape.resolution_m = resolution_m;
    shape.half_edge_m = 30.0 * resolution_m;
    shape.lattice_ratio = 1.0;
    for (std::size_t i = 0; i < 4000; ++i) {
      const Eigen::Vector3f origin =
          i % 2 == 0 ? Eigen::Vector3f::Zero().eval() : test::randomEndPoint(random, shape);
      const Eigen::Vector3f end = test::randomEndPoint(random, shape);
      checkBeam(Grid(resolution_m), Eigen::Vector3d::Zero(), origin, end, counts);
      ASSERT_FALSE(HasFatalFailure()) << resolution_m << " m, " << test::seedNote(i);
    }
  }
  EXPECT_GT(counts.marked, 5000U);
}

TEST_F(SlabWalk, marksTheVoxelsOfTheRayWalkWithAnOriginOnBordersOfVoxels) {
  test::Random random(13);
  Counts counts;
  for (std::size_t i = 0; i < 20000; ++i) {
    Eigen::Vector3f origin = test::randomPoint(random, 1.0).cast<float>();
    for (int axis = 0; axis < 3; ++axis) {
      if (random.chance(0.5)) origin[axis] = std::round(origin[axis] * 4.0F) / 4.0F;
    }
    const Eigen::Vector3f end = test::randomPoint(random, 20.0).cast<float>();
    checkBeam(Grid(0.25), Eigen::Vector3d::Zero(), origin, end, counts);
    ASSERT_FALSE(HasFatalFailure()) << test::seedNote(i);
  }
  EXPECT_LT(counts.given_up, 200U);
}

TEST_F(SlabWalk, marksTheVoxelsOfTheRayWalkFarFromTheOriginOfTheMap) {
  test::Random random(14);
  Counts counts;
  const Eigen::Vector3d anchor_map(1024.0 * 400, -1024.0 * 500, 1024.0);
  for (std::size_t i = 0; i < 5000; ++i) {
    const Eigen::Vector3f origin = test::randomPoint(random, 10.0).cast<float>();
    const Eigen::Vector3f end = test::randomPoint(random, 30.0).cast<float>();
    checkBeam(Grid(0.1), anchor_map, origin, end, counts);
    ASSERT_FALSE(HasFatalFailure()) << test::seedNote(i);
  }
  EXPECT_LT(counts.given_up, 100U);
}

TEST_F(SlabWalk, leavesABeamWithoutAnySlabBorderToTheRayWalk) {
  const RayOrigin origin(Grid(1.0), Eigen::Vector3d::Zero(), {0.1F, 0.1F, 0.1F});
  BeamMarks marks;
  EXPECT_FALSE(markOne(origin, {0.9F, 0.9F, 0.9F}, marks));
  EXPECT_EQ(marks.size(), 0U);
}

TEST(BeamMarks, keepsTheMarksOfManyBricks) {
  BeamMarks marks;
  for (std::uint64_t round = 0; round < 2; ++round) {
    for (std::int32_t i = 0; i < 5000; ++i) {
      marks.findOrAdd(toBrickKey({8 * i, 8 * (i % 7), 8 * (i % 13)})).hits[0] =
          static_cast<std::uint64_t>(i) + round;
    }
    ASSERT_EQ(marks.size(), 5000U);
    for (std::int32_t i = 0; i < 5000; ++i) {
      const BrickKey key = toBrickKey({8 * i, 8 * (i % 7), 8 * (i % 13)});
      ASSERT_EQ(marks.findOrAdd(key).hits[0], static_cast<std::uint64_t>(i) + round);
      ASSERT_EQ(marks.key(static_cast<std::size_t>(i)), key);
    }
    marks.clear();
    EXPECT_EQ(marks.size(), 0U);
  }
}

TEST(BeamMarks, collectsMissesOfBeamsAlongAllAxes) {
  for (const Cell& cell : {Cell{0, 0, 0}, Cell{1, 2, 3}, Cell{7, 0, 5}, Cell{6, 7, 1}}) {
    const auto check = [&cell](std::size_t mask, int word, int bit) {
      BrickMarks marks;
      marks.misses[mask][word] = 1ULL << bit;
      BrickMask expected;
      expected.set(voxelIndex(cell));
      EXPECT_EQ(marks.collectMisses(), expected) << cell << ", mask " << mask;
    };
    const auto& [x, y, z] = cell;
    check(0, z, 8 * y + x);
    check(1, y, 8 * z + x);
    check(2, x, 8 * z + y);
  }
}

}  // namespace
}  // namespace cuboid_mapping
