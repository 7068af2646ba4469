// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/geometry/grid.h"

#include "support/random_shapes.h"

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <cmath>
#include <limits>

namespace cuboid_mapping {
namespace {

constexpr CellBox kWholeGrid{{-Grid::kMaxCell, -Grid::kMaxCell, -Grid::kMaxCell},
                             {Grid::kMaxCell, Grid::kMaxCell, Grid::kMaxCell}};
static_assert(kWholeGrid.size().x == 2LL * Grid::kMaxCell, "no difference overflows");

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Area for the least corner of a random cell box.
CellBox areaAround(std::int32_t center) {
  return {{center - 1000, center - 1000, center - 1000},
          {center + 1000, center + 1000, center + 1000}};
}

TEST(Grid, roundsDownOnBothSidesOfZero) {
  const Grid grid(0.5);
  EXPECT_EQ(grid.toCell({0.0, 0.49, 0.5}), (Cell{0, 0, 1}));
  EXPECT_EQ(grid.toCell({-0.01, -0.5, -0.51}), (Cell{-1, -1, -2}));
  EXPECT_EQ(grid.toCell({-0.0, -1.0, 1.0}), (Cell{0, -2, 2}));
}

TEST(Grid, hasAVoxelVolume) {
  EXPECT_DOUBLE_EQ(Grid(0.5).voxelVolume(), 0.125);
  EXPECT_DOUBLE_EQ(Grid(0.2).voxelVolume(), 0.008);
  EXPECT_EQ(Grid(0.2).resolution(), 0.2);
}

TEST(Grid, roundsAsOctomapDoes) {
  test::Random random(1);
  std::size_t num_cases = 0;
  for (const double resolution_m : {0.02, 0.05, 0.1, 0.2, 0.25, 0.3, 1.0}) {
    const Grid grid(resolution_m);
    const octomap::OcTree tree(resolution_m);
    for (int i = 0; i < 20000; ++i, ++num_cases) {
      Eigen::Vector3d point = test::randomPoint(random, 300.0);
      if (i % 2 == 0) {  // On voxel faces, up to the rounding of floats.
        point = ((point / resolution_m).array().round() * resolution_m).matrix();
        if (i % 4 == 0) point = point.cast<float>().cast<double>();
      }
      const auto cell = grid.toCell(point);
      ASSERT_TRUE(cell.has_value());
      for (int axis = 0; axis < 3; ++axis) {
        ASSERT_EQ((*cell)[axis], static_cast<int>(tree.coordToKey(point[axis])) - 32768)
            << point[axis] << " m at " << resolution_m << " m, " << test::seedNote(num_cases);
      }
    }
  }
  EXPECT_EQ(num_cases, 140000U);
}

TEST(Grid, givesNoCellForWhatIsNotFinite) {
  const Grid grid(0.1);
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3d point(1.0, 2.0, 3.0);
      ASSERT_TRUE(grid.toCell(point).has_value());
      point[axis] = bad;
      EXPECT_FALSE(grid.toCell(point).has_value()) << bad << " on axis " << axis;
    }
  }
}

TEST(Grid, givesNoCellOutOfRangeInsteadOfAWrongOne) {
  const Grid grid(1.0);
  const double bound = Grid::kMaxCell;
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    point[axis] = -bound;
    ASSERT_TRUE(grid.toCell(point).has_value());
    EXPECT_EQ((*grid.toCell(point))[axis], -Grid::kMaxCell);
    point[axis] = bound - 0.001;
    ASSERT_TRUE(grid.toCell(point).has_value());
    EXPECT_EQ((*grid.toCell(point))[axis], Grid::kMaxCell - 1);
    // 2^32 more would be cell 5 again if it wrapped around.
    for (const double outside :
         {bound, -bound - 0.001, 4294967301.0, -4294967291.0, 1e18, -1e18, 1e300}) {
      point[axis] = outside;
      EXPECT_FALSE(grid.toCell(point).has_value()) << outside << " on axis " << axis;
    }
  }
}

