// SPDX-License-Identifier: BSD-3-Clause
// Scans of a sensor that moves while it measures.
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/ros/deskew/deskew_step.h"
#include "cuboid_mapping/ros/deskew/sweep.h"
#include "cuboid_mapping/ros/mapping/sensor_input.h"
#include "ros/cloud_messages.h"
#include "ros/known_parameters.h"
#include "ros/parameter_groups.h"
#include "support/random.h"
#include "support/snapshots.h"

#include <gtest/gtest.h>
#include <tf2_eigen/tf2_eigen.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::Cell;
using cuboid_mapping::test::Random;
using Times = std::vector<double>;

constexpr double kStamp_s = 1000.0;

/// A cloud whose points have a time in a field after x, y and z.
PointCloud2 makeTimedCloud(const std::string& field, std::uint8_t datatype, const Times& times,
                           const std::vector<Eigen::Vector3d>& points, bool is_bigendian = false) {
  CloudSpec spec;
  spec.width = static_cast<std::uint32_t>(times.size());
  spec.point_step = 24;
  spec.is_bigendian = is_bigendian;
  PointCloud2 cloud = makeMessage(spec, points);
  cloud.header.stamp = ros::Time(kStamp_s);
  PointField time;
  time.name = field;
  time.offset = 14;
  time.datatype = datatype;
  time.count = 1;
  cloud.fields.push_back(time);
  for (std::size_t i = 0; i < times.size(); ++i) {
    std::uint8_t* data = cloud.data.data() + 24 * i + 14;
    switch (datatype) {
      case PointField::FLOAT32: writeAs<float, std::uint32_t>(times[i], is_bigendian, data); break;
      case PointField::FLOAT64: writeAs<double, std::uint64_t>(times[i], is_bigendian, data); break;
      default: writeAs<std::uint32_t, std::uint32_t>(times[i], is_bigendian, data);
    }
  }
  return cloud;
}

SensorMessage toMessage(const PointCloud2& cloud) {
  return {boost::make_shared<PointCloud2>(cloud)};
}

std::vector<Eigen::Vector3d> anyPoints(std::size_t count) {
  return std::vector<Eigen::Vector3d>(count, {1, 2, 3});
}

void expectTimes(const SensorMessage& message, const Times& expected_s, bool has_warning = false) {
  const auto times = readPointTimes(message);
  ASSERT_TRUE(times);
  EXPECT_EQ(times->warning.empty(), !has_warning) << times->warning;
  const Times& times_s = times->times_s;
  ASSERT_EQ(times_s.size(), expected_s.size());
  for (std::size_t i = 0; i < expected_s.size(); ++i) {
    EXPECT_EQ(std::isnan(times_s[i]), std::isnan(expected_s[i])) << i;
    if (!std::isnan(expected_s[i])) {
      EXPECT_NEAR(times_s[i], expected_s[i], 1e-6);
    }
  }
}

TEST(PointTimes, AreThoseOfTheDriversFields) {
  for (const bool is_bigendian : {false, true}) {
    expectTimes(toMessage(makeTimedCloud("timestamp", PointField::FLOAT64, {1000.01e9, 1000.06e9},
                                         anyPoints(2), is_bigendian)),
                {0.01, 0.06}, true);
    expectTimes(toMessage(makeTimedCloud("time", PointField::FLOAT32, {0.0, 0.05, -0.1},
                                         anyPoints(3), is_bigendian)),
                {0.0, 0.05, -0.1});
    expectTimes(
        toMessage(makeTimedCloud("t", PointField::UINT32, {0.0, 99e6}, anyPoints(2), is_bigendian)),
        {0.0, 0.099});
    expectTimes(toMessage(makeTimedCloud("offset_time", PointField::UINT32, {1e6}, anyPoints(1),
                                         is_bigendian)),
                {0.001});
    expectTimes(toMessage(makeTimedCloud("timestamp", PointField::FLOAT64, {kStamp_s + 0.5, 0.02},
                                         anyPoints(2), is_bigendian)),
                {0.5, 0.02});
  }
  const auto coarse = readPointTimes(toMessage(
      makeTimedCloud("time", PointField::FLOAT32,
                     {kStamp_s, std::numeric_limits<double>::quiet_NaN()}, anyPoints(2))));
  EXPECT_FALSE(findSlices(coarse->times_s)) << "a float32 cannot be a time of day";
}

