// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/cloud_conversions.h"

#include "support/random.h"

#include <gtest/gtest.h>
#include <pcl/point_types.h>
#include <pcl_conversions/pcl_conversions.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <boost/endian/conversion.hpp>

#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <set>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::test::Random;
using cuboid_mapping::test::seedNote;
using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::uint32_t kMaxUint32 = std::numeric_limits<std::uint32_t>::max();

/// Layout of a message; the points follow row by row.
struct CloudSpec {
  std::uint32_t width = 0;
  std::uint32_t height = 1;
  std::array<std::uint8_t, 3> datatypes{PointField::FLOAT32, PointField::FLOAT32,
                                        PointField::FLOAT32};
  std::array<std::uint32_t, 3> offsets{0, 4, 8};
  std::uint32_t point_step = 12;
  std::uint32_t row_padding = 0;
  bool is_bigendian = false;
};

template <typename T, typename BitsT>
void writeAs(double number, bool is_bigendian, std::uint8_t* data) {
  const auto value = static_cast<T>(number);
  BitsT bits;
  std::memcpy(&bits, &value, sizeof(bits));
  if (is_bigendian) {
    boost::endian::native_to_big_inplace(bits);
  } else {
    boost::endian::native_to_little_inplace(bits);
  }
  std::memcpy(data, &bits, sizeof(bits));
}

PointCloud2 makeMessage(const CloudSpec& spec, const std::vector<Eigen::Vector3d>& points) {
  PointCloud2 message;
  message.header.frame_id = "lidar";
  message.width = spec.width;
  message.height = spec.height;
  message.point_step = spec.point_step;
  message.row_step = spec.width * spec.point_step + spec.row_padding;
  message.is_bigendian = spec.is_bigendian ? 1 : 0;
  message.is_dense = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    PointField field;
    field.name = std::string(1, "xyz"[axis]);
    field.offset = spec.offsets[axis];
    field.datatype = spec.datatypes[axis];
    field.count = 1;
    message.fields.push_back(field);
  }
  message.data.assign(std::size_t{message.row_step} * message.height, 0xAB);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::uint8_t* point = message.data.data() + i / spec.width * message.row_step +
                          i % spec.width * message.point_step;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double value = points[i][static_cast<Eigen::Index>(axis)];
      std::uint8_t* data = point + spec.offsets[axis];
      if (spec.datatypes[axis] == PointField::FLOAT64) {
        writeAs<double, std::uint64_t>(value, spec.is_bigendian, data);
      } else {
        writeAs<float, std::uint32_t>(value, spec.is_bigendian, data);
      }
    }
  }
  return message;
}

PointCloud2 makeSmallMessage() {
  CloudSpec spec;
  spec.width = 4;
  spec.height = 3;
  return makeMessage(spec, std::vector<Eigen::Vector3d>(12, Eigen::Vector3d(1, 2, 3)));
}

std::vector<Eigen::Vector3d> makePoints(std::size_t count, Random& random) {
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.emplace_back(random.real(-50, 50), random.real(-50, 50), random.real(-50, 50));
  }
  return points;
}

std::vector<Eigen::Vector3f> toFloat(const std::vector<Eigen::Vector3d>& points) {
  std::vector<Eigen::Vector3f> floats;
  for (const Eigen::Vector3d& point : points) floats.emplace_back(point.cast<float>());
  return floats;
}

CloudPoints convertGood(const PointCloud2& message, const CloudOptions& options = {}) {
  auto result = convertCloud(message, options);
  if (const auto* error = std::get_if<CloudError>(&result)) {
    ADD_FAILURE() << error->text;
    return {};
  }
  return std::get<CloudPoints>(result);
}

TEST(CloudConversions, EveryDatatypeByteOrderAndOrganisationGivesThePoints) {
  Random random(1);
  const std::vector<Eigen::Vector3d> points = makePoints(60, random);
  int num_checked = 0;
  for (int kinds = 0; kinds < 8; ++kinds) {  // Which of x, y, z are FLOAT64.
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
    options.no_return_range_m = 10.0;  // Not for clouds that are not organized.
    const CloudPoints cloud = convertGood(message, options);
    EXPECT_EQ(cloud.points, expected);
    EXPECT_EQ(cloud.num_invalid, 5U);
    EXPECT_EQ(cloud.num_skipped, 5U);
    EXPECT_TRUE(cloud.no_returns.empty());
  }
}

