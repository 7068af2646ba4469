// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/cloud_checks.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The warnings about one cloud, in one text.
std::string warningsOf(const std::vector<Eigen::Vector3f>& points, bool is_depth,
                       const RangeLimits& limits) {
  CloudChecks checks(is_depth, limits);
  CloudPoints cloud;
  cloud.points = points;
  checks.note(cloud, Eigen::Vector3d::Zero());
  std::string all;
  for (const std::string& warning : checks.takeWarnings()) all += warning + '\n';
  return all;
}

TEST(CloudChecks, PointsTooFarForBeamsAreNamedWithTheCure) {
  const std::vector<Eigen::Vector3f> utm(200, {466880.0F, 5572094.0F, 330.0F});
  for (const double max_range_m : {kInfinity, 50.0}) {
    const std::string said = warningsOf(utm, false, {max_range_m, 6553.5});
    EXPECT_NE(said.find("100 % of the points are more than 6553.5 m"), std::string::npos) << said;
    EXPECT_NE(said.find("sensor_frame"), std::string::npos) << said;
    EXPECT_EQ(said.find("Raise it"), std::string::npos) << said;
  }
}

}  // namespace
}  // namespace cuboid_mapping_ros
