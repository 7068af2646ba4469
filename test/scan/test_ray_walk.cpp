// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/ray_walk.h"

#include "support/random_shapes.h"
#include "support/walk_cells.h"

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <cmath>
#include <cstdlib>
#include <limits>

namespace cuboid_mapping {
namespace {

const Eigen::Vector3d kNoAnchor = Eigen::Vector3d::Zero();

std::vector<Cell> walk(const Grid& grid, const Eigen::Vector3f& origin,
                       const Eigen::Vector3f& end) {
  const auto ray = test::computeRay(grid, kNoAnchor, origin, end);
  EXPECT_TRUE(ray.has_value());
  return ray ? test::walkCells(*ray) : std::vector<Cell>();
}

int manhattanDistance(const Cell& a, const Cell& b) {
  return std::abs(a.x - b.x) + std::abs(a.y - b.y) + std::abs(a.z - b.z);
}

/// A point at most 0.4 voxels off the centre of its voxel on each axis.
Eigen::Vector3f pointNearCentre(test::Random& random, const Grid& grid, int max_cell) {
  const CellBox area{{-max_cell, -max_cell, -max_cell}, {max_cell, max_cell, max_cell}};
  const Eigen::Vector3d center = grid.centerOf(CellBox::ofCell(test::randomCell(random, area)));
  return (center + test::randomPoint(random, 0.4 * grid.resolution())).cast<float>();
}

/// Length of the part of the beam inside a cell enlarged by a margin, negative if none.
double lengthInside(const Grid& grid, const Cell& cell, const Eigen::Vector3f& origin,
                    const Eigen::Vector3f& end, double margin_m) {
  const MetricBox box = grid.toMetricBox(CellBox::ofCell(cell));
  const Eigen::Vector3d start = origin.cast<double>();
  const Eigen::Vector3d beam = end.cast<double>() - start;
  double first = 0.0;
  double last = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double lower = box.min_m[axis] - margin_m - start[axis];
    const double upper = box.max_m[axis] + margin_m - start[axis];
    if (beam[axis] == 0.0) {
      if (lower > 0.0 || upper < 0.0) return -1.0;
      continue;
    }
    first = std::max(first, std::min(lower / beam[axis], upper / beam[axis]));
    last = std::min(last, std::max(lower / beam[axis], upper / beam[axis]));
  }
  return (last - first) * beam.norm();
}

TEST(RayWalk, marksNothingInsideOneVoxel) {
  const Grid grid(1.0);
  EXPECT_TRUE(walk(grid, {0.1F, 0.1F, 0.1F}, {0.9F, 0.9F, 0.9F}).empty());
  EXPECT_TRUE(walk(grid, {0.1F, 0.1F, 0.1F}, {0.1F, 0.1F, 0.1F}).empty()) << "no length";
}

TEST(RayWalk, goesAlongAnAxisFromTheOriginsVoxelUpToTheOneBeforeTheEnd) {
  const Grid grid(1.0);
  for (int axis = 0; axis < 3; ++axis) {
    for (const int sign : {1, -1}) {
      Eigen::Vector3f end(0.5F, 0.5F, 0.5F);
      end[axis] += static_cast<float>(4 * sign);
      const std::vector<Cell> cells = walk(grid, {0.5F, 0.5F, 0.5F}, end);
      ASSERT_EQ(cells.size(), 4U);
      for (int i = 0; i < 4; ++i) {
        Cell expected;
        expected[axis] = i * sign;
        EXPECT_EQ(cells[static_cast<std::size_t>(i)], expected);
      }
    }
  }
}

TEST(RayWalk, goesAlongAFaceInTheVoxelsAboveIt) {
  const Grid grid(1.0);
  const std::vector<Cell> expected{{0, 2, -1}, {1, 2, -1}, {2, 2, -1}};
  EXPECT_EQ(walk(grid, {0.5F, 2.0F, -1.0F}, {3.5F, 2.0F, -1.0F}), expected);
}

TEST(RayWalk, takesTheVoxelAboveAFaceForItsEnds) {
  const Grid grid(1.0);
  const std::vector<Cell> forward{{0, 0, 0}, {1, 0, 0}};
  EXPECT_EQ(walk(grid, {0.0F, 0.5F, 0.5F}, {2.0F, 0.5F, 0.5F}), forward);
  const std::vector<Cell> backward{{2, 0, 0}, {1, 0, 0}};
  EXPECT_EQ(walk(grid, {2.0F, 0.5F, 0.5F}, {0.0F, 0.5F, 0.5F}), backward);
}

TEST(RayWalk, takesZThenYThenXThroughACorner) {
  const Grid grid(1.0);
  const std::vector<Cell> expected{{0, 0, 0}, {0, 0, 1}, {0, 1, 1},
                                   {1, 1, 1}, {1, 1, 2}, {1, 2, 2}};
  EXPECT_EQ(walk(grid, {0.5F, 0.5F, 0.5F}, {2.5F, 2.5F, 2.5F}), expected);
}

TEST(RayWalk, stopsWithTheBeamWhereRoundingLeadsPastTheEnd) {
  // The walk is set up as if the beam did not pass the end's voxel.
  auto ray = test::computeRay(Grid(1.0), kNoAnchor, {0.5F, 0.5F, 0.5F}, {4.5F, 0.5F, 0.5F});
  ASSERT_TRUE(ray.has_value());
  ray->end = {4, 1, 0};
  const std::vector<Cell> expected{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
  EXPECT_EQ(test::walkCells(*ray), expected);
}

TEST(RayWalk, isNothingForPointsOutsideTheGridOrNotFinite) {
  const Grid grid(0.001);
  const Eigen::Vector3f inside(1.0F, 2.0F, 3.0F);
  ASSERT_TRUE(test::computeRay(grid, kNoAnchor, inside, inside).has_value());
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (const float bad : {std::nanf(""), kInfinity, -kInfinity, 1.1e6F, -1.1e6F, 3e38F}) {
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3f point = inside;
      point[axis] = bad;
      EXPECT_FALSE(test::computeRay(grid, kNoAnchor, inside, point).has_value()) << bad;
      EXPECT_FALSE(test::computeRay(grid, kNoAnchor, point, inside).has_value()) << bad;
    }
  }
}

TEST(RayWalk, isNothingWhenTheAnchorLeadsOutOfTheGrid) {
  const Eigen::Vector3f point(1.0F, 2.0F, 3.0F);
  EXPECT_TRUE(test::computeRay(Grid(0.05), {1e6, 1e6, 0.0}, point, point).has_value());
  EXPECT_FALSE(test::computeRay(Grid(0.05), {1e6, 6e7, 0.0}, point, point).has_value());
}

/// Checks properties of every walk; returns whether it ended at the face of the end's voxel.
bool checkWalk(const Grid& grid, const Eigen::Vector3f& origin, const Eigen::Vector3f& end) {
  const auto ray = test::computeRay(grid, kNoAnchor, origin, end);
  EXPECT_TRUE(ray.has_value());
  const std::vector<Cell> cells = test::walkCells(*ray);
  EXPECT_EQ(cells.empty(), ray->start == ray->end);
  if (cells.empty()) return true;
  EXPECT_EQ(cells.front(), grid.toCell(origin.cast<double>()));
  EXPECT_EQ(ray->end, grid.toCell(end.cast<double>()));
  // Float32 directions and coordinates are exact to about 1e-7 of the extent of the beam.
  const double margin_m = 1e-6 * (1.0 + origin.norm() + end.norm());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    EXPECT_NE(cells[i], ray->end) << "the end's voxel is excluded";
    EXPECT_GE(lengthInside(grid, cells[i], origin, end, margin_m), 0.0) << cells[i];
    if (i > 0) {
      EXPECT_EQ(manhattanDistance(cells[i - 1], cells[i]), 1);
      EXPECT_EQ(manhattanDistance(cells[i], ray->start), static_cast<int>(i)) << "a step back";
    }
  }
  return manhattanDistance(cells.back(), ray->end) == 1;
}

