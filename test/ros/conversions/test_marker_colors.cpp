// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/marker_colors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace cuboid_mapping_ros {
namespace {

void expectColor(const std_msgs::ColorRGBA& color, double r, double g, double b) {
  EXPECT_NEAR(color.r, r, 1e-5);
  EXPECT_NEAR(color.g, g, 1e-5);
  EXPECT_NEAR(color.b, b, 1e-5);
  EXPECT_EQ(color.a, 1.0F);
}

TEST(MarkerColors, HeightGoesThroughTheRainbowOncePerPeriod) {
  constexpr double kPeriod_m = 6.0;
  for (const double turns : {0.0, 1.0, -1.0, 100.0}) {
    const double base_m = turns * kPeriod_m;
    expectColor(toHeightColor(base_m + 0.0, kPeriod_m), 0, 0, 1);    // blue
    expectColor(toHeightColor(base_m + 1.0, kPeriod_m), 0, 1, 1);    // cyan
    expectColor(toHeightColor(base_m + 2.0, kPeriod_m), 0, 1, 0);    // green
    expectColor(toHeightColor(base_m + 2.5, kPeriod_m), 0.5, 1, 0);  // between
    expectColor(toHeightColor(base_m + 3.0, kPeriod_m), 1, 1, 0);    // yellow
    expectColor(toHeightColor(base_m + 4.0, kPeriod_m), 1, 0, 0);    // red
    expectColor(toHeightColor(base_m + 5.0, kPeriod_m), 1, 0, 1);    // magenta
  }
}

TEST(MarkerColors, HeightColorsAreSaturatedAndWithoutSteps) {
  constexpr double kStep_m = 0.01;
  int num_colors = 0;
  for (double height_m = -20.0; height_m < 20.0; height_m += kStep_m) {
    const auto color = toHeightColor(height_m, 7.5);
    const auto next = toHeightColor(height_m + kStep_m, 7.5);
    EXPECT_NEAR(std::max({color.r, color.g, color.b}), 1.0, 1e-5);
    EXPECT_NEAR(std::min({color.r, color.g, color.b}), 0.0, 1e-5);
    const double change =
        std::abs(color.r - next.r) + std::abs(color.g - next.g) + std::abs(color.b - next.b);
    EXPECT_NEAR(change, 6.0 * kStep_m / 7.5, 1e-4);
    ++num_colors;
  }
  EXPECT_GT(num_colors, 3900);
}

TEST(MarkerColors, ProbabilityGoesFromGreyBlueToRed) {
  expectColor(toProbabilityColor(0.5), 0.45, 0.5, 0.65);
  expectColor(toProbabilityColor(0.75), 0.725, 0.25, 0.325);
  expectColor(toProbabilityColor(1.0), 1, 0, 0);
  expectColor(toProbabilityColor(0.1), 0.45, 0.5, 0.65);
}

TEST(MarkerColors, FreeSpaceIsTranslucent) {
  EXPECT_GT(freeColor().a, 0.0F);
  EXPECT_LT(freeColor().a, 0.5F);
}

TEST(MarkerColors, OfASpanRunOnceFromBlueToRed) {
  const HeightRange span{-2.0, 6.0};
  expectColor(toSpanColor(-2.0, span), 0, 0, 1);
  expectColor(toSpanColor(-50.0, span), 0, 0, 1);
  expectColor(toSpanColor(2.0, span), 0, 1, 0);
  expectColor(toSpanColor(6.0, span), 1, 0, 0);
  expectColor(toSpanColor(900.0, span), 1, 0, 0);
}

TEST(MarkerColors, ASpanIsAnotherOneWhenAnEndHasMovedByATenthOfIt) {
  const HeightRange shown{0.0, 10.0};
  EXPECT_FALSE(isOtherSpan({0.9, 10.9}, shown));
  EXPECT_TRUE(isOtherSpan({-1.1, 10.0}, shown));
  EXPECT_TRUE(isOtherSpan({0.0, 11.1}, shown));
}

}  // namespace
}  // namespace cuboid_mapping_ros
