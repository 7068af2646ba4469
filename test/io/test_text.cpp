// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/text.h"

#include <gtest/gtest.h>

#include <limits>

namespace cuboid_mapping {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Text, OneCloudIsNoPlural) {
  EXPECT_EQ(counted(0, "cloud"), "0 clouds");
  EXPECT_EQ(counted(1, "cloud"), "1 cloud");
  EXPECT_EQ(counted(2, "cloud"), "2 clouds");
}

TEST(Text, NumbersHaveNoMoreDigitsThanTheyNeed) {
  EXPECT_EQ(toText(0.25), "0.25");
  EXPECT_EQ(toText(-3.0), "-3");
  EXPECT_EQ(toText(107374182.35), "107374182");
  EXPECT_EQ(toText(1.25e11), "1.25e+11");
  EXPECT_EQ(toText(kNan), "NaN");
  EXPECT_EQ(toText(-kNan), "NaN");
  EXPECT_EQ(toText(-kInfinity), "-inf");
}

TEST(Text, VectorsAreThreeNumbers) {
  EXPECT_EQ(toText(Eigen::Vector3d(1.0, 2.5, -kNan)), "(1, 2.5, NaN)");
}

}  // namespace
}  // namespace cuboid_mapping