TEST(RayWalk, passesAdjacentVoxelsThatTheBeamCrosses) {
  test::Random random(1);
  std::size_t num_cases = 0;
  std::size_t num_missed = 0;
  for (const double resolution_m : {0.05, 0.1, 0.2, 0.3, 1.0}) {
    test::ScanShape shape;
    shape.resolution_m = resolution_m;
    shape.half_edge_m = 15.0 * resolution_m;
    for (int i = 0; i < 2000; ++i, ++num_cases) {
      shape.lattice_ratio = i % 2 == 0 ? 0.0 : 0.5;
      const Eigen::Vector3f origin = test::randomEndPoint(random, shape);
      const Eigen::Vector3f end = test::randomEndPoint(random, shape);
      num_missed += checkWalk(Grid(resolution_m), origin, end) ? 0 : 1;
      ASSERT_FALSE(HasFailure()) << resolution_m << " m, " << test::seedNote(num_cases);
    }
  }
  EXPECT_EQ(num_cases, 10000U);
  EXPECT_LT(num_missed, num_cases / 10) << "only beams that end on a face may miss their end";
}

TEST(RayWalk, marksAsManyVoxelsAsTheManhattanDistanceWhenNoEndIsNearAFace) {
  test::Random random(2);
  std::size_t num_cases = 0;
  for (const double resolution_m : {0.02, 0.05, 0.1, 0.2, 0.3, 1.0}) {
    const Grid grid(resolution_m);
    for (int i = 0; i < 2000; ++i, ++num_cases) {
      const Eigen::Vector3f origin = pointNearCentre(random, grid, 300);
      const Eigen::Vector3f end = pointNearCentre(random, grid, 300);
      const auto ray = test::computeRay(grid, kNoAnchor, origin, end);
      ASSERT_TRUE(ray.has_value());
      const std::vector<Cell> cells = test::walkCells(*ray);
      ASSERT_EQ(static_cast<int>(cells.size()), manhattanDistance(ray->start, ray->end))
          << resolution_m << " m, " << test::seedNote(num_cases);
    }
  }
  EXPECT_EQ(num_cases, 12000U);
}

