// SPDX-License-Identifier: BSD-3-Clause
// Messages with inconsistent numbers.

#include "cuboid_mapping/ros/conversions/cloud_conversions.h"
#include "cuboid_mapping/ros/conversions/point_bytes.h"

#include "ros/cloud_messages.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <set>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::test::Random;
using cuboid_mapping::test::seedNote;

constexpr std::uint32_t kHuge = std::numeric_limits<std::uint32_t>::max();

PointCloud2 makeSmallMessage(double unit_m = 1.0) {
  CloudSpec spec;
  spec.width = 4;
  spec.height = 3;
  return makeMessage(spec, std::vector<Eigen::Vector3d>(12, Eigen::Vector3d(1, 2, 3) / unit_m));
}

struct Damage {
  std::string name;
  std::function<void(PointCloud2&)> apply;
  DropReason defect;
  std::string text;  ///< Text that the log must show.
};

std::vector<Damage> makeDamages() {
  using D = DropReason;
  using M = PointCloud2;
  return {
      {"width 0", [](M& m) { m.width = 0; }, D::kNoPoints, "(0 x 3)"},
      {"height 0", [](M& m) { m.height = 0; }, D::kNoPoints, "(4 x 0)"},  // Three rows of data.
      {"empty", [](M& m) { m = M(), m.header.frame_id = "a"; }, D::kNoPoints, "(0 x 0)"},
      {"no field", [](M& m) { m.fields.clear(); }, D::kNoXyzFields, "has: none"},
      {"no z", [](M& m) { m.fields.pop_back(); }, D::kNoXyzFields, "has: x, y"},
      {"other name", [](M& m) { m.fields[0].name = "X"; }, D::kNoXyzFields, "has: X, y, z"},
      {"integers", [](M& m) { m.fields[1].datatype = PointField::INT32; }, D::kWrongDatatype,
       "field y has datatype 5"},
      {"datatype 0", [](M& m) { m.fields[0].datatype = 0; }, D::kWrongDatatype, "datatype 0"},
      {"datatype 255", [](M& m) { m.fields[2].datatype = 255; }, D::kWrongDatatype, "255"},
      {"point_step 0", [](M& m) { m.point_step = 0, m.data.pop_back(); }, D::kBadLayout,
       "beyond point_step 0"},
      {"point_step 11", [](M& m) { m.point_step = 11, m.data.pop_back(); }, D::kBadLayout,
       "field z at offset 8"},
      {"offset", [](M& m) { m.fields[0].offset = 9; }, D::kBadLayout, "field x at offset 9"},
      {"offset wraps", [](M& m) { m.fields[0].offset = kHuge - 1; }, D::kBadLayout, "429496"},
      {"FLOAT64 does not fit", [](M& m) { m.fields[2].datatype = PointField::FLOAT64; },
       D::kBadLayout, "field z at offset 8"},
      {"row_step 0", [](M& m) { m.row_step = 0, m.data.push_back(0); }, D::kBadLayout,
       "row_step 0"},
      {"row_step 47", [](M& m) { m.row_step = 47, m.data.push_back(0); }, D::kBadLayout,
       "row_step 47"},
      {"width wraps", [](M& m) { m.width = 1U << 30; }, D::kBadLayout, "1073741824 points"},
      {"one byte less", [](M& m) { m.data.pop_back(); }, D::kShortData, "143 bytes"},
      {"no data", [](M& m) { m.data.clear(); }, D::kShortData, "0 bytes of data"},
      {"nothing but zeros", [](M& m) { std::fill(m.data.begin(), m.data.end(), 0); },
       D::kNoValidPoints, "all of its 12 points"},
      {"millimetres", [](M& m) { m = makeSmallMessage(1e-3); }, D::kWrongUnit, "3742 m"},
      {"row too many", [](M& m) { m.height = 4; }, D::kShortData, "need 192"},
      {"height wraps", [](M& m) { m.height = kHuge; }, D::kShortData, "4 x 4294967295"},
      {"row_step", [](M& m) { m.row_step = kHuge, m.data.push_back(0); }, D::kShortData,
       "need 8589934638"},
      {"all at their greatest",
       [](M& m) { m.width = m.height = m.row_step = m.point_step = kHuge; }, D::kBadLayout,
       "4294967295"},
      {"a row of 2^64 bytes", [](M& m) { m.height = 1, m.width = m.point_step = kHuge; },
       D::kShortData, "18446744065119617025"},
  };
}

