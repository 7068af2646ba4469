// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/cloud_conversions.h"

#include "cuboid_mapping/ros/conversions/points.h"
#include "ros/cloud_messages.h"
#include "support/random.h"

#include <gtest/gtest.h>
#include <pcl/point_types.h>
#include <pcl_conversions/pcl_conversions.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <cmath>
#include <limits>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::test::Random;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::uint32_t kMaxUint32 = std::numeric_limits<std::uint32_t>::max();

std::vector<Eigen::Vector3f> toFloat(const std::vector<Eigen::Vector3d>& points) {
  std::vector<Eigen::Vector3f> floats;
  floats.reserve(points.size());
  for (const Eigen::Vector3d& point : points) floats.emplace_back(point.cast<float>());
  return floats;
}

TEST(CloudConversions, EveryDatatypeByteOrderAndOrganisationGivesThePoints) {
  Random random(1);
  const std::vector<Eigen::Vector3d> points = makePoints(60, random);
  int num_checked = 0;
  for (int kinds = 0; kinds < 8; ++kinds) {  // Subsets of x, y, z that are FLOAT64.
    for (const bool is_bigendian : {false, true}) {
      for (const std::uint32_t height : {1U, 5U}) {
        for (const std::uint32_t padding : {0U, 7U}) {
          CloudSpec spec;
          spec.height = height;
          spec.width = 60 / height;
          spec.is_bigendian = is_bigendian;
          spec.row_padding = padding;
          spec.offsets = {17, 1, 9};  // Neither aligned nor in order.
          spec.point_step = 29;
          for (std::size_t axis = 0; axis < 3; ++axis) {
            if ((kinds >> axis & 1) != 0) spec.datatypes[axis] = PointField::FLOAT64;
          }
          const CloudPoints cloud = convertGood(makeMessage(spec, points));
          EXPECT_EQ(cloud.points, toFloat(points));
          EXPECT_EQ(cloud.num_invalid, 0U);
          EXPECT_TRUE(cloud.anchor_cloud.isZero(0.0));
          ++num_checked;
        }
      }
    }
  }
  EXPECT_EQ(num_checked, 64);
}

TEST(CloudConversions, CloudsOfPclGiveWhatPclReads) {
  pcl::PointCloud<pcl::PointXYZI> pcl_cloud(8, 6);
  Random random(2);
  for (pcl::PointXYZI& point : pcl_cloud.points) {
    point.x = static_cast<float>(random.real(-9, 9));
    point.y = static_cast<float>(random.real(-9, 9));
    point.z = static_cast<float>(random.real(-9, 9));
    point.intensity = 0.5F;
  }
  PointCloud2 message;
  pcl::toROSMsg(pcl_cloud, message);
  message.header.frame_id = "lidar";
  std::vector<Eigen::Vector3f> expected;
  for (const pcl::PointXYZI& point : pcl_cloud.points) {
    expected.emplace_back(point.getVector3fMap());
  }
  EXPECT_EQ(convertGood(message).points, expected);
}

TEST(CloudConversions, PointsBecomeACloudAndBack) {
  std::vector<Eigen::Vector3f> points{{1.0F, 2.0F, 3.0F}, {4.0F, 5.0F, 6.5F}};
  const PointCloud2 cloud = toCloud(points, makeHeader("map", ros::Time(7.0)));
  EXPECT_EQ(cloud.header.frame_id, "map");
  EXPECT_EQ(cloud.header.stamp, ros::Time(7.0));
  EXPECT_TRUE(cloud.is_dense != 0);
  EXPECT_EQ(convertGood(cloud).points, points);
  points[0].y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(toCloud(points, {}).is_dense != 0);
}

TEST(CloudConversions, FieldsAreFoundByNameAmongOthers) {
  PointCloud2 message;
  message.header.frame_id = "camera";
  sensor_msgs::PointCloud2Modifier modifier(message);
  modifier.setPointCloud2Fields(5, "intensity", 1, PointField::UINT32, "z", 1, PointField::FLOAT32,
                                "y", 1, PointField::FLOAT32, "normal", 3, PointField::FLOAT32, "x",
                                1, PointField::FLOAT32);
  modifier.resize(2);
  sensor_msgs::PointCloud2Iterator<float> x(message, "x");
  sensor_msgs::PointCloud2Iterator<float> y(message, "y");
  sensor_msgs::PointCloud2Iterator<float> z(message, "z");
  for (int i = 0; i < 2; ++i, ++x, ++y, ++z) {
    *x = 1.0F + static_cast<float>(i);
    *y = 10.0F + static_cast<float>(i);
    *z = 100.0F + static_cast<float>(i);
  }
  const std::vector<Eigen::Vector3f> expected{{1.0F, 10.0F, 100.0F}, {2.0F, 11.0F, 101.0F}};
  EXPECT_EQ(convertGood(message).points, expected);
}

