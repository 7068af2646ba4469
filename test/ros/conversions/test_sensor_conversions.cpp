// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/sensor_conversions.h"

#include "cuboid_mapping/interop/octomap_parity.h"
#include "cuboid_mapping/ros/mapping/sensor_input.h"
#include "ros/cloud_messages.h"
#include "support/random.h"

#include <gtest/gtest.h>
#include <boost/endian/conversion.hpp>
#include <boost/make_shared.hpp>

#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::test::Random;
using sensor_msgs::CameraInfo;
using sensor_msgs::Image;
using sensor_msgs::LaserScan;

constexpr float kNotANumber = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

LaserScan laserScan(const std::vector<float>& ranges) {
  LaserScan scan;
  scan.header.frame_id = "laser";
  scan.angle_min = -1.5F;
  scan.angle_increment = 0.01F;
  scan.range_min = 0.1F;
  scan.range_max = 30.0F;
  scan.ranges = ranges;
  scan.intensities.assign(ranges.size(), 1.0F);
  return scan;
}

Eigen::Vector3d directionOf(const LaserScan& scan, std::size_t index) {
  const double angle = static_cast<double>(scan.angle_min) +
                       static_cast<double>(index) * static_cast<double>(scan.angle_increment);
  return {std::cos(angle), std::sin(angle), 0.0};
}

/// A 32FC1 image, little-endian, with focal lengths of 50 and 40 pixels.
DepthImage makeDepth(const std::vector<float>& depths_m, std::uint32_t width) {
  const auto image = boost::make_shared<Image>();
  image->header.frame_id = "camera";
  image->width = width;
  image->height = static_cast<std::uint32_t>(depths_m.size()) / width;
  image->encoding = "32FC1";
  image->step = width * 4;
  image->data.resize(depths_m.size() * 4);
  std::memcpy(image->data.data(), depths_m.data(), image->data.size());
  const auto camera = boost::make_shared<CameraInfo>();
  camera->P[0] = 50.0;
  camera->P[5] = 40.0;
  camera->P[2] = 0.5 * width;
  camera->P[6] = 0.5 * image->height;
  return {image, camera};
}

CloudPoints expectGood(const std::variant<CloudPoints, CloudError>& result) {
  if (const auto* error = std::get_if<CloudError>(&result)) {
    ADD_FAILURE() << error->text;
    return {};
  }
  return std::get<CloudPoints>(result);
}

DropReason defectOf(const std::variant<CloudPoints, CloudError>& result) {
  const auto* error = std::get_if<CloudError>(&result);
  EXPECT_NE(error, nullptr);
  if (error == nullptr) return {};
  EXPECT_GT(error->text.size(), 40U);
  return error->defect;
}

/// A reading, and the choice with which it frees the space before it.
struct ReadingCase {
  float reading;
  NoReturnPoints frees_with;  ///< The choice that frees; kNone: no choice does.
};

/// REP 117: the parameter sets the meaning of NaN, +inf, -inf and 0, each by itself.
TEST(SensorConversions, EachReadingOfRep117MeansWhatIsChosen) {
  const std::vector<ReadingCase> cases{
      {kInf, NoReturnPoints::kPlusInf},   {kNotANumber, NoReturnPoints::kNan},
      {0.0F, NoReturnPoints::kZero},      {-kInf, NoReturnPoints::kMinusInf},
      {30.0F, NoReturnPoints::kRangeMax}, {31.0F, NoReturnPoints::kRangeMax},
      {-1.0F, NoReturnPoints::kNone}};
  for (const ReadingCase& test_case : cases) {
    for (unsigned set = 0; set <= static_cast<unsigned>(NoReturnPoints::kAll); ++set) {
      CloudOptions options;
      options.no_return_range_m = 7.0;
      options.no_return_points = static_cast<NoReturnPoints>(set);
      const bool frees = contains(options.no_return_points, test_case.frees_with);
      SCOPED_TRACE(std::to_string(test_case.reading) + " with " + toText(options.no_return_points));
      const LaserScan scan = laserScan({5.0F, test_case.reading});
      const DepthImage depth = makeDepth({5.0F, test_case.reading}, 2);
      std::vector<CloudPoints> clouds{expectGood(convertLaserScan(scan, options))};
      if (test_case.frees_with != NoReturnPoints::kRangeMax) {  // Images have no such limit.
        clouds.push_back(expectGood(convertDepthImage(depth, options)));
      }
      for (const CloudPoints& cloud : clouds) {
        EXPECT_EQ(cloud.points.size(), 1U);
        EXPECT_EQ(cloud.num_invalid, 1U);
        EXPECT_EQ(cloud.no_returns.size(), frees ? 1U : 0U);
        EXPECT_EQ(cloud.num_skipped, frees ? 0U : 1U);
        for (const Eigen::Vector3f& end : cloud.no_returns) EXPECT_NEAR(end.norm(), 7.0F, 1e-4F);
      }
      options.no_return_range_m = 0.0;
      EXPECT_TRUE(expectGood(convertLaserScan(scan, options)).no_returns.empty());
      EXPECT_TRUE(expectGood(convertDepthImage(depth, options)).no_returns.empty());
    }
  }
}