TEST(PointTimes, HaveTheUnitThatMakesASweep) {
  const auto cloud = [](std::uint8_t datatype, const Times& times) {
    return toMessage(makeTimedCloud("t", datatype, times, anyPoints(times.size())));
  };
  expectTimes(cloud(PointField::UINT32, {0.0, 1e5}), {0.0, 0.1}, true);
  expectTimes(cloud(PointField::UINT32, {0.0, 1e6}), {0.0, 0.001});
  expectTimes(cloud(PointField::UINT32, {0.0, 100.0}), {0.0, 0.1}, true);
  expectTimes(cloud(PointField::FLOAT32, {0.0, 50.0, 100.0}), {0.0, 0.05, 0.1}, true);
  expectTimes(cloud(PointField::FLOAT64, {0.0, 5e7, 1e8}), {0.0, 0.05, 0.1}, true);
  expectTimes(cloud(PointField::FLOAT32, {0.0, 0.5, 0.9}), {0.0, 0.5, 0.9});
  expectTimes(cloud(PointField::UINT32, {7.0, 7.0}), {7e-9, 7e-9});
  EXPECT_EQ(readPointTimes(cloud(PointField::UINT32, {0.0, 1e5}), false, 1e-9)->times_s.back(),
            1e-4);
}

TEST(PointTimes, OfPointsThatAreNoReturnsCountOnlyWhereTheyAreWanted) {
  constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
  const auto cloud = toMessage(makeTimedCloud("time", PointField::FLOAT32, {0.0, 0.5},
                                              {{1, 2, 3}, {kNoNumber, kNoNumber, kNoNumber}}));
  expectTimes(cloud, {0.0, kNoNumber});
  EXPECT_EQ(readPointTimes(cloud, true)->times_s, (Times{0.0, 0.5}));
}

TEST(PointTimes, OfRowsAreReadRowByRow) {
  const Times times_s = {0.0, 0.1, 0.2, 0.3};
  PointCloud2 cloud = makeTimedCloud("time", PointField::FLOAT32, times_s, anyPoints(4));
  cloud.width = 2;
  cloud.height = 2;
  cloud.row_step = 2 * cloud.point_step;
  expectTimes(toMessage(cloud), times_s);
  const auto second_row = cloud.data.begin() + cloud.row_step;
  cloud.data.insert(second_row, 8, std::uint8_t{0xFF});  // Rows may end with unused bytes.
  cloud.data.insert(cloud.data.end(), 8, std::uint8_t{0xFF});
  cloud.row_step += 8;
  expectTimes(toMessage(cloud), times_s);
  cloud.row_step = cloud.point_step;  // Too little for a row.
  EXPECT_FALSE(readPointTimes(toMessage(cloud)));
  cloud.width = 1;
  cloud.height = 1;
  cloud.row_step = 0;  // It does not matter for a single row.
  expectTimes(toMessage(cloud), {0.0});
}

TEST(PointTimes, OfAScanGoFromRangeToRange) {
  sensor_msgs::LaserScan scan;
  scan.ranges = {1.0F, 2.0F, 10.0F};
  scan.range_max = 10.0F;
  scan.time_increment = 0.01F;
  expectTimes({boost::make_shared<sensor_msgs::LaserScan>(scan)},
              {0.0, 0.01, std::numeric_limits<double>::quiet_NaN()});
  EXPECT_EQ(
      readPointTimes({boost::make_shared<sensor_msgs::LaserScan>(scan)}, true)->times_s.size(), 3U);
  scan.time_increment = 0.0F;
  EXPECT_FALSE(readPointTimes({boost::make_shared<sensor_msgs::LaserScan>(scan)}));
}