/// Whether both walks are equal, cell by cell.
testing::AssertionResult isWalkOfOctomap(const octomap::OcTree& tree, octomap::KeyRay& keys,
                                         const Eigen::Vector3f& origin,
                                         const Eigen::Vector3f& end) {
  const octomap::point3d octomap_origin(origin.x(), origin.y(), origin.z());
  const octomap::point3d octomap_end(end.x(), end.y(), end.z());
  if (!tree.computeRayKeys(octomap_origin, octomap_end, keys)) {
    return testing::AssertionFailure() << "OctoMap takes the beam for out of bounds";
  }
  const std::vector<Cell> cells = walk(Grid(tree.getResolution()), origin, end);
  if (cells.size() != keys.size()) {
    return testing::AssertionFailure() << cells.size() << " cells, OctoMap " << keys.size();
  }
  auto key = keys.begin();
  for (const Cell& cell : cells) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      if (cell[static_cast<int>(axis)] != static_cast<int>((*key)[axis]) - 32768) {
        return testing::AssertionFailure() << "another voxel after " << key - keys.begin();
      }
    }
    ++key;
  }
  return testing::AssertionSuccess();
}

TEST(RayWalk, isThatOfOctomapToTheLastVoxel) {
  test::Random random(3);
  std::size_t num_cases = 0;
  octomap::KeyRay keys;
  for (const double resolution_m : {0.02, 0.05, 0.1, 0.2, 0.25, 0.3}) {
    const octomap::OcTree tree(resolution_m);
    test::ScanShape shape;
    shape.resolution_m = resolution_m;
    for (int i = 0; i < 10000; ++i, ++num_cases) {
      shape.half_edge_m = (i % 3 == 0 ? 300.0 : 20.0) * resolution_m;
      shape.lattice_ratio = 0.25 * (i % 5);  // From none to all coordinates on faces and centres.
      const Eigen::Vector3f origin = test::randomEndPoint(random, shape);
      Eigen::Vector3f end = test::randomEndPoint(random, shape);
      if (i % 7 == 0) end[random.integer(0, 2)] = origin[random.integer(0, 2)];
      if (i % 11 == 0) {
        const int axis = random.integer(0, 2);
        end = origin;
        end[axis] += test::randomCoordinate(random, shape);
      }
      if (i % 13 == 0)
        end = origin + Eigen::Vector3f::Constant(test::randomCoordinate(random, shape));
      ASSERT_TRUE(isWalkOfOctomap(tree, keys, origin, end))
          << "from " << origin.transpose() << " to " << end.transpose() << " at " << resolution_m
          << " m, " << test::seedNote(num_cases);
    }
  }
  EXPECT_EQ(num_cases, 60000U);
}

TEST(RayWalk, isTheSameFarFromTheOriginWithAnAnchor) {
  test::Random random(4);
  test::ScanShape shape;
  shape.half_edge_m = 30.0;
  std::size_t num_cases = 0;
  // Exact in binary: nothing is rounded. At 0.05 m, see test_scan_update.
  for (const double resolution_m : {0.0625, 0.125}) {
    const Grid grid(resolution_m);
    shape.resolution_m = resolution_m;
    const Eigen::Vector3d anchor(977.0 * 1024.0, -977.0 * 1024.0, 1024.0);
    const Cell shift = *grid.toCell(anchor);
    for (int i = 0; i < 1000; ++i, ++num_cases) {
      shape.lattice_ratio = i % 2 == 0 ? 0.0 : 0.5;
      const Eigen::Vector3f origin = test::randomEndPoint(random, shape);
      const Eigen::Vector3f end = test::randomEndPoint(random, shape);
      const auto far_ray = test::computeRay(grid, anchor, origin, end);
      ASSERT_TRUE(far_ray.has_value());
      std::vector<Cell> expected = walk(grid, origin, end);
      for (Cell& cell : expected) cell = cell + shift;
      ASSERT_EQ(test::walkCells(*far_ray), expected) << test::seedNote(num_cases);
    }
  }
  EXPECT_EQ(num_cases, 2000U);
}

}  // namespace
}  // namespace cuboid_mapping