TEST(SensorConversions, TheChoiceOfReadingsIsReadAndWritten) {
  for (unsigned set = 0; set <= static_cast<unsigned>(NoReturnPoints::kAll); ++set) {
    const auto points = static_cast<NoReturnPoints>(set);
    const auto read = parseNoReturnPoints(toText(points));
    ASSERT_TRUE(read) << toText(points);
    EXPECT_EQ(read->first, points);
    EXPECT_TRUE(read->second.empty());
    const auto with_ranges = parseNoReturnPoints(toText(points, {81.91, 5.0}));
    ASSERT_TRUE(with_ranges) << toText(points, {81.91, 5.0});
    EXPECT_EQ(with_ranges->first, points);
    EXPECT_EQ(with_ranges->second, (NoReturnRanges{81.91, 5.0}));
  }
  EXPECT_EQ(toText(NoReturnPoints::kWithNan), "with_nan");
  EXPECT_EQ(parseNoReturnPoints("zero nan"), parseNoReturnPoints("nan zero"));
  for (const char* bad : {"", " ", "inf", "nan, zero", "with_nan zero", "-1", "0", "5 none all"}) {
    EXPECT_FALSE(parseNoReturnPoints(bad)) << bad;
  }
}

TEST(SensorConversions, RangesBeyondTheLimitsOfAScanAreNeither) {
  CloudOptions options;
  options.no_return_range_m = 7.0;
  const CloudPoints cloud =
      expectGood(convertLaserScan(laserScan({0.05F, 0.1F, 29.9F, 30.0F, 30.1F}), options));
  EXPECT_EQ(cloud.points.size(), 2U);
  EXPECT_TRUE(cloud.no_returns.empty());
  EXPECT_EQ(cloud.num_skipped, 3U);
}

TEST(SensorConversions, NamedRangesAreNoReturnsOfKnownDirection) {
  CloudOptions options;
  options.no_return_range_m = 7.0;
  options.no_return_points = NoReturnPoints::kNone;
  options.no_return_ranges_m = {8.19};
  const CloudPoints scan = expectGood(convertLaserScan(laserScan({5.0F, 8.19F, 8.2F}), options));
  EXPECT_EQ(scan.points.size(), 2U);
  ASSERT_EQ(scan.no_returns.size(), 1U);
  EXPECT_NEAR(scan.no_returns[0].norm(), 7.0F, 1e-4F);
  const CloudPoints depth = expectGood(convertDepthImage(makeDepth({5.0F, 8.19F}, 2), options));
  EXPECT_EQ(depth.points.size(), 1U);
  EXPECT_EQ(depth.no_returns.size(), 1U);
  CloudSpec spec;
  spec.width = 3;
  const CloudPoints cloud = convertGood(
      makeMessage(spec, {{0.0, 8.19 * 0.6, 8.19 * 0.8}, {1, 2, 3}, {1, 8.19, 2}}), options);
  EXPECT_EQ(cloud.points.size(), 1U);
  ASSERT_EQ(cloud.no_returns.size(), 2U);
  EXPECT_LT((cloud.no_returns[0] - Eigen::Vector3f(0.0F, 4.2F, 5.6F)).norm(), 1e-4F);
  options.no_return_range_m = 0.0;
  EXPECT_TRUE(expectGood(convertLaserScan(laserScan({5.0F, 8.19F}), options)).no_returns.empty());
}