TEST(PointTimes, NothingIsReadOutsideTheData) {
  const PointCloud2 good = makeTimedCloud("time", PointField::FLOAT32, {0.0, 0.1}, anyPoints(2));
  EXPECT_TRUE(readPointTimes(toMessage(good)));
  const auto reads = [&good](const std::function<void(PointCloud2&)>& damage) {
    PointCloud2 cloud = good;
    damage(cloud);
    return readPointTimes(toMessage(cloud)).has_value();
  };
  EXPECT_FALSE(reads([](auto& cloud) { cloud.fields.pop_back(); }));
  EXPECT_FALSE(reads([](auto& cloud) { cloud.fields.back().offset = 21; }));
  EXPECT_FALSE(reads([](auto& cloud) { cloud.fields.back().offset = 0xFFFFFFFF; }));
  EXPECT_FALSE(reads([](auto& cloud) { cloud.fields.back().datatype = PointField::UINT8; }));
  EXPECT_FALSE(reads([](auto& cloud) { cloud.data.pop_back(); }));
  EXPECT_FALSE(reads([](auto& cloud) {
    cloud.point_step = 0;
    cloud.data.pop_back();
  }));
  EXPECT_FALSE(reads([](auto& cloud) { cloud.width = 0; }));
  EXPECT_FALSE(reads([](auto& cloud) { cloud.width = 0xFFFFFFFF; }));
  EXPECT_FALSE(reads([](auto& cloud) { cloud.height = 2; }));
  EXPECT_FALSE(reads([](auto& cloud) {
    cloud.height = 0xFFFFFFFF;
    cloud.row_step = 0xFFFFFFFF;
  }));
}

TEST(Sweep, IsDividedByTime) {
  const Times times_s{0.0, 0.0042, 0.0049, -0.0001, 0.0042};
  const auto slices = findSlices(times_s);
  ASSERT_TRUE(slices);
  EXPECT_EQ(*slices, (Slices{-1, 0, 4}));
  EXPECT_EQ(middleOf(4), ros::Duration(0.0045));
  EXPECT_EQ(middleOf(-1), ros::Duration(-0.0005));
  CloudPoints cloud;
  for (float i = 0.0F; i < 4.0F; i += 1.0F) cloud.points.emplace_back(i, 0.0F, 0.0F);
  cloud.point_numbers = {0, 1, 3, 4};
  cloud.no_returns = {{9.0F, 0.0F, 0.0F}};
  cloud.no_return_numbers = {2};
  const auto parts = divideIntoSlices(cloud, times_s, *slices);
  ASSERT_EQ(parts.size(), 3U);
  EXPECT_EQ(parts[0].points, (std::vector<Eigen::Vector3f>{{2.0F, 0.0F, 0.0F}}));
  EXPECT_EQ(parts[1].points, (std::vector<Eigen::Vector3f>{{0.0F, 0.0F, 0.0F}}));
  EXPECT_EQ(parts[2].points,
            (std::vector<Eigen::Vector3f>{{1.0F, 0.0F, 0.0F}, {3.0F, 0.0F, 0.0F}}));
  EXPECT_EQ(parts[2].no_returns, cloud.no_returns);
  EXPECT_EQ(*findSlices({0.0, 1.0}), Slices{0});
  EXPECT_FALSE(findSlices({0.0, 1.0, 3.6}));
  EXPECT_FALSE(findSlices({-1.5}));
  EXPECT_FALSE(findSlices({0.5, 0.6})) << "nanoseconds of the second, or times of another cloud";
  EXPECT_FALSE(findSlices({-0.5, -0.4}));
  EXPECT_TRUE(findSlices({0.1, 0.2})) << "stamped a sweep too early";
  EXPECT_TRUE(findSlices({0.09, 0.1}));
  EXPECT_FALSE(findSlices({std::numeric_limits<double>::quiet_NaN()}));
  EXPECT_TRUE(findSlices({0.9999, -0.9999}));
  EXPECT_TRUE(findSlices({std::nextafter(1.0, 0.0), std::nextafter(-1.0, 0.0)}));
}

TEST(Sweep, LeavesOutPointsOfOddTimes) {
  Times times_s(200, 0.01);
  times_s[7] = 0.9;
  times_s[8] = 3.6;
  times_s[9] = std::numeric_limits<double>::quiet_NaN();
  const auto slices = findSlices(times_s);
  ASSERT_TRUE(slices);
  EXPECT_EQ(*slices, Slices{10});
  CloudPoints cloud;
  cloud.points.assign(times_s.size(), Eigen::Vector3f::Ones());
  for (std::uint32_t i = 0; i < times_s.size(); ++i) cloud.point_numbers.push_back(i);
  EXPECT_EQ(divideIntoSlices(cloud, times_s, *slices).at(0).points.size(), 197U);
}