TEST(CloudConversions, ACloudOfNothingButNanIsNoError) {
  CloudSpec spec;
  spec.width = 3;
  const CloudPoints cloud = convertGood(
      makeMessage(spec, std::vector<Eigen::Vector3d>(3, Eigen::Vector3d::Constant(kNan))));
  EXPECT_TRUE(cloud.points.empty());
  EXPECT_EQ(cloud.num_invalid, 3U);
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

TEST(CloudConversions, PaddingAfterTheLastRowMayBeMissing) {
  CloudSpec spec;
  spec.width = 2;
  spec.height = 2;
  spec.row_padding = 5;
  PointCloud2 message = makeMessage(spec, {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 11, 12}});
  message.data.resize(message.data.size() - 5);
  EXPECT_EQ(convertGood(message).points.back(), Eigen::Vector3f(10, 11, 12));
  message.data.resize(message.data.size() - 1);
  EXPECT_EQ(std::get<CloudError>(convertCloud(message)).defect, CloudDefect::kShortData);
}

struct Damage {
  std::string name;
  std::function<void(PointCloud2&)> apply;
  CloudDefect defect;
  std::string text;  ///< That the log has to show.
};

std::vector<Damage> makeDamages() {
  using D = CloudDefect;
  using M = PointCloud2;
  return {
      {"frame", [](M& m) { m.header.frame_id.clear(); }, D::kEmptyFrame, "frame_id is empty"},
      {"width 0", [](M& m) { m.width = 0; }, D::kNoPoints, "(0 x 3)"},
      {"height 0", [](M& m) { m.height = 0; }, D::kNoPoints, "(4 x 0)"},
      {"empty", [](M& m) { m = M(), m.header.frame_id = "a"; }, D::kNoPoints, "(0 x 0)"},
      {"no field", [](M& m) { m.fields.clear(); }, D::kNoXyzFields, "has: none"},
      {"no z", [](M& m) { m.fields.pop_back(); }, D::kNoXyzFields, "has: x, y"},
      {"other name", [](M& m) { m.fields[0].name = "X"; }, D::kNoXyzFields, "has: X, y, z"},
      {"integers", [](M& m) { m.fields[1].datatype = PointField::INT32; }, D::kWrongDatatype,
       "field y has datatype 5"},
      {"datatype 0", [](M& m) { m.fields[0].datatype = 0; }, D::kWrongDatatype, "datatype 0"},
      {"datatype 255", [](M& m) { m.fields[2].datatype = 255; }, D::kWrongDatatype, "255"},
      {"point_step 0", [](M& m) { m.point_step = 0; }, D::kBadLayout, "beyond point_step 0"},
      {"point_step 11", [](M& m) { m.point_step = 11; }, D::kBadLayout, "field z at offset 8"},
      {"offset", [](M& m) { m.fields[0].offset = 9; }, D::kBadLayout, "field x at offset 9"},
      {"offset wraps", [](M& m) { m.fields[0].offset = kMaxUint32 - 1; }, D::kBadLayout, "429496"},
      {"FLOAT64 does not fit", [](M& m) { m.fields[2].datatype = PointField::FLOAT64; },
       D::kBadLayout, "field z at offset 8"},
      {"row_step 0", [](M& m) { m.row_step = 0; }, D::kBadLayout, "row_step 0"},
      {"row_step 47", [](M& m) { m.row_step = 47; }, D::kBadLayout, "row_step 47"},
      {"width wraps", [](M& m) { m.width = 1U << 30; }, D::kBadLayout, "1073741824 points"},
      {"one byte less", [](M& m) { m.data.pop_back(); }, D::kShortData, "143 bytes"},
      {"no data", [](M& m) { m.data.clear(); }, D::kShortData, "0 bytes of data"},
      {"row too many", [](M& m) { m.height = 4; }, D::kShortData, "need 192"},
      {"height wraps", [](M& m) { m.height = kMaxUint32; }, D::kShortData, "4 x 4294967295"},
      {"row_step", [](M& m) { m.row_step = kMaxUint32; }, D::kShortData, "need 8589934638"},
      {"all at their greatest",
       [](M& m) { m.width = m.height = m.row_step = m.point_step = kMaxUint32; }, D::kBadLayout,
       "4294967295"},
      {"a row of 2^64 bytes", [](M& m) { m.height = 1, m.width = m.point_step = kMaxUint32; },
       D::kShortData, "18446744065119617025"},
  };
}

