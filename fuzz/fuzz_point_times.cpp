// SPDX-License-Identifier: BSD-3-Clause
// Times of points: clouds whose field of times has any type and place, and scans; divided into slices for deskew.
#include "cuboid_mapping/ros/conversions/point_bytes.h"
#include "cuboid_mapping/ros/deskew/sweep.h"

#include "fuzz_cloud_message.h"
#include "fuzz_target.h"

#include <boost/make_shared.hpp>

#include <array>
#include <cmath>

namespace {

using namespace cuboid_mapping_ros;
using cuboid_mapping::FuzzInput;
using cuboid_mapping::require;
using cuboid_mapping::takeContent;
using cuboid_mapping::takeSize;
using sensor_msgs::PointField;

sensor_msgs::PointCloud2 takeTimedCloud(FuzzInput& input) {
  constexpr std::array<const char*, 6> kNames{"time",      "t",          "offset_time",
                                              "timestamp", "time_stamp", "timeStamp"};
  constexpr std::array<std::uint8_t, 4> kTypes{PointField::FLOAT32, PointField::FLOAT64,
                                               PointField::UINT32, PointField::INT32};
  sensor_msgs::PointCloud2 cloud;
  cloud.header.stamp = {input.take<std::uint32_t>(), takeSize(input, 0) % 1000000000};
  const std::size_t num_fields = 1 + input.upTo(1);
  for (std::size_t i = 0; i < num_fields; ++i) {
    PointField field;
    field.name = kNames.at(input.upTo(kNames.size() - 1));
    field.offset = takeSize(input, static_cast<std::uint32_t>(input.upTo(8)));
    field.count = takeSize(input, 1);
    field.datatype =
        input.upTo(7) == 0 ? input.take<std::uint8_t>() : kTypes.at(input.upTo(kTypes.size() - 1));
    cloud.fields.push_back(field);
  }
  takeContent(input, {4, 16, 16}, cloud);
  return cloud;
}

sensor_msgs::LaserScan takeScan(FuzzInput& input) {
  sensor_msgs::LaserScan scan;
  scan.time_increment = static_cast<float>(input.number());
  scan.ranges.resize(input.take<std::uint16_t>() % 2048);
  return scan;
}

/// Every point is in one slice, and no slice is empty.
void checkSlices(const std::vector<double>& times_s) {
  const auto slices = findSlices(times_s);
  if (!slices) return;
  CloudPoints cloud;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const bool is_return = i % 3 != 0;
    (is_return ? cloud.points : cloud.no_returns).emplace_back(0.0F, 0.0F, 1.0F);
    (is_return ? cloud.point_numbers : cloud.no_return_numbers)
        .push_back(static_cast<std::uint32_t>(i));
  }
  const auto parts = divideIntoSlices(cloud, times_s, *slices);
  require(parts.size() == slices->size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::size_t in_part = parts[i].points.size() + parts[i].no_returns.size();
    require(in_part > 0);
    require(std::abs(middleOf((*slices)[i]).toSec()) < 1.1);
    count += in_part;
  }
  require(count <= times_s.size());  // Points of odd times are left out.
}

}  // namespace

FUZZ_TARGET(fuzz_point_times) {
  FuzzInput input(data, size);
  SensorMessage message;
  std::size_t num_points = 0;
  if (input.upTo(3) == 0) {
    const auto scan = boost::make_shared<sensor_msgs::LaserScan>(takeScan(input));
    num_points = scan->ranges.size();
    message.content = sensor_msgs::LaserScan::ConstPtr(scan);
  } else {
    const auto cloud = boost::make_shared<sensor_msgs::PointCloud2>(takeTimedCloud(input));
    const CloudLayout layout = layoutOf(*cloud);
    num_points = layout.width * layout.height;
    message.content = sensor_msgs::PointCloud2::ConstPtr(cloud);
  }
  const auto times = readPointTimes(message);
  if (!times) return 0;
  require(times->times_s.size() == num_points);
  checkSlices(times->times_s);
  return 0;
}
