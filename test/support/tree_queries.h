// SPDX-License-Identifier: BSD-3-Clause
// Every search of an R-tree, compared with a test of each cuboid.
#pragma once

#include "evaluation/rtree.h"
#include "support/cuboid_set.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <vector>

namespace cuboid_mapping::test {

constexpr CuboidFilter kFilters[] = {CuboidFilter::kAll, CuboidFilter::kFree,
                                     CuboidFilter::kOccupied};

inline bool passes(CuboidFilter filter, const Cuboid& cuboid) {
  return filter == CuboidFilter::kAll ||
         (filter == CuboidFilter::kOccupied) == (cuboid.occupancy == Occupancy::kOccupied);
}

/// The cuboids that pass a filter and share a cell with a window, sorted.
inline std::vector<Cuboid> findInBox(const std::vector<Cuboid>& cuboids, const CellBox& window,
                                     CuboidFilter filter) {
  std::vector<Cuboid> found;
  for (const Cuboid& cuboid : cuboids) {
    if (passes(filter, cuboid) && !intersect(cuboid.box, window).isEmpty()) found.push_back(cuboid);
  }
  return sorted(std::move(found));
}

/// Checks visitBox with every filter.
inline void checkBoxSearch(const bench::RTree& tree, const std::vector<Cuboid>& cuboids,
                           const CellBox& window) {
  for (const CuboidFilter filter : kFilters) {
    std::vector<Cuboid> found;
    visitBox(tree, window, filter, [&](const Cuboid& cuboid) {
      found.push_back(cuboid);
      return Visit::kContinue;
    });
    EXPECT_EQ(sorted(std::move(found)), findInBox(cuboids, window, filter)) << window;
  }
}

inline void checkCellSearch(const bench::RTree& tree, const std::vector<Cuboid>& cuboids,
                            const Cell& cell) {
  std::vector<Cuboid> found;
  visitCell(tree, cell, [&](const Cuboid& cuboid) {
    found.push_back(cuboid);
    return Visit::kContinue;
  });
  EXPECT_EQ(sorted(std::move(found)), findInBox(cuboids, CellBox::ofCell(cell), CuboidFilter::kAll))
      << cell;
}

/// Checks visitAll with every filter, size, isEmpty and bounds.
inline void checkContent(const bench::RTree& tree, const std::vector<Cuboid>& cuboids) {
  EXPECT_EQ(tree.size(), cuboids.size());
  EXPECT_EQ(tree.isEmpty(), cuboids.empty());
  std::optional<CellBox> bounds;
  for (const Cuboid& cuboid : cuboids) bounds = unite(bounds.value_or(cuboid.box), cuboid.box);
  EXPECT_EQ(tree.bounds(), bounds);
  for (const CuboidFilter filter : kFilters) {
    std::vector<Cuboid> expected;
    for (const Cuboid& cuboid : cuboids) {
      if (passes(filter, cuboid)) expected.push_back(cuboid);
    }
    EXPECT_EQ(allCuboids(tree, filter), sorted(std::move(expected)));
  }
}

/// Distance of a point from a box, in cells.
inline double distanceTo(const Eigen::Vector3d& point, const CellBox& box) {
  double squared = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double closest = std::min(std::max(point[axis], static_cast<double>(box.min[axis])),
                                    static_cast<double>(box.max[axis]));
    squared += (closest - point[axis]) * (closest - point[axis]);
  }
  return std::sqrt(squared);
}

inline void checkNearestSearch(const bench::RTree& tree, const std::vector<Cuboid>& cuboids,
                               const Eigen::Vector3d& point, double max_distance,
                               CuboidFilter filter) {
  const double tolerance = 1e-14 * (100.0 + point.norm());
  std::vector<Cuboid> near;
  double previous = 0.0;
  visitNearest(tree, point, max_distance, filter, [&](const Cuboid& cuboid, double distance) {
    EXPECT_TRUE(passes(filter, cuboid));
    EXPECT_GE(distance, previous) << "not in the order of distance";
    EXPECT_LE(distance, max_distance);
    EXPECT_NEAR(distance, distanceTo(point, cuboid.box), tolerance) << cuboid;
    previous = distance;
    near.push_back(cuboid);
    return Visit::kContinue;
  });
  std::vector<Cuboid> expected;
  for (const Cuboid& cuboid : cuboids) {
    const double distance = distanceTo(point, cuboid.box);
    // The caller chooses the distance so that no cuboid lies at exactly this distance.
    if (passes(filter, cuboid) && distance <= max_distance) expected.push_back(cuboid);
  }
  EXPECT_EQ(sorted(std::move(near)), sorted(std::move(expected)));
}

/// Checks that a visitor that stops after some visits gets no more.
inline void checkStop(const bench::RTree& tree, std::size_t max_visits) {
  const std::size_t expected = std::min(max_visits, tree.size());
  std::size_t num_visits = 0;
  const auto visit = [&](const Cuboid&) {
    return ++num_visits < max_visits ? Visit::kContinue : Visit::kStop;
  };
  visitAll(tree, CuboidFilter::kAll, visit);
  EXPECT_EQ(num_visits, expected);
  num_visits = 0;
  if (tree.bounds()) visitBox(tree, *tree.bounds(), CuboidFilter::kAll, visit);
  EXPECT_EQ(num_visits, expected);
  num_visits = 0;
  visitNearest(tree, {0.5, 0.5, 0.5}, std::numeric_limits<double>::infinity(), CuboidFilter::kAll,
               [&](const Cuboid& cuboid, double) { return visit(cuboid); });
  EXPECT_EQ(num_visits, expected);
}

}  // namespace cuboid_mapping::test