TEST(CloudConversions, PointsThatAreNoReturnAreLeftOutAndCountedWhateverIsDenseSays) {
  CloudSpec spec;
  spec.width = 7;
  spec.datatypes.fill(PointField::FLOAT64);
  spec.offsets = {0, 8, 16};
  spec.point_step = 24;
  PointCloud2 message = makeMessage(spec, {{1, 2, 3},
                                           {kNan, 2, 3},
                                           {1, kInfinity, 3},
                                           {1, 2, -kInfinity},
                                           {0, 0, 0},
                                           {1e300, 0, 0},
                                           {0, 0, 4}});
  const std::vector<Eigen::Vector3f> expected{{1, 2, 3}, {0, 0, 4}};
  for (const bool is_dense : {true, false}) {
    message.is_dense = is_dense ? 1 : 0;
    CloudOptions options;
    options.no_return_range_m = 10.0;  // It does not hold for clouds that are not organized.
    const CloudPoints cloud = convertGood(message, options);
    EXPECT_EQ(cloud.points, expected);
    EXPECT_EQ(cloud.num_invalid, 5U);
    EXPECT_EQ(cloud.num_skipped, 5U);
    EXPECT_TRUE(cloud.no_returns.empty());
  }
}

TEST(CloudConversions, ACloudOfNothingButNanIsRefused) {
  CloudSpec spec;
  spec.width = 3;
  const auto result = convertCloud(
      makeMessage(spec, std::vector<Eigen::Vector3d>(3, Eigen::Vector3d::Constant(kNan))));
  const auto* error = std::get_if<CloudError>(&result);
  ASSERT_NE(error, nullptr);
  EXPECT_EQ(error->defect, DropReason::kNoValidPoints);
  EXPECT_NE(error->text.find("all of its 3 points are NaN"), std::string::npos) << error->text;
}

TEST(CloudConversions, RowStepOfAnUnorganizedCloudDoesNotMatter) {
  CloudSpec spec;
  spec.width = 2;
  PointCloud2 message = makeMessage(spec, {{1, 2, 3}, {4, 5, 6}});
  for (const std::uint32_t row_step : {0U, 1U, kMaxUint32}) {
    message.row_step = row_step;
    EXPECT_EQ(convertGood(message).points.size(), 2U);
  }
}

TEST(CloudConversions, NumbersThatCannotBeRightAreReplacedWhereTheSizeLeavesOneValue) {
  CloudSpec spec;
  spec.width = 2;
  spec.height = 2;
  const std::vector<Eigen::Vector3d> points{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 11, 12}};
  const PointCloud2 good = makeMessage(spec, points);
  for (const std::uint32_t row_step : {0U, 47U, 48U, kMaxUint32}) {
    PointCloud2 message = good;
    message.row_step = row_step;
    EXPECT_EQ(convertGood(message).points, convertGood(good).points) << row_step;
  }
  PointCloud2 message = good;
  message.point_step = 0;
  EXPECT_EQ(convertGood(message).points, convertGood(good).points);
  message = good;
  message.width = 4;
  message.height = 0;
  EXPECT_EQ(convertGood(message).points, convertGood(good).points);
}

TEST(CloudConversions, NoSinglePointLeadsTheOthers) {
  CloudSpec spec;
  spec.datatypes.fill(PointField::FLOAT64);
  spec.offsets = {0, 8, 16};
  spec.point_step = 24;
  spec.width = 5;
  const std::vector<Eigen::Vector3d> near{{1.25, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  for (const Eigen::Vector3d& middle :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(5572094, 466880, 330)}) {
    std::vector<Eigen::Vector3d> points{{1e9, -1e12, 1e20}};
    for (const Eigen::Vector3d& point : near) points.push_back(middle + point);
    points.emplace_back(-1e15, 0, 1);
    const CloudPoints cloud = convertGood(makeMessage(spec, points));
    ASSERT_EQ(cloud.points.size(), 5U);
    for (std::size_t i = 0; i < near.size(); ++i) {
      const Eigen::Vector3d point = cloud.anchor_cloud + cloud.points[i + 1].cast<double>();
      EXPECT_LT((point - points[i + 1]).norm(), 1e-3);
    }
  }
}

TEST(CloudConversions, PaddingAfterTheLastRowMayBeMissing) {
  CloudSpec spec;
  spec.width = 2;
  spec.height = 2;
  spec.row_padding = 5;
  PointCloud2 message = makeMessage(spec, {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 11, 12}});
  message.data.resize(message.data.size() - 5);
  EXPECT_EQ(convertGood(message).points.back(), Eigen::Vector3f(10, 11, 12));
  message.data.resize(message.data.size() - 1);
  EXPECT_EQ(std::get<CloudError>(convertCloud(message)).defect, DropReason::kShortData);
}

