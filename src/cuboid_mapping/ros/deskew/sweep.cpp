// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/deskew/sweep.h"

#include "cuboid_mapping/ros/conversions/byte_order.h"
#include "cuboid_mapping/ros/conversions/point_bytes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

constexpr double kMaxTime_s = 1.0;
constexpr double kNoTime = std::numeric_limits<double>::quiet_NaN();
constexpr double kNoTimeOfDay = std::numeric_limits<double>::infinity();

std::int32_t sliceOf(double time_s) {
  return static_cast<std::int32_t>(
      std::floor(1e9 * time_s / static_cast<double>(kSliceNanoseconds)));
}

/// Drops slices that are far from the others and have few points. @param counts  Points in each slice.
Slices dropStragglers(const Slices& slices, const std::vector<std::size_t>& counts,
                      std::size_t num_points) {
  constexpr std::int32_t kGap = 100;
  constexpr std::size_t kLeastPart = 100;
  Slices kept;
  std::size_t begin = 0;
  std::size_t num_of_group = 0;
  for (std::size_t i = 0; i < slices.size(); ++i) {
    num_of_group += counts[i];
    if (i + 1 < slices.size() && slices[i + 1] - slices[i] <= kGap) continue;
    if (num_of_group * kLeastPart >= num_points) {
      kept.insert(kept.end(), slices.begin() + static_cast<std::ptrdiff_t>(begin),
                  slices.begin() + static_cast<std::ptrdiff_t>(i + 1));
    }
    begin = i + 1;
    num_of_group = 0;
  }
  return kept;
}

using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;
/// Numbers of a message's times, in their own unit.
struct RawTimes {
  std::vector<double> numbers;
  double usual_unit_s = 1.0;
  double stamp_s = 0.0;  ///< Infinite if the numbers are too coarse for times of day.
};
using Times = std::optional<RawTimes>;

constexpr std::array<const char*, 6> kFieldNames{"time",      "t",          "offset_time",
                                                 "timestamp", "time_stamp", "timeStamp"};
/// Shorter sweeps need no times, ...
constexpr double kLeastSweep_s = 1e-3;
/// ... and in another unit than the usual one they would be slow sweeps in the usual one.
constexpr double kLeastOtherSweep_s = 5e-3;
/// Distance of a short sweep from its stamp.
constexpr double kStampDelay_s = 0.1;

const PointField* findTimeField(const PointCloud2& cloud) {
  for (const char* name : kFieldNames) {
    if (const PointField* field = findField(cloud, name)) return field;
  }
  return nullptr;
}

/// Size of a time; 0 for types that are no times.
std::size_t numBytes(const PointField& field) {
  switch (field.datatype) {
    case PointField::INT32:
    case PointField::UINT32:
    case PointField::FLOAT32: return 4;
    case PointField::FLOAT64: return 8;
    default: return 0;
  }
}

/// @pre numBytes(field) bytes are there.
double readTime(const PointField& field, const std::uint8_t* data, bool is_other_order) {
  switch (field.datatype) {
    case PointField::INT32: return readAs<std::int32_t, std::uint32_t>(data, is_other_order);
    case PointField::UINT32: return readAs<std::uint32_t, std::uint32_t>(data, is_other_order);
    case PointField::FLOAT32: return readAs<float, std::uint32_t>(data, is_other_order);
    default: return readAs<double, std::uint64_t>(data, is_other_order);
  }
}

/// Whether the data holds the field of all points, so that nothing is read outside it.
bool isWhole(const PointCloud2& cloud, const PointField& field) {
  const CloudLayout layout = layoutOf(cloud);
  if (numBytes(field) == 0 || layout.width == 0 || layout.height == 0) return false;
  if (field.offset + std::uint64_t{numBytes(field)} > layout.point_step) return false;
  if (layout.height > 1 && layout.row_step < layout.width * layout.point_step) return false;
  return layout.numBytes() <= cloud.data.size();
}

