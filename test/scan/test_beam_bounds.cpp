// SPDX-License-Identifier: BSD-3-Clause
// Every walk ends, for all points, and no beam marks more voxels than its bound.
#include "cuboid_mapping/scan/ray_walk.h"
#include "cuboid_mapping/scan/scan_update.h"

#include "support/random_shapes.h"
#include "support/voxel_map.h"
#include "support/walk_cells.h"

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>

namespace cuboid_mapping {
namespace {

constexpr double kAnyRange = std::numeric_limits<double>::infinity();

/// Bound of the steps of a walk between two cells: the least number, and two more on each axis, one because
/// points lie anywhere in their cells, one for rounding.
std::int64_t stepBound(const Ray& ray) {
  std::int64_t bound = 6;
  for (int axis = 0; axis < 3; ++axis) {
    bound += std::abs(std::int64_t{ray.end[axis]} - ray.start[axis]);
  }
  return bound;
}

/// A cursor that counts, and stops when the bound is passed.
class BoundedCursor {
 public:
  explicit BoundedCursor(const Ray& ray) : ray_(&ray), cell_(ray.start), bound_(stepBound(ray)) {}

  void mark() {}
  void advance(int axis) {
    cell_[axis] += ray_->step[axis];
    ++num_steps_;
  }
  [[nodiscard]] bool isAtEnd() const { return cell_ == ray_->end || num_steps_ > bound_; }
  [[nodiscard]] bool isWithinBound() const { return num_steps_ <= bound_; }

