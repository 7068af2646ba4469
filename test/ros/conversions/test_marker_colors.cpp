// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/marker_colors.h"

#include <gtest/gtest.h>

namespace cuboid_mapping_ros {
namespace {

void expectColor(const std_msgs::ColorRGBA& color, double r, double g, double b) {
  EXPECT_NEAR(color.r, r, 1e-5);
  EXPECT_NEAR(color.g, g, 1e-5);
  EXPECT_NEAR(color.b, b, 1e-5);
  EXPECT_EQ(color.a, 1.0F);
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