/// Replaces the times of points without return by NaN.
void keepReturns(const std::vector<bool>& are_returns, std::vector<double>& numbers) {
  for (std::size_t i = 0; i < std::min(are_returns.size(), numbers.size()); ++i) {
    if (!are_returns[i]) numbers[i] = kNoTime;
  }
}

struct TimesReader {
  bool wants_no_returns;

  Times operator()(const PointCloud2::ConstPtr& cloud) const {
    const PointField* field = findTimeField(*cloud);
    if (field == nullptr || !isWhole(*cloud, *field)) return std::nullopt;
    const bool is_other_order = findByteOrder(*cloud).is_other;
    const bool is_whole =
        field->datatype == PointField::INT32 || field->datatype == PointField::UINT32;
    RawTimes times;
    times.usual_unit_s = is_whole ? 1e-9 : 1.0;
    times.stamp_s =
        field->datatype == PointField::FLOAT64 ? cloud->header.stamp.toSec() : kNoTimeOfDay;
    const CloudLayout layout = layoutOf(*cloud);
    times.numbers.reserve(layout.width * layout.height);
    layout.forEachPoint([&](std::size_t offset) {
      const std::uint8_t* data = cloud->data.data() + offset + field->offset;
      times.numbers.push_back(readTime(*field, data, is_other_order));
    });
    if (!wants_no_returns) keepReturns(findReturns(*cloud), times.numbers);
    return times;
  }

  Times operator()(const sensor_msgs::LaserScan::ConstPtr& scan) const {
    if (scan->time_increment == 0.0F) return std::nullopt;
    RawTimes times;
    times.stamp_s = kNoTimeOfDay;
    times.numbers.reserve(scan->ranges.size());
    for (std::size_t i = 0; i < scan->ranges.size(); ++i) {
      times.numbers.push_back(static_cast<double>(i) * static_cast<double>(scan->time_increment));
      const float range_m = scan->ranges[i];
      const bool is_return = range_m >= scan->range_min && range_m < rangeMaxOf(*scan);
      if (!is_return && !wants_no_returns) times.numbers.back() = kNoTime;
    }
    return times;
  }

  Times operator()(const DepthImage& /*depth*/) const { return std::nullopt; }
};

/// A time after the stamp.
double toTime(double number, double unit_s, double stamp_s) {
  const double time_s = unit_s * number;
  return std::abs(time_s) < kMaxTime_s ? time_s : time_s - stamp_s;
}

/// Duration of nine tenths of the sweep, if its times have this unit; nothing if most of them are odd.
std::optional<double> findDuration(const RawTimes& times, double unit_s) {
  constexpr std::size_t kSamples = 1000;
  std::vector<double> good_s;
  std::size_t num_odd = 0;
  const std::size_t step = sampleStep(times.numbers.size(), kSamples);
  for (std::size_t i = 0; i < times.numbers.size(); i += step) {
    const double time_s = toTime(times.numbers[i], unit_s, times.stamp_s);
    if (std::isnan(time_s)) continue;
    std::abs(time_s) < kMaxTime_s ? good_s.push_back(time_s) : (void)++num_odd;
  }
  if (good_s.empty() || good_s.size() < num_odd) return std::nullopt;
  std::sort(good_s.begin(), good_s.end());
  const std::size_t num_left_out = good_s.size() / 20;
  return good_s[good_s.size() - 1 - num_left_out] - good_s[num_left_out];
}

struct TimeUnit {
  double unit_s;
  const char* name;
};

/// The unit that makes a sweep of the times; nothing if the usual one does, or none.
std::optional<TimeUnit> findOtherUnit(const RawTimes& times) {
  if (findDuration(times, times.usual_unit_s).value_or(0.0) >= kLeastSweep_s) return std::nullopt;
  for (const TimeUnit unit : {TimeUnit{1.0, "seconds"}, TimeUnit{1e-3, "milliseconds"},
                              TimeUnit{1e-6, "microseconds"}, TimeUnit{1e-9, "nanoseconds"}}) {
    if (findDuration(times, unit.unit_s).value_or(0.0) >= kLeastOtherSweep_s) return unit;
  }
  return std::nullopt;
}

