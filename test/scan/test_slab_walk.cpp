// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/slab_walk.h"

#include "cuboid_mapping/scan/slab_walk_avx2.h"

#include "support/random_shapes.h"
#include "support/walk_cells.h"

#include <gtest/gtest.h>

#include <cmath>
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
        const auto brick = static_cast<std::int32_t>(marks[i].key >> (kBrickKeyBits * axis) &
                                                     ((1U << kBrickKeyBits) - 1));
        cell[axis] = kBase + brick * kBrickEdge + (voxel >> (3 * axis) & 7);
      }
      cells.insert(cell);
    }
  }
  return cells;
}

/// markSlabs() or markSlabsAvx2().
using MarkFunction = bool (*)(const Ray&, const Cell&, BeamMarks&);

std::vector<MarkFunction> markFunctions() {
  std::vector<MarkFunction> functions{markSlabs};
  if (hasSlabWalkAvx2()) functions.push_back(markSlabsAvx2);
  return functions;
}

std::string nameOf(const testing::TestParamInfo<MarkFunction>& info) {
  return info.param == markSlabs ? "portable" : "avx2";
}

/// How many beams the function has decided, and how many it has left to walkRay().
struct Counts {
  std::size_t marked = 0;
  std::size_t given_up = 0;
};

void checkBeam(MarkFunction mark, const Grid& grid, const Eigen::Vector3d& anchor_map,
               const Eigen::Vector3f& origin, const Eigen::Vector3f& end, Counts& counts) {
  const auto ray = test::computeRay(grid, anchor_map, origin, end);
  ASSERT_TRUE(ray.has_value());
  const std::vector<Cell> walked = test::walkCells(*ray);
  std::set<Cell> expected(walked.begin(), walked.end());
  expected.insert(ray->end);
  BeamMarks marks;
  if (mark(*ray, ray->start - Cell{kBase, kBase, kBase}, marks)) {
    ++counts.marked;
    ASSERT_EQ(markedCells(marks), expected);
  } else {
    ++counts.given_up;
    for (const Cell& cell : markedCells(marks)) ASSERT_EQ(expected.count(cell), 1U) << cell;
  }
}

class SlabWalk : public testing::TestWithParam<MarkFunction> {};

INSTANTIATE_TEST_SUITE_P(Processors, SlabWalk, testing::ValuesIn(markFunctions()), nameOf);

TEST_P(SlabWalk, marksTheVoxelsOfTheRayWalkForBeamsInAllDirections) {
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
        checkBeam(GetParam(), grid, Eigen::Vector3d::Zero(), origin, end, counts);
        ASSERT_FALSE(HasFatalFailure()) << resolution_m << " m, " << test::seedNote(num_cases);
      }
    }
  }
  EXPECT_EQ(counts.marked + counts.given_up, 18000U);
  EXPECT_LT(counts.given_up, 500U) << "those in a voxel or two";
}

TEST_P(SlabWalk, marksTheVoxelsOfTheRayWalkAlongEdgesAndDiagonals) {
  // Ends on a lattice of half voxels: beams along faces, edges and diagonals, through corners.
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
      checkBeam(GetParam(), Grid(resolution_m), Eigen::Vector3d::Zero(), origin, end, counts);
      ASSERT_FALSE(HasFatalFailure()) << resolution_m << " m, " << test::seedNote(i);
    }
  }
  EXPECT_GT(counts.marked, 5000U);
}

TEST_P(SlabWalk, marksTheVoxelsOfTheRayWalkWithAnOriginOnBordersOfVoxels) {
  test::Random random(13);
  Counts counts;
  for (std::size_t i = 0; i < 20000; ++i) {
    Eigen::Vector3f origin = test::randomPoint(random, 1.0).cast<float>();
    for (int axis = 0; axis < 3; ++axis) {
      if (random.chance(0.5)) origin[axis] = std::round(origin[axis] * 4.0F) / 4.0F;
    }
    const Eigen::Vector3f end = test::randomPoint(random, 20.0).cast<float>();
    checkBeam(GetParam(), Grid(0.25), Eigen::Vector3d::Zero(), origin, end, counts);
    ASSERT_FALSE(HasFatalFailure()) << test::seedNote(i);
  }
  EXPECT_LT(counts.given_up, 200U);
}