TEST(SensorConversions, AZeroThatHasMovedWithItsCloudIsNoReturn) {
  CloudSpec spec;
  spec.width = 2;
  CloudOptions options;
  options.T_cloud_sensor.translation() = Eigen::Vector3d(1.2, -0.1, 0.7);
  EXPECT_EQ(convertGood(makeMessage(spec, {{1.2, -0.1, 0.7}, {1, 2, 3}}), options).points.size(),
            1U);
}

TEST(SensorConversions, BeamsOfAScanLieWhereItsAnglesSay) {
  Random random;
  CloudOptions options;
  options.no_return_range_m = 20.0;
  std::vector<float> ranges;
  for (int i = 0; i < 300; ++i) {
    ranges.push_back(i % 3 == 0 ? kInf : static_cast<float>(random.real(0.2, 29.0)));
  }
  const LaserScan scan = laserScan(ranges);
  const CloudPoints cloud = expectGood(convertLaserScan(scan, options));
  ASSERT_EQ(cloud.points.size(), 200U);
  ASSERT_EQ(cloud.no_returns.size(), 100U);
  for (std::size_t i = 0; i < 300; ++i) {
    const bool is_return = i % 3 != 0;
    const Eigen::Vector3d expected =
        (is_return ? static_cast<double>(ranges[i]) : 20.0) * directionOf(scan, i);
    const Eigen::Vector3f& end = is_return ? cloud.points[i - i / 3 - 1] : cloud.no_returns[i / 3];
    EXPECT_LT((end.cast<double>() - expected).norm(), 1e-4);
  }
}

TEST(SensorConversions, DistortionIsAWarning) {
  const DepthImage depth = makeDepth({1.0F, 2.0F}, 2);
  EXPECT_EQ(expectGood(convertDepthImage(depth)).warnings, std::vector<std::string>{});
  const auto bent = boost::make_shared<CameraInfo>(*depth.camera);
  bent->distortion_model = "plumb_bob";
  bent->D = {-0.3, 0.1, 0.0, 0.0, 0.0};
  const auto warnings = expectGood(convertDepthImage({depth.image, bent})).warnings;
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("distortion (plumb_bob)"), std::string::npos) << warnings[0];
}

TEST(SensorConversions, PixelsLieWhereTheCameraSays) {
  const std::vector<float> depths_m{1.0F, 2.0F, 3.0F, 4.0F, 5.0F, 6.0F};
  const DepthImage depth = makeDepth(depths_m, 3);
  const auto expect_points = [&](const DepthImage& of, double fx, double cx, double cy) {
    const CloudPoints cloud = expectGood(convertDepthImage(of));
    ASSERT_EQ(cloud.points.size(), 6U);
    for (int i = 0; i < 6; ++i) {
      const double z = depths_m[static_cast<std::size_t>(i)];
      const Eigen::Vector3d expected((i % 3 - cx) / fx * z, (i / 3 - cy) / (0.8 * fx) * z, z);
      EXPECT_LT((cloud.points[static_cast<std::size_t>(i)].cast<double>() - expected).norm(), 1e-5);
    }
  };
  expect_points(depth, 50.0, 1.5, 1.0);

  auto intrinsics = boost::make_shared<CameraInfo>();
  intrinsics->K[0] = 50.0;
  intrinsics->K[4] = 40.0;
  intrinsics->K[2] = 1.5;
  intrinsics->K[5] = 1.0;
  expect_points({depth.image, intrinsics}, 50.0, 1.5, 1.0);

  auto part = boost::make_shared<CameraInfo>(*depth.camera);
  part->roi.x_offset = 1;
  part->roi.y_offset = 2;
  part->binning_x = 2;
  part->binning_y = 2;
  expect_points({depth.image, part}, 25.0, 0.25, -0.5);

  auto padded = boost::make_shared<Image>();
  padded->header.frame_id = "camera";
  padded->width = 3;
  padded->height = 2;
  padded->encoding = "16UC1";
  padded->is_bigendian = 1;
  padded->step = 8;
  for (int i = 0; i < 6; ++i) {
    std::uint16_t millimetres =
        boost::endian::native_to_big(static_cast<std::uint16_t>(1000 * (i + 1)));
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&millimetres);
    padded->data.insert(padded->data.end(), bytes, bytes + 2);
    if (i == 2) padded->data.insert(padded->data.end(), 2, 0xAB);
  }
  expect_points({padded, depth.camera}, 50.0, 1.5, 1.0);
}