/// A lidar that drives along x at 5 m/s and rotates at 2 rad/s.
class MovingSensor : public ::testing::Test {
 protected:
  static constexpr double kResolution_m = 0.1;

  MovingSensor() {
    parameters_.map.resolution_m = kResolution_m;
    parameters_.source.of<DeskewParameters>().is_on = true;
    for (double t = -0.2; t < 0.4; t += 0.005) setPose(t);
  }

  static Eigen::Isometry3d poseAt(double t) {
    return Eigen::Translation3d(5.0 * t, 0.05, 0.05) *
           Eigen::AngleAxisd(2.0 * t, Eigen::Vector3d::UnitZ());
  }

  void setPose(double t) {
    geometry_msgs::TransformStamped transform = tf2::eigenToTransform(poseAt(t));
    transform.header.frame_id = "map";
    transform.header.stamp = ros::Time(kStamp_s + t);
    transform.child_frame_id = "lidar";
    tf_.setTransform(transform, "test");
  }

  /// Points of a wall at x = 8.05 m, as the sensor measured them.
  [[nodiscard]] std::vector<Eigen::Vector3d> seeWall(const Times& times_s) const {
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      const double y_m = -2.0 + 4.0 * static_cast<double>(i) / static_cast<double>(times_s.size());
      points.push_back(poseAt(times_s[i]).inverse() * Eigen::Vector3d(8.05, y_m, 0.05));
    }
    return points;
  }

  /// A map of one message. @return Its voxels; none if it is refused, with the reason in error_.
  std::map<Cell, float> mapOf(const SensorMessage& message) {
    Source source(parameters_, parameters_.source);
    const PoseSearch search = findPoses(tf_, PoseFrames(parameters_, parameters_.source),
                                        message.header(), source.input.findSlices(message));
    EXPECT_TRUE(search.poses) << search.why;
    if (!search.poses) return {};
    const Observed observed = source.input.compute(message, *search.poses);
    const auto* update = observed.update;
    error_ = observed.error;
    if (update == nullptr) return {};
    cuboid_mapping::CuboidMap map(makeMapConfig(parameters_));
    (void)map.apply(*update, source.input.sensorModel());
    return cuboid_mapping::test::voxelsOf(map);
  }

  static std::size_t countOccupied(const std::map<Cell, float>& voxels, bool of_wall) {
    return static_cast<std::size_t>(
        std::count_if(voxels.begin(), voxels.end(), [&](const auto& voxel) {
          return voxel.second > 0.0F && (voxel.first.x == 80) == of_wall;
        }));
  }

  static Times sweep(std::size_t count) {
    Times times_s;
    for (std::size_t i = 0; i < count; ++i)
      times_s.push_back(0.1 * static_cast<double>(i) / static_cast<double>(count));
    return times_s;
  }

  NodeParameters parameters_;
  TfBuffer tf_;
  std::optional<CloudError> error_;
};

TEST(DeskewParameters, Arrive) {
  const auto read = readInto<DeskewParameters>({{"deskew", true}, {"time_unit", 1e-6}});
  EXPECT_TRUE(read.is_on);
  EXPECT_EQ(read.time_unit_s, 1e-6);
}

TEST_F(MovingSensor, SeesAStraightWallInACloud) {
  const Times times_s = sweep(400);
  const SensorMessage cloud =
      toMessage(makeTimedCloud("time", PointField::FLOAT32, times_s, seeWall(times_s)));
  const auto voxels = mapOf(cloud);
  EXPECT_EQ(countOccupied(voxels, true), 40U);
  EXPECT_EQ(countOccupied(voxels, false), 0U);
  EXPECT_GT(voxels.count({4, 0, 0}), 0U) << "beams start where the sensor was at their time";
  parameters_.source.of<DeskewParameters>().is_on = false;
  const auto smeared = mapOf(cloud);
  EXPECT_GT(countOccupied(smeared, false), 20U);
}