TEST(Grid, isExactAtUtmCoordinates) {
  const Grid grid(0.05);
  EXPECT_EQ(grid.toCell({1e6 + 0.025, -1e6 + 0.025, 0.025}), (Cell{20000000, -20000000, 0}));
  EXPECT_EQ(grid.toCell({1e6 + 0.001, 1e6 + 0.049, 1e6 - 0.001}),
            (Cell{20000000, 20000000, 19999999}));
}

TEST(Grid, findsEveryCellAgainFromItsCentre) {
  test::Random random(2);
  std::size_t num_cases = 0;
  for (const double resolution_m : {0.02, 0.05, 0.1, 0.2, 0.3, 1.0}) {
    const Grid grid(resolution_m);
    for (const std::int32_t area : {0, 20000000, -20000000, 1000000000, -1000000000}) {
      for (int i = 0; i < 1000; ++i, ++num_cases) {
        const Cell cell = test::randomCell(random, areaAround(area));
        const Eigen::Vector3d center = grid.centerOf(CellBox::ofCell(cell));
        ASSERT_EQ(grid.toCell(center), cell) << resolution_m << " m, " << test::seedNote(num_cases);
        // A point within 0.4 voxels of the centre is in the same cell.
        const Eigen::Vector3d near = center + test::randomPoint(random, 0.4 * resolution_m);
        ASSERT_EQ(grid.toCell(near), cell) << resolution_m << " m, " << test::seedNote(num_cases);
      }
    }
  }
  EXPECT_EQ(num_cases, 30000U);
}

TEST(Grid, convertsBetweenMetresAndCellUnits) {
  const Grid grid(0.2);
  EXPECT_TRUE(grid.toCellUnits({1.0, -0.5, 0.0}).isApprox(Eigen::Vector3d(5.0, -2.5, 0.0)));
  EXPECT_TRUE(grid.toMetres({5.0, -2.5, 0.0}).isApprox(Eigen::Vector3d(1.0, -0.5, 0.0)));
  const MetricBox box = grid.toMetricBox({{-1, 0, 5}, {1, 2, 10}});
  EXPECT_TRUE(box.min_m.isApprox(Eigen::Vector3d(-0.2, 0.0, 1.0)));
  EXPECT_TRUE(box.max_m.isApprox(Eigen::Vector3d(0.2, 0.4, 2.0)));
  EXPECT_TRUE(grid.centerOf({{-1, 0, 5}, {1, 2, 10}}).isApprox(Eigen::Vector3d(0.0, 0.2, 1.5)));
}

/// The cells on the x axis of a box from `lower` to `upper`.
std::optional<CellBox> toCellsOnX(const Grid& grid, double lower_m, double upper_m) {
  return grid.toCellBox({{lower_m, 0.0, 0.0}, {upper_m, 1.0, 1.0}});
}

TEST(GridCellBox, holdsEveryCellThatTheBoxOverlaps) {
  const Grid grid(1.0);
  EXPECT_EQ(grid.toCellBox({{0.5, -0.5, 0.0}, {1.5, 0.0, 2.0}}), (CellBox{{0, -1, 0}, {2, 0, 2}}));
  EXPECT_EQ(grid.toCellBox({{-2.0, -1.5, -0.1}, {-1.0, -0.9, 0.1}}),
            (CellBox{{-2, -2, -1}, {-1, 0, 1}}));
}

TEST(GridCellBox, isOneVoxelForABoxBetweenTwoVoxelFacesWhateverTheRounding) {
  std::size_t num_cases = 0;
  for (const double resolution_m : {0.02, 0.05, 0.1, 0.2, 0.3, 0.7}) {
    const Grid grid(resolution_m);
    for (const std::int32_t center : {0, 20000000, -20000000}) {
      for (std::int32_t x = center - 500; x <= center + 500; ++x, ++num_cases) {
        const auto box = toCellsOnX(grid, x * resolution_m, (x + 1) * resolution_m);
        ASSERT_TRUE(box.has_value());
        ASSERT_EQ(box->min.x, x) << resolution_m;
        ASSERT_EQ(box->max.x, x + 1) << resolution_m;
      }
    }
  }
  EXPECT_EQ(num_cases, 18018U);
  const auto box = toCellsOnX(Grid(0.2), 0.6, 0.8);
  ASSERT_TRUE(box.has_value());
  EXPECT_EQ(box->min.x, 3);
  EXPECT_EQ(box->max.x, 4);
}