 private:
  const Ray* ray_;
  Cell cell_;
  std::int64_t bound_;
  std::int64_t num_steps_ = 0;
};

testing::AssertionResult ends(const Grid& grid, const Eigen::Vector3f& origin,
                              const Eigen::Vector3f& end) {
  const auto ray = test::computeRay(grid, Eigen::Vector3d::Zero(), origin, end);
  if (!ray) return testing::AssertionSuccess() << "refused";
  if (walkRay(*ray, BoundedCursor(*ray)).isWithinBound()) return testing::AssertionSuccess();
  return testing::AssertionFailure()
         << "from " << origin.transpose() << " to " << end.transpose() << " at "
         << grid.resolution() << " m: more than " << stepBound(*ray) << " steps";
}

/// Difficult numbers for beams: any exponent, denormal, and so near to a face of a voxel that the
/// difference vanishes.
float awkwardNumber(test::Random& random, double resolution_m) {
  const auto sign = static_cast<float>(2 * random.integer(0, 1) - 1);
  switch (random.integer(0, 5)) {
    case 0: return sign * 0.0F;
    case 1:
      return sign * std::numeric_limits<float>::denorm_min() *
             static_cast<float>(random.integer(1, 1000));
    case 2: return sign * std::ldexp(1.0F, random.integer(-149, -1));
    case 3:
      return std::nextafter(sign * static_cast<float>(random.integer(0, 40) * resolution_m),
                            static_cast<float>(random.integer(-50, 50)));
    case 4: return sign * static_cast<float>(random.integer(0, 1000) * resolution_m);
    default:
      return sign *
             std::ldexp(static_cast<float>(random.integer(1, 1 << 20)), random.integer(-60, -20));
  }
}

Eigen::Vector3f awkwardPoint(test::Random& random, double resolution_m) {
  const float x = awkwardNumber(random, resolution_m);
  const float y = awkwardNumber(random, resolution_m);
  const float z = awkwardNumber(random, resolution_m);
  return {x, y, z};
}

TEST(BeamBounds, aBeamWhoseLengthIsRoundedToNothingPassesItsFirstVoxelOnly) {
  const Grid grid(0.05);
  for (const float tiny : {1e-30F, 1e-38F, 1e-45F, 1e-23F}) {
    const Eigen::Vector3f end(-tiny, -tiny, 0.0F);
    ASSERT_TRUE(ends(grid, Eigen::Vector3f::Zero(), end)) << tiny;
    ASSERT_TRUE(ends(grid, end, Eigen::Vector3f::Zero())) << tiny;
  }
  const auto ray = test::computeRay(grid, Eigen::Vector3d::Zero(), Eigen::Vector3f::Zero(),
                                    {-1e-30F, -1e-30F, 0.0F});
  ASSERT_TRUE(ray.has_value());
  EXPECT_EQ(test::walkCells(*ray), (std::vector<Cell>{{0, 0, 0}}));
}

TEST(BeamBounds, aScanWithSuchABeamHitsTheVoxelOfItsEnd) {
  Scan scan;
  scan.points = {{-1e-30F, -1e-30F, 0.0F}};
  for (const double max_range_m : {kAnyRange, 1.0}) {
    ScanUpdater updater(Grid(0.05), max_range_m);
    const test::ObservedCells expected{{{0, 0, 0}, false}, {{-1, -1, 0}, true}};
    EXPECT_EQ(test::toObservedCells(updater.compute(scan)), expected);
  }
}

TEST(BeamBounds, aBeamWhoseLengthIsRoundedToInfinityIsRefused) {
  // Only a grid of such voxels holds such points.
  const Grid grid(1e15);
  EXPECT_TRUE(grid.toCell({1e20, 0.0, 0.0}).has_value());
  EXPECT_FALSE(
      test::computeRay(grid, Eigen::Vector3d::Zero(), Eigen::Vector3f::Zero(), {1e20F, 0.0F, 0.0F})
          .has_value());
  EXPECT_TRUE(ends(grid, Eigen::Vector3f::Zero(), {1e18F, -1e18F, 1e17F}));
}

TEST(BeamBounds, everyWalkEndsAfterTheStepsBetweenItsCellsAndTwoPerAxis) {
  test::Random random(7);
  std::size_t num_cases = 0;
  for (const double resolution_m : {0.001, 0.05, 0.25, 1.0, 100.0}) {
    const Grid grid(resolution_m);
    for (int i = 0; i < 60000; ++i, ++num_cases) {
      const Eigen::Vector3f origin = awkwardPoint(random, resolution_m);
      Eigen::Vector3f end = awkwardPoint(random, resolution_m);
      if (i % 3 == 0) end = origin + end * 1e-7F;
      if (i % 5 == 0) end[random.integer(0, 2)] = -origin[random.integer(0, 2)];
      ASSERT_TRUE(ends(grid, origin, end)) << test::seedNote(num_cases);
    }
  }
  EXPECT_EQ(num_cases, 300000U);
}

TEST(BeamBounds, everyScanOfSuchBeamsIsCounted) {
  test::Random random(8);
  for (const double max_range_m : {kAnyRange, 5.0, 1e-30}) {
    ScanUpdater updater(Grid(0.05), max_range_m);
    for (std::size_t i = 0; i < 300; ++i) {
      Scan scan;
      scan.origin = awkwardPoint(random, 0.05);
      for (int j = 0; j < 40; ++j) {
        (j % 4 == 0 ? scan.no_returns : scan.points).push_back(awkwardPoint(random, 0.05));
      }
      const ScanUpdate& update = updater.compute(scan);
      ASSERT_EQ(update.num_points + update.num_out_of_range + update.num_too_far, 40U)
          << test::seedNote(i);
    }
  }
}

TEST(BeamBounds, theLongestBeamOfOctomapIsTaken) {
  constexpr double kResolution_m = 0.0625;  // Exact in binary.
  const octomap::OcTree tree(kResolution_m);
  const auto low = static_cast<float>(-32767.5 * kResolution_m);
  const auto high = static_cast<float>(32767.5 * kResolution_m);
  Scan scan;
  scan.origin = {low, high, 0.03F};
  scan.points = {{high, 0.1F, 0.03F}};  // Its list of voxels has 100,000 entries.
  ScanUpdater updater{Grid(kResolution_m)};
  const ScanUpdate& update = updater.compute(scan);
  ASSERT_EQ(update.num_points, 1U);
  ASSERT_EQ(update.num_too_far, 0U);
  octomap::KeyRay keys;
  ASSERT_TRUE(tree.computeRayKeys({low, high, 0.03F}, {high, 0.1F, 0.03F}, keys));
  EXPECT_EQ(test::toObservedCells(update).size(), keys.size() + 1);
}

TEST(BeamBounds, aLongerBeamIsLeftOutAndCounted) {
  const Grid grid(1.0);
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {-1.0F, 1.0F}) {
      Scan scan;
      scan.origin = {0.5F, 0.5F, 0.5F};
      Eigen::Vector3f longest = scan.origin;
      longest[axis] += sign * static_cast<float>(kMaxBeamVoxels);
      Eigen::Vector3f longer = longest;
      longer[axis] += sign;
      Eigen::Vector3f far_out = longest;
      far_out[axis] = sign * 9e6F;
      scan.points = {longest, longer, far_out};
      scan.no_returns = {longer};
      ScanUpdater updater(grid);
      const ScanUpdate& update = updater.compute(scan);
      EXPECT_EQ(update.num_points, 1U);
      EXPECT_EQ(update.num_too_far, 3U);
      EXPECT_EQ(update.num_out_of_range, 0U);
      EXPECT_EQ(test::toObservedCells(update).size(), kMaxBeamVoxels + 1U);
      ScanUpdater cutting(grid, 10.0);
      EXPECT_EQ(cutting.compute(scan).num_points, 4U) << "cut, they are short enough";
    }
  }
}

TEST(BeamBounds, aBeamThatIsLeftOutMarksNothingOnItsWayEither) {
  // A scan from a border of voxels: the walk's first steps come before all others.
  Scan scan;
  scan.points = {{-4000.0F, 1.0F, 1.0F}};
  for (const double end_margin_m : {0.0, 1.0}) {
    ScanUpdater updater(Grid(0.05), BeamRanges{kAnyRange, end_margin_m});
    const ScanUpdate& update = updater.compute(scan);
    EXPECT_EQ(update.num_too_far, 1U);
    EXPECT_TRUE(update.bricks.empty());
  }
}

TEST(BeamBounds, aLongerBeamIsNotSampledEither) {
  Scan scan;
  scan.points = {{1e6F, 0.0F, 0.0F}};
  BeamSampling sampling;
  sampling.per_m = 1.0;
  ScanUpdater updater(Grid(1.0), kAnyRange, 1, sampling);
  EXPECT_TRUE(updater.compute(scan).samples.empty());
  ScanUpdater cutting(Grid(1.0), 100.0, 1, sampling);
  EXPECT_FALSE(cutting.compute(scan).samples.empty());
}

}  // namespace
}  // namespace cuboid_mapping