/// Whether a sweep cannot be that of its stamp: it begins or ends farther from it than it is long. Short sweeps may lie
/// a tenth of a second away, since drivers stamp packets late.
bool isFarFromStamp(const Slices& slices) {
  const std::int32_t duration = slices.back() - slices.front();
  const std::int32_t distance = std::max(slices.front(), -slices.back());
  return distance > std::max(duration, sliceOf(kStampDelay_s));
}

}  // namespace

std::optional<Slices> findSlices(const std::vector<double>& times_s) {
  const std::int32_t limit = sliceOf(kMaxTime_s);
  const std::size_t num_slices =
      2 * static_cast<std::size_t>(limit) + 1;  // Rounding may reach the limit.
  std::vector<std::size_t> count_at(num_slices);
  std::size_t num_good = 0;
  std::size_t num_odd = 0;
  for (const double time_s : times_s) {
    if (std::isnan(time_s)) continue;
    if (std::abs(time_s) < kMaxTime_s) {
      ++count_at.at(static_cast<std::size_t>(std::int64_t{sliceOf(time_s)} + limit));
      ++num_good;
    } else {
      ++num_odd;
    }
  }
  if (num_good == 0 || num_good < num_odd) return std::nullopt;
  Slices slices;
  std::vector<std::size_t> counts;
  for (std::size_t i = 0; i < count_at.size(); ++i) {
    if (count_at[i] == 0) continue;
    slices.push_back(static_cast<std::int32_t>(i) - limit);
    counts.push_back(count_at[i]);
  }
  slices = dropStragglers(slices, counts, num_good);
  if (isFarFromStamp(slices)) return std::nullopt;
  return slices;
}

std::vector<CloudPoints> divideIntoSlices(const CloudPoints& cloud,
                                          const std::vector<double>& times_s,
                                          const Slices& slices) {
  std::vector<CloudPoints> parts(slices.size());
  for (CloudPoints& part : parts) part.anchor_cloud = cloud.anchor_cloud;
  const auto part_of = [&](std::uint32_t number) -> CloudPoints* {
    const double time_s = times_s.at(number);
    if (!(std::abs(time_s) < kMaxTime_s)) return nullptr;
    const auto slice = std::lower_bound(slices.begin(), slices.end(), sliceOf(time_s));
    if (slice == slices.end() || *slice != sliceOf(time_s)) return nullptr;
    return &parts.at(static_cast<std::size_t>(slice - slices.begin()));
  };
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    CloudPoints* part = part_of(cloud.point_numbers.at(i));
    if (part != nullptr) part->points.push_back(cloud.points[i]);
  }
  for (std::size_t i = 0; i < cloud.no_returns.size(); ++i) {
    CloudPoints* part = part_of(cloud.no_return_numbers.at(i));
    if (part != nullptr) part->no_returns.push_back(cloud.no_returns[i]);
  }
  return parts;
}

std::optional<PointTimes> readPointTimes(const SensorMessage& message, bool wants_no_returns,
                                         double unit_s) {
  Times raw = std::visit(TimesReader{wants_no_returns}, message.content);
  if (!raw) return std::nullopt;
  PointTimes times;
  if (unit_s == 0.0) {
    const auto other = findOtherUnit(*raw);
    unit_s = other ? other->unit_s : raw->usual_unit_s;
    if (other) {
      times.warning = std::string("the times of the points are taken as ") + other->name +
                      ", since only these make a sweep of them. If they are not, set time_unit";
    }
  }
  times.times_s = std::move(raw->numbers);
  for (double& time_s : times.times_s) time_s = toTime(time_s, unit_s, raw->stamp_s);
  return times;
}

}  // namespace cuboid_mapping_ros