const Eigen::Vector3d kNoReturn =
    Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());

/// A spinning lidar of 16 rows; every other column has no return.
std::vector<Eigen::Vector3d> makeLidarPoints(const Eigen::Isometry3d& T_cloud_sensor,
                                             bool with_all = false,
                                             const Eigen::Vector3d& no_return = kNoReturn) {
  std::vector<Eigen::Vector3d> points;
  for (int row = 0; row < 16; ++row) {
    for (int column = 0; column < 90; ++column) {
      const double azimuth = 2.0 * M_PI * column / 90.0;
      const double elevation = (row - 8) * M_PI / 90.0;
      const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                                      std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const bool is_return = with_all || column % 2 == 0;
      points.push_back(is_return ? T_cloud_sensor * (20.0 * direction) : no_return);
    }
  }
  return points;
}

PointCloud2 makeLidarMessage(const Eigen::Isometry3d& T_cloud_sensor, std::uint8_t datatype,
                             const Eigen::Vector3d& no_return = kNoReturn) {
  CloudSpec spec;
  spec.width = 90;
  spec.height = 16;
  spec.datatypes.fill(datatype);
  spec.offsets = {0, 8, 16};
  spec.point_step = 24;
  return makeMessage(spec, makeLidarPoints(T_cloud_sensor, false, no_return));
}

TEST(CloudConversions, BeamsWithoutReturnOfAnOrganizedCloudEndAtTheRange) {
  Eigen::Isometry3d elsewhere = Eigen::Isometry3d::Identity();
  elsewhere.translate(Eigen::Vector3d(3, -2, 1))
      .rotate(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  for (const Eigen::Isometry3d& T_cloud_sensor : {Eigen::Isometry3d::Identity(), elsewhere}) {
    const PointCloud2 message = makeLidarMessage(T_cloud_sensor, PointField::FLOAT32);
    CloudOptions options;
    options.no_return_range_m = 20.0;
    options.T_cloud_sensor = T_cloud_sensor;
    const CloudPoints cloud = convertGood(message, options);
    EXPECT_EQ(cloud.num_invalid, 16U * 45U);
    EXPECT_EQ(cloud.num_skipped, 0U);
    ASSERT_EQ(cloud.no_returns.size(), 16U * 45U);
    const std::vector<Eigen::Vector3d> all = makeLidarPoints(T_cloud_sensor, true);
    for (std::size_t i = 0; i < cloud.no_returns.size(); ++i) {
      EXPECT_LT((cloud.no_returns[i].cast<double>() - all[2 * i + 1]).norm(), 1e-3);
    }
  }
}

/// Whether points free the space before them, for each value of no_return_points.
struct NoReturnCase {
  Eigen::Vector3d point;
  bool frees;
  bool frees_with_nan;
  bool frees_with_zero;
};

TEST(CloudConversions, OnlyPointsThatSayNothingWasMetFreeSpace) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  const std::vector<NoReturnCase> cases{
      {{kInf, kInf, kInf}, true, true, true},    {{1.0, kInf, 0.0}, true, true, true},
      {{1e31, 0.0, 0.0}, true, true, true},      {{kNan, kNan, kNan}, false, true, false},
      {{kInf, kNan, kInf}, false, true, false},  {{-kInf, -kInf, kNan}, false, true, false},
      {{0.0, 0.0, 0.0}, false, false, true},     {{-kInf, -kInf, -kInf}, false, false, false},
      {{kInf, -kInf, 0.0}, false, false, false}, {{-1e31, 0.0, 0.0}, false, false, false}};
  for (const NoReturnCase& test_case : cases) {
    const PointCloud2 message =
        makeLidarMessage(Eigen::Isometry3d::Identity(), PointField::FLOAT64, test_case.point);
    const auto frees = [&message](NoReturnPoints points) {
      CloudOptions options;
      options.no_return_range_m = 20.0;
      options.no_return_points = points;
      const CloudPoints cloud = convertGood(message, options);
      EXPECT_EQ(cloud.points.size(), 16U * 45U);
      EXPECT_EQ(cloud.num_invalid, 16U * 45U);
      EXPECT_EQ(cloud.no_returns.size() + cloud.num_skipped, 16U * 45U);
      EXPECT_TRUE(cloud.no_returns.empty() || cloud.num_skipped == 0U);
      return !cloud.no_returns.empty();
    };
    EXPECT_EQ(frees(NoReturnPoints::kRep117), test_case.frees) << test_case.point.transpose();
    EXPECT_EQ(frees(NoReturnPoints::kWithNan), test_case.frees_with_nan)
        << test_case.point.transpose();
    EXPECT_EQ(frees(NoReturnPoints::kWithZero), test_case.frees_with_zero)
        << test_case.point.transpose();
    EXPECT_TRUE(frees(NoReturnPoints::kAll)) << test_case.point.transpose();
  }
}