TEST(SensorConversions, WhatCannotBeUsedIsRefusedWithTheReason) {
  EXPECT_EQ(defectOf(convertLaserScan(laserScan({}))), DropReason::kNoPoints);
  EXPECT_EQ(defectOf(convertLaserScan(laserScan({kNotANumber, 50.0F}))),
            DropReason::kNoValidPoints);
  LaserScan scan = laserScan({1.0F});
  scan.angle_increment = kNotANumber;
  EXPECT_EQ(defectOf(convertLaserScan(scan)), DropReason::kBadLayout);

  const DepthImage depth = makeDepth({1.0F, 2.0F}, 2);
  const auto refused = [&](const std::function<void(Image&, CameraInfo&)>& spoil) {
    const auto image = boost::make_shared<Image>(*depth.image);
    const auto camera = boost::make_shared<CameraInfo>(*depth.camera);
    spoil(*image, *camera);
    return defectOf(convertDepthImage({image, camera}));
  };
  EXPECT_EQ(refused([](Image& image, CameraInfo&) { image.width = 0; }), DropReason::kNoPoints);
  EXPECT_EQ(refused([](Image& image, CameraInfo&) { image.encoding = "bgr8"; }),
            DropReason::kWrongDatatype);
  EXPECT_EQ(refused([](Image& image, CameraInfo&) {
              image.step = 7;
              image.data.push_back(0);  // Otherwise its size would give the step.
            }),
            DropReason::kBadLayout);
  EXPECT_EQ(refused([](Image& image, CameraInfo&) { image.height = 4000000000U; }),
            DropReason::kShortData);
  EXPECT_EQ(refused([](Image&, CameraInfo& camera) { camera.P[0] = 0.0; }), DropReason::kBadLayout);
  EXPECT_EQ(refused([](Image&, CameraInfo& camera) { camera.width = 1280; }),
            DropReason::kBadLayout);
  EXPECT_EQ(refused([](Image& image, CameraInfo&) { image.data.assign(8, 0); }),
            DropReason::kNoValidPoints);
}

TEST(SensorConversions, PixelsWithMoreBytesThanTheirEncodingAreRefused) {
  DepthImage depth = makeDepth({1.5F, 2.5F, 3.5F, 4.5F}, 2);
  const auto image = boost::make_shared<Image>(*depth.image);
  image->encoding = "16UC1";
  depth.image = image;
  EXPECT_EQ(defectOf(convertDepthImage(depth)), DropReason::kBadLayout);
  const std::vector<std::uint8_t> padded{0xD0, 7, 0xB8, 0xB, 0, 0, 0, 0, 0xD0, 7, 0xB8, 0xB};
  image->data = padded;
  EXPECT_EQ(expectGood(convertDepthImage(depth)).points.size(), 4U) << "zeros fill the rows";
}

/// Compares the map of one message with OctoMap's map of the same rays, at 5 cm.
void expectParity(const SensorMessage& message, SourceType type,
                  const std::vector<Eigen::Vector3f>& points_sensor) {
  NodeParameters parameters;
  parameters.source.type = type;
  parameters.source.max_range_m = 12.0;
  CloudPoses poses;
  poses.T_map_cloud = Eigen::Translation3d(1.0, 2.0, 0.5) *
                      Eigen::AngleAxisd(0.3, Eigen::Vector3d(0.2, 0.5, 1.0).normalized());
  poses.T_map_sensor = poses.T_map_cloud;
  Source source(parameters, parameters.source);
  const Observed observed = source.input.compute(message, poses);
  const auto* update = observed.update;
  ASSERT_NE(update, nullptr) << observed.error->text;
  cuboid_mapping::CuboidMap map(makeMapConfig(parameters));
  (void)map.apply(*update, source.input.sensorModel());
  octomap::OcTree tree = cuboid_mapping::makeOctomap(makeMapConfig(parameters));
  cuboid_mapping::insertIntoOctomap(
      cuboid_mapping::makeScan(poses.T_map_cloud, poses.T_map_sensor.translation(), points_sensor),
      parameters.source.max_range_m, tree);
  const cuboid_mapping::Agreement agreement = cuboid_mapping::compareWithOctomap(map, tree);
  EXPECT_TRUE(agreement.isExact());
  EXPECT_GT(agreement.voxels, 5000.0);
}