TEST_P(SlabWalk, marksTheVoxelsOfTheRayWalkFarFromTheOriginOfTheMap) {
  test::Random random(14);
  Counts counts;
  const Eigen::Vector3d anchor_map(1024.0 * 400, -1024.0 * 500, 1024.0);
  for (std::size_t i = 0; i < 5000; ++i) {
    const Eigen::Vector3f origin = test::randomPoint(random, 10.0).cast<float>();
    const Eigen::Vector3f end = test::randomPoint(random, 30.0).cast<float>();
    checkBeam(GetParam(), Grid(0.1), anchor_map, origin, end, counts);
    ASSERT_FALSE(HasFatalFailure()) << test::seedNote(i);
  }
  EXPECT_LT(counts.given_up, 100U);
}

TEST_P(SlabWalk, leavesABeamWithoutAnySlabBorderToTheRayWalk) {
  const auto ray =
      test::computeRay(Grid(1.0), Eigen::Vector3d::Zero(), {0.1F, 0.1F, 0.1F}, {0.9F, 0.9F, 0.9F});
  ASSERT_TRUE(ray.has_value());
  BeamMarks marks;
  EXPECT_FALSE(GetParam()(*ray, ray->start - Cell{kBase, kBase, kBase}, marks));
  EXPECT_EQ(marks.size(), 0U);
}

TEST(BeamMarks, keepsTheMarksOfManyBricks) {
  BeamMarks marks;
  for (std::uint64_t round = 0; round < 2; ++round) {
    for (std::int32_t i = 0; i < 5000; ++i) {
      marks.at(toBrickKey({8 * i, 8 * (i % 7), 8 * (i % 13)})).hits[0] =
          static_cast<std::uint64_t>(i) + round;
    }
    ASSERT_EQ(marks.size(), 5000U);
    for (std::int32_t i = 0; i < 5000; ++i) {
      const BrickKey key = toBrickKey({8 * i, 8 * (i % 7), 8 * (i % 13)});
      ASSERT_EQ(marks.at(key).hits[0], static_cast<std::uint64_t>(i) + round);
      ASSERT_EQ(marks[static_cast<std::size_t>(i)].key, key);
    }
    marks.clear();
    EXPECT_EQ(marks.size(), 0U);
  }
}

TEST(BeamMarks, collectsMissesOfAllLayouts) {
  for (const Cell& cell : {Cell{0, 0, 0}, Cell{1, 2, 3}, Cell{7, 0, 5}, Cell{6, 7, 1}}) {
    const int expected = voxelIndex(cell);
    const int words[3] = {cell.z, cell.z, cell.y};
    const int bits[3] = {8 * cell.y + cell.x, 8 * cell.x + cell.y, 8 * cell.x + cell.z};
    const int slab_bits[3] = {8 * cell.z + cell.y, 8 * cell.z + cell.x, 8 * cell.y + cell.x};
    for (std::size_t along = 0; along < 6; ++along) {
      BrickMarks marks;
      if (along >= 3) {
        const int slab = cell[static_cast<int>(along) - 3];
        marks.slabs[along - 3][static_cast<std::size_t>(slab / 2 + slab % 2 * 4)] =
            1ULL << slab_bits[along - 3];
      } else
        marks.misses[along][static_cast<std::size_t>(words[along])] = 1ULL << bits[along];
      const BrickMask misses = marks.collectMisses();
      for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
        EXPECT_EQ(misses[static_cast<std::size_t>(voxel >> 6)] >> (voxel & 63) & 1,
                  voxel == expected ? 1U : 0U)
            << cell << " along axis " << along;
      }
    }
  }
}

}  // namespace
}  // namespace cuboid_mapping