TEST(CloudDamage, EveryDamageIsNamedWithWhatToDo) {
  std::set<DropReason> seen;
  for (const Damage& damage : makeDamages()) {
    SCOPED_TRACE(damage.name);
    PointCloud2 message = makeSmallMessage();
    EXPECT_EQ(convertGood(message).points.size(), 12U);
    damage.apply(message);
    message.data.shrink_to_fit();  // Lets a sanitizer see the end of the data.
    const auto result = convertCloud(message);
    const auto* error = std::get_if<CloudError>(&result);
    ASSERT_NE(error, nullptr);
    EXPECT_EQ(toString(error->defect), std::string(toString(damage.defect)));
    EXPECT_NE(error->text.find(damage.text), std::string::npos) << error->text;
    EXPECT_NE(error->text.find(". "), std::string::npos) << error->text;
    seen.insert(error->defect);
  }
  EXPECT_EQ(seen.size(), kNumCloudDefects - 2)
      << "all but kEmptyFrame, see test_cloud_queue.cpp, and kNoPointTimes, see test_deskew.cpp";
}

TEST(CloudDamage, RoundingErrorsAcrossASingleBeamAreNone) {
  const std::vector<Eigen::Vector3d> beam{{5.0, 3e-16, -3e-16}};
  EXPECT_EQ(convertGood(makeMessage(CloudSpec{1, 1}, beam)).points.size(), 1U);
}

TEST(CloudDamage, DefectsHaveNamesOfTheirOwn) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < kNumCloudDefects; ++i) {
    names.insert(toString(static_cast<DropReason>(i)));
  }
  EXPECT_EQ(names.size(), kNumCloudDefects);
}

TEST(CloudDamage, TheDefectThatIsCheckedFirstIsReported) {
  PointCloud2 message;
  EXPECT_EQ(std::get<CloudError>(convertCloud(message)).defect, DropReason::kNoPoints);
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

/// Numbers for which sums and products overflow.
std::uint32_t makeNastyNumber(Random& random) {
  switch (random.integer(0, 4)) {
    case 0: return random.chance(0.3) ? 0 : static_cast<std::uint32_t>(random.integer(1, 40));
    case 1: return kHuge - static_cast<std::uint32_t>(random.integer(0, 40));
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
    case 10: {
      const bool is_empty = random.chance(0.5);
      for (std::uint8_t& byte : message.data) {
        byte = is_empty ? 0 : static_cast<std::uint8_t>(random.bits());
      }
      break;
    }
    case 11: message.is_bigendian = static_cast<std::uint8_t>(random.bits()); break;
    default:
      // A consistent message with one huge number.
      if (message.height == 1) {
        message.row_step = makeNastyNumber(random);
      } else {
        std::swap(message.width, message.height);
      }
      break;
  }
}

TEST(CloudDamage, CorruptedMessagesAreRefusedOrReadInside) {
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
    const CloudLayout layout = layoutOf(message);
    EXPECT_EQ(cloud.points.size() + cloud.num_invalid, layout.width * layout.height);
    EXPECT_EQ(cloud.no_returns.size() + cloud.num_skipped, cloud.num_invalid);
    for (const Eigen::Vector3f& point : cloud.points) EXPECT_TRUE(point.allFinite());
    for (const Eigen::Vector3f& end : cloud.no_returns) EXPECT_TRUE(end.allFinite());
    ++num_good;
  }
  EXPECT_EQ(num_done, kCases);
  EXPECT_GT(num_good, kCases / 10);
  for (std::size_t i = 0; i < kNumCloudDefects; ++i) {
    const auto defect = static_cast<DropReason>(i);
    const bool is_rare = defect == DropReason::kEmptyFrame || defect == DropReason::kWrongUnit ||
                         defect == DropReason::kNoPointTimes;
    if (!is_rare) {
      EXPECT_GT(num_defects[i], 20U) << toString(defect);
    }
  }
}

}  // namespace
}  // namespace cuboid_mapping_ros
