// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/scan_filter.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

namespace cuboid_mapping {
namespace {

using Points = std::vector<Eigen::Vector3f>;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Scan makeTestScan() {
  Scan scan;
  scan.origin = {1.0F, 0.0F, 0.0F};
  scan.points = {{1.5F, 0.0F, 0.0F}, {3.0F, 0.0F, 0.0F}, {1.0F, -4.0F, 0.0F}, {1.0F, 0.0F, 9.0F}};
  scan.no_returns = {{1.1F, 0.0F, 0.0F}, {1.0F, 0.0F, 100.0F}};
  return scan;
}

TEST(ScanFilter, WithoutLimitsNothingIsLeftOut) {
  Scan scan = makeTestScan();
  const FilterCounts counts = filterScan(scan, {});
  EXPECT_EQ(scan.points, makeTestScan().points);
  EXPECT_EQ(counts.num_too_near, 0U);
  EXPECT_EQ(counts.num_outside_crop, 0U);
}

TEST(ScanFilter, PointsNearerThanMinRangeToTheOriginAreLeftOut) {
  Scan scan = makeTestScan();
  ScanLimits limits;
  limits.min_range_m = 2.0;  // The second point lies at exactly 2 m.
  const FilterCounts counts = filterScan(scan, limits);
  EXPECT_EQ(scan.points, (Points{{3.0F, 0.0F, 0.0F}, {1.0F, -4.0F, 0.0F}, {1.0F, 0.0F, 9.0F}}));
  EXPECT_EQ(counts.num_too_near, 1U);
  EXPECT_EQ(counts.num_outside_crop, 0U);
}

TEST(ScanFilter, AMinRangeThatIsNaNIsRefused) {
  Scan scan = makeTestScan();
  EXPECT_THROW(filterScan(scan, {std::numeric_limits<double>::quiet_NaN()}), std::invalid_argument);
}

TEST(ScanFilter, PointsOutsideTheCropBoxAreLeftOutItsFacesAreInside) {
  Scan scan = makeTestScan();
  ScanLimits limits;
  limits.crop_map = MetricBox{{1.5, -1.0, -kInfinity}, {3.0, 1.0, kInfinity}};
  const FilterCounts counts = filterScan(scan, limits);
  EXPECT_EQ(scan.points, (Points{{1.5F, 0.0F, 0.0F}, {3.0F, 0.0F, 0.0F}}));
  EXPECT_EQ(counts.num_outside_crop, 2U);
}

TEST(ScanFilter, EachFaceOfTheCropBoxCutsOnItsOwn) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool is_upper : {false, true}) {
      Scan scan;
      scan.points.assign(2, Eigen::Vector3f::Zero());
      scan.points[0][axis] = -1.0F;
      scan.points[1][axis] = 1.0F;
      ScanLimits limits;
      MetricBox& crop = limits.crop_map.emplace();
      crop.min_m.setConstant(-kInfinity);
      crop.max_m.setConstant(kInfinity);
      (is_upper ? crop.max_m : crop.min_m)[axis] = 0.0;
      EXPECT_EQ(filterScan(scan, limits).num_outside_crop, 1U);
      ASSERT_EQ(scan.points.size(), 1U);
      EXPECT_EQ(scan.points[0][axis], is_upper ? -1.0F : 1.0F);
    }
  }
}

TEST(ScanFilter, TheCropBoxIsInTheMapFrameWhateverTheAnchor) {
  Scan scan = makeTestScan();
  scan.anchor_map = {500000.0, 5000000.0, 0.0};
  ScanLimits limits;
  limits.crop_map = MetricBox{{500002.0, 4999999.0, -1.0}, {500004.0, 5000001.0, 1.0}};
  const FilterCounts counts = filterScan(scan, limits);
  EXPECT_EQ(scan.points, (Points{{3.0F, 0.0F, 0.0F}}));
  EXPECT_EQ(counts.num_outside_crop, 3U);
}

TEST(ScanFilter, APointThatFailsBothCountsOnceAsTooNear) {
  Scan scan = makeTestScan();
  ScanLimits limits;
  limits.min_range_m = 1.0;
  limits.crop_map = MetricBox{{10.0, 10.0, 10.0}, {11.0, 11.0, 11.0}};
  const FilterCounts counts = filterScan(scan, limits);
  EXPECT_TRUE(scan.points.empty());
  EXPECT_EQ(counts.num_too_near, 1U);
  EXPECT_EQ(counts.num_outside_crop, 3U);
}

TEST(ScanFilter, PointsThatAreNotNumbersAreLeftOut) {
  Scan scan = makeTestScan();
  scan.points[1].y() = kNan;
  const FilterCounts counts = filterScan(scan, {});
  EXPECT_EQ(scan.points.size(), 3U);
  EXPECT_EQ(counts.num_outside_crop, 1U);
}

TEST(ScanFilter, NoReturnsAllStay) {
  Scan scan = makeTestScan();
  ScanLimits limits;
  limits.min_range_m = 1.0;
  limits.crop_map = MetricBox{{10.0, 10.0, 10.0}, {11.0, 11.0, 11.0}};
  filterScan(scan, limits);
  EXPECT_EQ(scan.no_returns, makeTestScan().no_returns);
}

}  // namespace
}  // namespace cuboid_mapping