TEST(SensorConversions, ACloudMakesTheMapThatOctomapMakesOfItsRays) {
  Random random;
  CloudSpec spec;
  spec.width = 400;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3f> rays;
  for (std::uint32_t i = 0; i < spec.width; ++i) {
    rays.emplace_back(random.real(-9, 9), random.real(-9, 9), random.real(-2, 2));
    points.push_back(rays.back().cast<double>());
  }
  expectParity(makeSensorMessage(spec, points), SourceType::kPointCloud, rays);
}

TEST(SensorConversions, AScanMakesTheMapThatOctomapMakesOfItsRays) {
  Random random;
  std::vector<float> ranges;
  for (int i = 0; i < 300; ++i) ranges.push_back(static_cast<float>(random.real(0.2, 15.0)));
  const LaserScan scan = laserScan(ranges);
  std::vector<Eigen::Vector3f> points;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    points.push_back((static_cast<double>(ranges[i]) * directionOf(scan, i)).cast<float>());
  }
  expectParity({boost::make_shared<LaserScan>(scan)}, SourceType::kLaserScan, points);
}

TEST(SensorConversions, SurfacesOfASourceAreKeptFromItsBeamsThatClear) {
  for (const SourceUse use : {SourceUse::kBoth, SourceUse::kMark, SourceUse::kClear}) {
    NodeParameters parameters;
    parameters.source.type = SourceType::kLaserScan;
    parameters.source.use = use;
    parameters.source.keep_surfaces = true;
    Source source(parameters, parameters.source);
    CloudPoses poses;
    poses.T_map_cloud = poses.T_map_sensor = Eigen::Isometry3d::Identity();
    LaserScan wall = laserScan(std::vector<float>(300, 4.0F));
    for (std::size_t i = 0; i < wall.ranges.size(); ++i) {
      const double y = directionOf(wall, i).y();
      if (y > 0.05) wall.ranges[i] = static_cast<float>(0.5 / y);  // A wall at y = 0.5 m.
    }
    const SensorMessage scan{boost::make_shared<LaserScan>(wall)};
    const Observed observed = source.input.compute(scan, poses);
    const auto* update = observed.update;
    ASSERT_NE(update, nullptr) << observed.error->text;
    int hits = 0;
    int misses = 0;
    int grazes = 0;
    for (const auto& brick : update->bricks) {
      hits += brick.hits.count();
      misses += brick.misses.count();
      grazes += brick.grazes.count();
    }
    EXPECT_EQ(hits > 0, use != SourceUse::kClear);
    EXPECT_EQ(misses > 0, use != SourceUse::kMark);
    EXPECT_EQ(grazes > 0, use != SourceUse::kMark);
  }
}

TEST(SensorConversions, ADepthImageMakesTheMapThatOctomapMakesOfItsRays) {
  Random random;
  std::vector<float> depths_m;
  for (int i = 0; i < 40 * 30; ++i) depths_m.push_back(static_cast<float>(random.real(0.5, 8.0)));
  const DepthImage depth = makeDepth(depths_m, 40);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 40 * 30; ++i) {
    const auto z = static_cast<double>(depths_m[static_cast<std::size_t>(i)]);
    const Eigen::Vector3d ray((i % 40 - 20.0) / 50.0, (i / 40 - 15.0) / 40.0, 1.0);
    points.push_back((z * ray).cast<float>());
  }
  expectParity({depth}, SourceType::kDepthImage, points);
}

}  // namespace
}  // namespace cuboid_mapping_ros