TEST(CloudConversions, EveryDamageIsNamedWithWhatToDo) {
  std::set<CloudDefect> seen;
  for (const Damage& damage : makeDamages()) {
    SCOPED_TRACE(damage.name);
    PointCloud2 message = makeSmallMessage();
    EXPECT_EQ(convertGood(message).points.size(), 12U);
    damage.apply(message);
    message.data.shrink_to_fit();  // So that a sanitizer sees the end of the data.
    const auto result = convertCloud(message);
    const auto* error = std::get_if<CloudError>(&result);
    ASSERT_NE(error, nullptr);
    EXPECT_EQ(toString(error->defect), std::string(toString(damage.defect)));
    EXPECT_NE(error->text.find(damage.text), std::string::npos) << error->text;
    EXPECT_NE(error->text.find(". "), std::string::npos) << error->text;
    seen.insert(error->defect);
  }
  EXPECT_EQ(seen.size(), kNumCloudDefects);
}

TEST(CloudConversions, DefectsHaveNamesOfTheirOwn) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < kNumCloudDefects; ++i) {
    names.insert(toString(static_cast<CloudDefect>(i)));
  }
  EXPECT_EQ(names.size(), kNumCloudDefects);
}

TEST(CloudConversions, TheDefectThatIsCheckedFirstIsReported) {
  PointCloud2 message;
  EXPECT_EQ(std::get<CloudError>(convertCloud(message)).defect, CloudDefect::kEmptyFrame);
}

/// A spinning lidar of 16 rows; every other column has no return.
std::vector<Eigen::Vector3d> makeLidarPoints(const Eigen::Isometry3d& T_cloud_sensor,
                                             bool with_all = false) {
  std::vector<Eigen::Vector3d> points;
  for (int row = 0; row < 16; ++row) {
    for (int column = 0; column < 90; ++column) {
      const double azimuth = 2.0 * M_PI * column / 90.0;
      const double elevation = (row - 8) * M_PI / 90.0;
      const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                                      std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const bool is_return = with_all || column % 2 == 0;
      points.push_back(is_return ? T_cloud_sensor * (20.0 * direction)
                                 : Eigen::Vector3d::Constant(kNan));
    }
  }
  return points;
}