TEST_F(MovingSensor, SeesAStraightWallInAScan) {
  sensor_msgs::LaserScan scan;
  scan.header.frame_id = "lidar";
  scan.header.stamp = ros::Time(kStamp_s);
  scan.angle_min = -0.5F;
  scan.angle_increment = 0.0025F;
  scan.time_increment = 0.00025F;
  scan.range_max = 30.0F;
  for (int i = 0; i < 400; ++i) {
    const Eigen::Isometry3d T_map_lidar = poseAt(0.00025 * i);
    const double angle = -0.5 + 0.0025 * i;
    const Eigen::Vector3d direction =
        T_map_lidar.linear() * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
    scan.ranges.push_back(
        static_cast<float>((8.05 - T_map_lidar.translation().x()) / direction.x()));
  }
  parameters_.source.type = SourceType::kLaserScan;
  const SensorMessage message{boost::make_shared<sensor_msgs::LaserScan>(scan)};
  const auto voxels = mapOf(message);
  EXPECT_GT(countOccupied(voxels, true), 70U);
  EXPECT_EQ(countOccupied(voxels, false), 0U);
  parameters_.source.of<DeskewParameters>().is_on = false;
  EXPECT_GT(countOccupied(mapOf(message), false), 20U);
}

TEST_F(MovingSensor, ACloudWaitsForTheTransformOfItsLastPoint) {
  const Times times_s{0.0, 0.45};
  const SensorMessage cloud =
      toMessage(makeTimedCloud("t", PointField::UINT32, {0.0, 0.45e9}, seeWall(times_s)));
  const Slices slices = findSlices(makeSteps(parameters_, parameters_.source), cloud);
  const PoseFrames frames(parameters_, parameters_.source);
  const PoseSearch search = findPoses(tf_, frames, cloud.header(), slices);
  EXPECT_FALSE(search.poses);
  EXPECT_NE(search.why.find("older than the cloud"), std::string::npos) << search.why;
  for (double t = 0.4; t < 0.5; t += 0.005) setPose(t);
  const auto poses = findPoses(tf_, frames, cloud.header(), slices).poses;
  ASSERT_TRUE(poses);
  EXPECT_EQ(poses->slices, (Slices{0, 450}));
  EXPECT_NEAR(poses->slice_poses.at(1).T_map_cloud.translation().x(), 5.0 * 0.4505, 1e-3);
  EXPECT_NEAR(poses->T_map_cloud.translation().x(), 0.0, 1e-3);
}

TEST_F(MovingSensor, WhatSaysNoTimesIsRefused) {
  const Times times_s = sweep(10);
  PointCloud2 cloud = makeTimedCloud("intensity", PointField::FLOAT32, times_s, seeWall(times_s));
  EXPECT_TRUE(mapOf(toMessage(cloud)).empty());
  ASSERT_TRUE(error_);
  EXPECT_EQ(error_->defect, DropReason::kNoPointTimes);
  EXPECT_NE(error_->text.find("or set deskew to false"), std::string::npos) << error_->text;
  cloud.fields.back().name = "time";
  EXPECT_FALSE(mapOf(toMessage(cloud)).empty());
  cloud.header.stamp = ros::Time();
  EXPECT_TRUE(mapOf(toMessage(cloud)).empty()) << "the latest transform is of no use";
  EXPECT_FALSE(
      mapOf(toMessage(makeTimedCloud("time", PointField::FLOAT32, {0.0, 3.0, 7.0}, anyPoints(3))))
          .empty())
      << "the stamp counts";
}

TEST(Deskew, DoesNotGoWithTheGroundFilter) {
  if (!test::hasParameters({"filter_ground"})) GTEST_SKIP();
  XmlRpc::XmlRpcValue group;
  group["deskew"] = true;
  EXPECT_TRUE(readParameters(group).errors.empty());
  group["filter_ground"] = true;
  ASSERT_EQ(readParameters(group).errors.size(), 1U);
  EXPECT_EQ(readParameters(group).errors[0].message,
            "is true, but does not go with filter_ground: switch one of them off");
}

TEST(Deskew, DoesNotGoWithDepthImages) {
  XmlRpc::XmlRpcValue group;
  group["deskew"] = true;
  group["type"] = "depth_image";
  ASSERT_EQ(readParameters(group).errors.size(), 1U);
  EXPECT_EQ(readParameters(group).errors[0].key, "deskew");
}

}  // namespace
}  // namespace cuboid_mapping_ros