TEST(CloudConversions, BeamsWithoutReturnAreSkippedWithoutARangeOrAnEstimate) {
  const PointCloud2 good = makeLidarMessage(Eigen::Isometry3d::Identity(), PointField::FLOAT32);
  const CloudPoints not_wanted = convertGood(good);
  EXPECT_TRUE(not_wanted.no_returns.empty());
  EXPECT_EQ(not_wanted.num_skipped, 16U * 45U);

  CloudSpec spec;  // One turn of beams, in a cloud that is not organized.
  spec.width = 360;
  std::vector<Eigen::Vector3d> turn;
  for (int i = 0; i < 360; ++i) {
    const double azimuth = i * M_PI / 180.0;
    turn.emplace_back(i % 2 == 0 ? kNan : std::cos(azimuth), std::sin(azimuth), 0.0);
  }
  CloudOptions with_range;
  with_range.no_return_range_m = 20.0;
  const CloudPoints not_organized = convertGood(makeMessage(spec, turn), with_range);
  EXPECT_TRUE(not_organized.no_returns.empty());
  EXPECT_EQ(not_organized.num_skipped, 180U);

  // The cloud is not in the sensor's frame, and nothing says so.
  Eigen::Isometry3d elsewhere = Eigen::Isometry3d::Identity();
  elsewhere.translate(Eigen::Vector3d(3, -2, 1));
  const CloudPoints unknown =
      convertGood(makeLidarMessage(elsewhere, PointField::FLOAT32), with_range);
  EXPECT_TRUE(unknown.no_returns.empty());
  EXPECT_EQ(unknown.num_skipped, 16U * 45U);
}

TEST(CloudConversions, FarFloat64CoordinatesKeepTheirMillimetres) {
  Eigen::Isometry3d T_cloud_sensor = Eigen::Isometry3d::Identity();
  T_cloud_sensor.translate(Eigen::Vector3d(412345.678, 5412345.678, 321.5));
  const PointCloud2 message = makeLidarMessage(T_cloud_sensor, PointField::FLOAT64);
  CloudOptions options;
  options.no_return_range_m = 20.0;
  options.T_cloud_sensor = T_cloud_sensor;
  const CloudPoints cloud = convertGood(message, options);
  const cuboid_mapping::Scan scan =
      toScan(cloud, Eigen::Isometry3d::Identity(), T_cloud_sensor.translation());
  const std::vector<Eigen::Vector3d> all = makeLidarPoints(T_cloud_sensor, true);
  ASSERT_EQ(scan.points.size(), 16U * 45U);
  ASSERT_EQ(scan.no_returns.size(), 16U * 45U);
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3d point = scan.anchor_map + scan.points[i].cast<double>();
    const Eigen::Vector3d no_return = scan.anchor_map + scan.no_returns[i].cast<double>();
    EXPECT_LT((point - all[2 * i]).norm(), 1e-3);
    EXPECT_LT((no_return - all[2 * i + 1]).norm(), 1e-3);
  }
}

TEST(CloudConversions, ToScanIsMakeScanForCloudsWithoutAnchor) {
  CloudPoints cloud;
  cloud.points = {{1, 2, 3}, {4, 5, 6}};
  cloud.no_returns = {{7, 8, 9}};
  Eigen::Isometry3d T_map_cloud = Eigen::Isometry3d::Identity();
  T_map_cloud.translate(Eigen::Vector3d(1500, 20, 3))
      .rotate(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()));
  const Eigen::Vector3d origin_map = T_map_cloud.translation();
  const cuboid_mapping::Scan expected =
      cuboid_mapping::makeScan(T_map_cloud, origin_map, cloud.points, cloud.no_returns);
  const cuboid_mapping::Scan scan = toScan(cloud, T_map_cloud, origin_map);
  EXPECT_EQ(scan.points, expected.points);
  EXPECT_EQ(scan.no_returns, expected.no_returns);
  EXPECT_EQ(scan.origin, expected.origin);
  EXPECT_EQ(scan.anchor_map, expected.anchor_map);
}

}  // namespace
}  // namespace cuboid_mapping_ros