PointCloud2 makeLidarMessage(const Eigen::Isometry3d& T_cloud_sensor, std::uint8_t datatype) {
  CloudSpec spec;
  spec.width = 90;
  spec.height = 16;
  spec.datatypes.fill(datatype);
  spec.offsets = {0, 8, 16};
  spec.point_step = 24;
  return makeMessage(spec, makeLidarPoints(T_cloud_sensor));
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

TEST(CloudConversions, BeamsWithoutReturnAreSkippedWithoutARangeOrAnEstimate) {
  const PointCloud2 good = makeLidarMessage(Eigen::Isometry3d::Identity(), PointField::FLOAT32);
  const CloudPoints not_wanted = convertGood(good);
  EXPECT_TRUE(not_wanted.no_returns.empty());
  EXPECT_EQ(not_wanted.num_skipped, 16U * 45U);

  CloudSpec spec;  // One turn of beams, but as a cloud that is not organized.
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

  // Not in the sensor's frame, and nobody says so.
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

PointCloud2 makeRandomMessage(Random& random) {
  CloudSpec spec;
  spec.width = static_cast<std::uint32_t>(random.integer(1, 24));
  spec.height = static_cast<std::uint32_t>(random.chance(0.3) ? 1 : random.integer(2, 12));
  spec.is_bigendian = random.chance(0.3);
  spec.row_padding = static_cast<std::uint32_t>(random.integer(0, 3));
  std::uint32_t offset = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool is_double = random.chance(0.3);
    offset += static_cast<std::uint32_t>(random.integer(0, 3));
    spec.datatypes[axis] = is_double ? PointField::FLOAT64 : PointField::FLOAT32;
    spec.offsets[axis] = offset;
    offset += is_double ? 8 : 4;
  }
  spec.point_step = offset + static_cast<std::uint32_t>(random.integer(0, 3));
  return makeMessage(spec, makePoints(std::size_t{spec.width} * spec.height, random));
}

/// Numbers on which sums and products go wrong.
std::uint32_t makeNastyNumber(Random& random) {
  switch (random.integer(0, 4)) {
    case 0: return random.chance(0.3) ? 0 : static_cast<std::uint32_t>(random.integer(1, 40));
    case 1: return kMaxUint32 - static_cast<std::uint32_t>(random.integer(0, 40));
    case 2: return 1U << random.integer(0, 31);
    case 3: return (1U << random.integer(0, 31)) - 1;
    default: return static_cast<std::uint32_t>(random.bits());
  }
}

void corrupt(PointCloud2& message, Random& random) {
  PointField& field = message.fields[random.index(message.fields.size())];
  switch (random.integer(0, 12)) {
    case 0: message.width = makeNastyNumber(random); break;
    case 1: message.height = makeNastyNumber(random); break;
    case 2: message.point_step = makeNastyNumber(random); break;
    case 3: message.row_step = makeNastyNumber(random); break;
    case 4: field.offset = makeNastyNumber(random); break;
    case 5: field.datatype = static_cast<std::uint8_t>(random.bits()); break;
    case 6: field.count = makeNastyNumber(random); break;
    case 7: field.name = random.chance(0.5) ? "" : "y"; break;
    case 8: message.data.resize(random.index(message.data.size() + 1)); break;
    case 9: message.data.resize(message.data.size() + random.index(40)); break;
    case 10:
      for (std::uint8_t& byte : message.data) byte = static_cast<std::uint8_t>(random.bits());
      break;
    case 11: message.is_bigendian = static_cast<std::uint8_t>(random.bits()); break;
    default:
      // Still consistent, but huge in one number.
      if (message.height == 1) {
        message.row_step = makeNastyNumber(random);
      } else {
        std::swap(message.width, message.height);
      }
      break;
  }
}

TEST(CloudConversions, CorruptedMessagesAreRefusedOrReadInside) {
  constexpr std::size_t kCases = 20000;
  std::size_t num_done = 0;
  std::size_t num_good = 0;
  std::array<std::size_t, kNumCloudDefects> num_defects{};
  for (std::size_t i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seedNote(i));
    Random random(10000 + i);
    PointCloud2 message = makeRandomMessage(random);
    for (int n = random.integer(1, 3); n > 0; --n) corrupt(message, random);
    message.data.shrink_to_fit();
    CloudOptions options;
    options.no_return_range_m = random.chance(0.5) ? 15.0 : 0.0;
    const auto result = convertCloud(message, options);
    ++num_done;
    if (const auto* error = std::get_if<CloudError>(&result)) {
      EXPECT_FALSE(error->text.empty());
      ++num_defects[static_cast<std::size_t>(error->defect)];
      continue;
    }
    const CloudPoints& cloud = std::get<CloudPoints>(result);
    EXPECT_EQ(cloud.points.size() + cloud.num_invalid, std::size_t{message.width} * message.height);
    EXPECT_EQ(cloud.no_returns.size() + cloud.num_skipped, cloud.num_invalid);
    for (const Eigen::Vector3f& point : cloud.points) EXPECT_TRUE(point.allFinite());
    for (const Eigen::Vector3f& end : cloud.no_returns) EXPECT_TRUE(end.allFinite());
    ++num_good;
  }
  EXPECT_EQ(num_done, kCases);
  EXPECT_GT(num_good, kCases / 10);
  for (std::size_t defect = 1; defect < kNumCloudDefects; ++defect) {  // All but kEmptyFrame.
    EXPECT_GT(num_defects[defect], 100U) << toString(static_cast<CloudDefect>(defect));
  }
}

}  // namespace
}  // namespace cuboid_mapping_ros