TEST(GridCellBox, isTheInverseOfToMetricBox) {
  test::Random random(3);
  std::size_t num_cases = 0;
  for (const double resolution_m : {0.02, 0.05, 0.1, 0.2, 0.3}) {
    const Grid grid(resolution_m);
    for (const std::int32_t center : {0, 20000000, -20000000}) {
      for (int i = 0; i < 2000; ++i, ++num_cases) {
        const CellBox box = test::randomBox(random, areaAround(center), 1000);
        ASSERT_EQ(grid.toCellBox(grid.toMetricBox(box)), box)
            << resolution_m << " m, " << test::seedNote(num_cases);
      }
    }
  }
  EXPECT_EQ(num_cases, 30000U);
}

TEST(GridCellBox, toleratesAMillionthOfAVoxelAndNotMore) {
  const Grid grid(1.0);
  EXPECT_EQ(toCellsOnX(grid, 2.0 - 0.9e-6, 3.0 + 0.9e-6), (CellBox{{2, 0, 0}, {3, 1, 1}}));
  EXPECT_EQ(toCellsOnX(grid, 2.0 - 1.1e-6, 3.0 + 1.1e-6), (CellBox{{1, 0, 0}, {4, 1, 1}}));
  EXPECT_EQ(toCellsOnX(grid, 2.0 + 0.9e-6, 3.0 - 0.9e-6), (CellBox{{2, 0, 0}, {3, 1, 1}}));
}

TEST(GridCellBox, isOneVoxelForABoxThinnerThanTheTolerance) {
  const Grid grid(1.0);
  EXPECT_EQ(toCellsOnX(grid, 2.5, 2.5 + 1e-9), (CellBox{{2, 0, 0}, {3, 1, 1}}));
  EXPECT_EQ(toCellsOnX(grid, 3.0, 3.0 + 1e-9), (CellBox{{3, 0, 0}, {4, 1, 1}}));
  EXPECT_EQ(toCellsOnX(grid, 3.0 - 1e-9, 3.0), (CellBox{{2, 0, 0}, {3, 1, 1}}));
  const auto across = toCellsOnX(grid, 3.0 - 1e-9, 3.0 + 1e-9);
  ASSERT_TRUE(across.has_value());
  EXPECT_EQ(across->numVoxels(), 1.0);
}

TEST(GridCellBox, isNothingForABoxThatIsNoBox) {
  const Grid grid(0.1);
  for (int axis = 0; axis < 3; ++axis) {
    MetricBox box{{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}};
    ASSERT_TRUE(grid.toCellBox(box).has_value());
    box.max_m[axis] = 0.0;
    EXPECT_FALSE(grid.toCellBox(box).has_value()) << "flat on axis " << axis;
    box.max_m[axis] = -1.0;
    EXPECT_FALSE(grid.toCellBox(box).has_value()) << "inverted on axis " << axis;
    for (const double bad : {kNan, kInfinity, 1.1e8, 1e300}) {
      box.max_m[axis] = bad;
      EXPECT_FALSE(grid.toCellBox(box).has_value()) << "to " << bad << " on axis " << axis;
      box.max_m[axis] = 1.0;
      box.min_m[axis] = -bad;
      EXPECT_FALSE(grid.toCellBox(box).has_value()) << "from " << -bad << " on axis " << axis;
      box.min_m[axis] = 0.0;
    }
  }
}

TEST(GridCellBox, reachesToTheBordersOfTheGrid) {
  const Grid grid(1.0);
  const double bound = Grid::kMaxCell;
  const auto box = grid.toCellBox({{-bound, -bound, -bound}, {bound, bound, bound}});
  ASSERT_TRUE(box.has_value());
  EXPECT_DOUBLE_EQ(box->numVoxels(), 8.0 * bound * bound * bound);
  EXPECT_FALSE(toCellsOnX(grid, 0.0, bound + 0.001).has_value());
  EXPECT_FALSE(toCellsOnX(grid, -bound - 0.001, 0.0).has_value());
}

}  // namespace
}  // namespace cuboid_mapping
