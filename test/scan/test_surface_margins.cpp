// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/surface_margins.h"

#include "support/failing_allocation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <new>
#include <vector>

namespace cuboid_mapping {
namespace {

constexpr double kReach_m = 0.1;
constexpr float kHeight_m = 1.0F;
constexpr float kRadPerDegree = static_cast<float>(M_PI) / 180.0F;

/// End of a beam of a sensor over a floor. @param elevation  Downwards. All in degrees.
Eigen::Vector3f onFloor(float azimuth, float elevation) {
  const float distance_m = kHeight_m / std::tan(elevation * kRadPerDegree);
  return {distance_m * std::cos(azimuth * kRadPerDegree),
          distance_m * std::sin(azimuth * kRadPerDegree), -kHeight_m};
}

/// Four beams for each degree.
Scan makeFloor() {
  Scan scan;
  for (float azimuth = -180.0F; azimuth < 180.0F; azimuth += 0.5F) {
    for (float elevation = 4.0F; elevation < 45.0F; elevation += 0.5F) {
      scan.points.push_back(onFloor(azimuth, elevation));
    }
  }
  return scan;
}

float elevationOf(const Eigen::Vector3f& end) {
  return std::atan2(kHeight_m, end.head<2>().norm()) / kRadPerDegree;
}

TEST(SurfaceMargins, areWhereABeamIsWithinReachOfTheFloorAllAround) {
  const Scan scan = makeFloor();
  std::vector<float> margins;
  SurfaceMargins(kReach_m, 1).compute(scan, margins);
  ASSERT_EQ(margins.size(), scan.points.size());
  std::size_t num_grazing = 0;
  for (std::size_t i = 0; i < margins.size(); ++i) {
    const float elevation = elevationOf(scan.points[i]);
    if (elevation > 30.0F) {
      EXPECT_EQ(margins[i], 0.0F) << "at " << elevation << " degrees the beam hits the floor";
    } else if (elevation < 22.0F) {
      const float angle = elevation * kRadPerDegree;
      const float expected =
          static_cast<float>(kReach_m) * (std::cos(angle) + std::sin(angle)) / kHeight_m;
      EXPECT_NEAR(margins[i], expected, 0.2F * expected) << scan.points[i].transpose();
      ++num_grazing;
    }
  }
  EXPECT_GT(num_grazing, 20000U);
}

TEST(SurfaceMargins, areNoneOnAWallThatFacesTheSensor) {
  Scan scan;
  for (float y = -1.0F; y < 1.0F; y += 0.02F) {
    for (float z = -1.0F; z < 1.0F; z += 0.02F) scan.points.emplace_back(4.0F, y, z);
  }
  std::vector<float> margins;
  SurfaceMargins(kReach_m, 1).compute(scan, margins);
  for (const float margin : margins) EXPECT_EQ(margin, 0.0F);
}

TEST(SurfaceMargins, ofNoReturnsBeginBeforeWhatTheyPassAndAreNoneFarBesideIt) {
  Scan scan;
  for (float y = -1.0F; y < 1.0F; y += 0.02F) {
    for (float z = -1.0F; z < 1.0F; z += 0.02F) scan.points.emplace_back(4.0F, y, z);
  }
  const std::size_t num_points = scan.points.size();
  const float edge_rad = std::atan2(1.0F, 4.0F);
  for (const float above_rad : {2.0F * kRadPerDegree, 8.0F * kRadPerDegree}) {
    const float elevation_rad = edge_rad + above_rad;
    scan.no_returns.emplace_back(10.0F * std::cos(elevation_rad), 0.0F,
                                 10.0F * std::sin(elevation_rad));
  }
  scan.no_returns.emplace_back(std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F);
  std::vector<float> margins;
  SurfaceMargins(kReach_m, 1).compute(scan, margins);
  ASSERT_EQ(margins.size(), num_points + 3);
  EXPECT_NEAR(10.0F - 10.0F * margins[num_points], 4.0F - 2.0F * kReach_m, 0.2F);
  EXPECT_EQ(margins[num_points + 1], 0.0F);
  EXPECT_EQ(margins[num_points + 2], 0.0F);
}

TEST(SurfaceMargins, areNoneForOddEndsWhichChangeNoOthersAndNeitherDoThreadsOrEarlierScans) {
  using Number = std::numeric_limits<float>;
  const Scan floor = makeFloor();
  std::vector<float> expected;
  SurfaceMargins(kReach_m, 1).compute(floor, expected);

  Scan scan = floor;
  for (const float odd :
       {Number::quiet_NaN(), Number::infinity(), -Number::infinity(), 3e38F, 1e-30F, 0.0F}) {
    scan.open_ends.emplace_back(odd, 0.0F, 0.0F);
    scan.open_ends.emplace_back(0.0F, odd, 0.0F);
    scan.open_ends.emplace_back(0.0F, 0.0F, odd);
  }
  Scan deeper = floor;
  for (Eigen::Vector3f& point : deeper.points) point *= 2.0F;
  const std::size_t num_odd = scan.open_ends.size();
  scan.open_ends.emplace_back(0.0F, 0.0F, 5.0F);
  scan.open_ends.emplace_back(0.0F, 0.0F, -1.0F);
  expected.resize(expected.size() + num_odd + 2, 0.0F);
  for (const int threads : {1, 3}) {
    SurfaceMargins surfaces(kReach_m, threads);
    std::vector<float> margins;
    surfaces.compute(Scan{}, margins);
    EXPECT_TRUE(margins.empty());
    surfaces.compute(deeper, margins);
    surfaces.compute(scan, margins);
    EXPECT_EQ(margins, expected) << threads << " threads";
  }
}

TEST(SurfaceMargins, areThoseOfTheirScanAfterOneThatMemoryRefused) {
  Scan floor = makeFloor();
  floor.no_returns.emplace_back(10.0F, 0.0F, 1.0F);
  std::vector<float> expected;
  SurfaceMargins(kReach_m, 1).compute(floor, expected);
  Scan deeper = floor;
  for (Eigen::Vector3f& point : deeper.points) point *= 2.0F;
  bool has_failed = true;
  for (long number = 0; has_failed; ++number) {
    SurfaceMargins surfaces(kReach_m, 1);
    std::vector<float> margins;
    try {
      const test::FailingAllocation failing(number);
      surfaces.compute(deeper, margins);
      has_failed = false;
    } catch (const std::bad_alloc&) {
    }
    surfaces.compute(floor, margins);
    EXPECT_EQ(margins, expected) << "after allocation " << number;
  }
}

}  // namespace
}  // namespace cuboid_mapping
