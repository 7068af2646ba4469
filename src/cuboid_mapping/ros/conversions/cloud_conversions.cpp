// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/cloud_conversions.h"

#include "cuboid_mapping/geometry/float_anchor.h"
#include "cuboid_mapping/ros/conversions/byte_order.h"
#include "cuboid_mapping/ros/conversions/point_bytes.h"
#include "cuboid_mapping/scan/no_return_beams.h"

#include <algorithm>
#include <array>
#include <cmath>

// sensor_msgs::PointCloud2ConstIterator and pcl::fromROSMsg are not used: they trust the numbers of the
// message, and read neither the other byte order nor FLOAT64; the iterator also ignores row_step.

namespace cuboid_mapping_ros {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

/// The fields x, y and z.
using XyzFields = std::array<const PointField*, 3>;

std::size_t sizeOf(const PointField& field) {
  return field.datatype == PointField::FLOAT64 ? sizeof(double) : sizeof(float);
}

CloudError makeError(DropReason defect, const PointCloud2& message, const std::string& what) {
  return describeError(defect, "cloud", message.header, what);
}

XyzFields findFields(const PointCloud2& message) {
  return {findField(message, "x"), findField(message, "y"), findField(message, "z")};
}

std::string listFields(const PointCloud2& message) {
  constexpr std::size_t kMaxNames = 20;
  std::string names;
  for (std::size_t i = 0; i < std::min(kMaxNames, message.fields.size()); ++i) {
    names += (names.empty() ? "" : ", ") + message.fields[i].name;
  }
  return names.empty() ? "none" : names;
}

std::optional<CloudError> checkFields(const PointCloud2& message, const XyzFields& fields) {
  if (std::any_of(fields.begin(), fields.end(), [](const auto* field) { return !field; })) {
    return makeError(DropReason::kNoXyzFields, message,
                     "it needs fields x, y and z, but has: " + listFields(message));
  }
  for (const PointField* field : fields) {
    if (field->datatype == PointField::FLOAT32 || field->datatype == PointField::FLOAT64) continue;
    return makeError(DropReason::kWrongDatatype, message,
                     "field " + field->name + " has datatype " + std::to_string(field->datatype) +
                         ", but must be FLOAT32 (7) or FLOAT64 (8)");
  }
  return std::nullopt;
}

std::optional<CloudError> checkLayout(const PointCloud2& message, const XyzFields& fields) {
  const CloudLayout layout = layoutOf(message);
  const std::uint64_t point_step = layout.point_step;
  const std::uint64_t row_step = layout.row_step;
  for (const PointField* field : fields) {
    if (field->offset + std::uint64_t{sizeOf(*field)} <= point_step) continue;
    return makeError(DropReason::kBadLayout, message,
                     "field " + field->name + " at offset " + std::to_string(field->offset) +
                         " reaches beyond point_step " + std::to_string(point_step));
  }
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const PointField& next = *fields[(i + 1) % fields.size()];
    if (fields[i]->offset + std::uint64_t{sizeOf(*fields[i])} <= next.offset ||
        next.offset + std::uint64_t{sizeOf(next)} <= fields[i]->offset) {
      continue;
    }
    return makeError(DropReason::kBadLayout, message,
                     "fields " + fields[i]->name + " and " + next.name + " overlap");
  }
  const std::uint64_t row_bytes = layout.width * point_step;
  if (layout.height > 1 && row_step < row_bytes) {
    return makeError(DropReason::kBadLayout, message,
                     "row_step " + std::to_string(row_step) + " is less than a row of " +
                         std::to_string(message.width) + " points of " +
                         std::to_string(point_step) + " bytes");
  }
  const std::uint64_t num_bytes = layout.numBytes();
  if (message.data.size() < num_bytes) {
    return makeError(DropReason::kShortData, message,
                     "it has " + std::to_string(message.data.size()) + " bytes of data, but " +
                         std::to_string(message.width) + " x " + std::to_string(message.height) +
                         " points need " + std::to_string(num_bytes));
  }
  return std::nullopt;
}

std::optional<CloudError> checkCloud(const PointCloud2& message, const XyzFields& fields) {
  const CloudLayout layout = layoutOf(message);
  if (layout.width == 0 || layout.height == 0) {
    return makeError(DropReason::kNoPoints, message,
                     "it has no points (" + std::to_string(message.width) + " x " +
                         std::to_string(message.height) + ")");
  }
  if (auto error = checkFields(message, fields)) return error;
  return checkLayout(message, fields);
}

/// Reads points of a checked message.
class PointReader {
 public:
  PointReader(const PointCloud2& message, const XyzFields& fields, double unit_m)
      : message_(message),
        layout_(layoutOf(message)),
        order_(findByteOrder(message)),
        unit_m_(unit_m) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      offsets_[axis] = fields[axis]->offset;
      is_double_[axis] = fields[axis]->datatype == PointField::FLOAT64;
    }
  }

  [[nodiscard]] const CloudLayout& layout() const { return layout_; }

  [[nodiscard]] const ByteOrder& order() const { return order_; }

  [[nodiscard]] bool hasDouble() const { return is_double_[0] || is_double_[1] || is_double_[2]; }

  /// @param offset  Place of the point in the data.
  [[nodiscard]] Eigen::Vector3d read(std::size_t offset) const {
    const std::uint8_t* point = message_.data.data() + offset;
    Eigen::Vector3d xyz;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint8_t* data = point + offsets_[axis];
      xyz[static_cast<Eigen::Index>(axis)] =
          is_double_[axis] ? readAs<double, std::uint64_t>(data, order_.is_other)
                           : readAs<float, std::uint32_t>(data, order_.is_other);
    }
    return unit_m_ * xyz;
  }

 private:
  const PointCloud2& message_;
  CloudLayout layout_;
  ByteOrder order_;
  double unit_m_;
  std::array<std::size_t, 3> offsets_{};
  std::array<bool, 3> is_double_{};
};

/// Whether a point is not NaN, not at the origin, and not infinite.
bool isReturn(const Eigen::Vector3d& point) {
  // NaN fails the comparison.
  return (point.array().abs() <= kMaxReading_m).all() && !point.isZero(0.0);
}

/// Whether a point without return says that its beam met nothing.
bool isNoReturn(const Eigen::Vector3d& point, NoReturnPoints wanted) {
  if (point.hasNaN()) return contains(wanted, NoReturnPoints::kNan);
  if (point.isZero(0.0)) return contains(wanted, NoReturnPoints::kZero);
  const bool is_minus = point.minCoeff() < -kMaxReading_m;
  return contains(wanted, is_minus ? NoReturnPoints::kMinusInf : NoReturnPoints::kPlusInf);
}

/// Calls visit(point) for every point, row by row.
template <typename VisitorT>
void visitPoints(const PointReader& reader, VisitorT visit) {
  reader.layout().forEachPoint([&](std::size_t offset) { visit(reader.read(offset)); });
}

/// Median of each coordinate over a sample of the returns; 0 without any.
Eigen::Vector3d findMedian(const PointReader& reader) {
  constexpr std::size_t kSamples = 1000;
  const std::size_t step = sampleStep(reader.layout().width * reader.layout().height, kSamples);
  std::array<std::vector<double>, 3> samples;
  std::size_t count = 0;
  visitPoints(reader, [&](const Eigen::Vector3d& point) {
    if (!isReturn(point) || count++ % step != 0) return;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      samples[axis].push_back(point[static_cast<Eigen::Index>(axis)]);
    }
  });
  Eigen::Vector3d median = Eigen::Vector3d::Zero();
  for (std::size_t axis = 0; axis < 3 && !samples[axis].empty(); ++axis) {
    median[static_cast<Eigen::Index>(axis)] = quantileOf(samples[axis]);
  }
  return median;
}

/// Finds CloudPoints::anchor_cloud: multiples of 1024 m. An outlier cannot move it.
Eigen::Vector3d findAnchor(const PointReader& reader, const Eigen::Vector3d& sensor_cloud) {
  if (!reader.hasDouble()) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d median = findMedian(reader);
  const double distance_m = (median - sensor_cloud).cwiseAbs().maxCoeff();
  return floatAnchor(distance_m <= kMaxFloatRange_m ? sensor_cloud : median);
}

double unitOf(const CloudOptions& options) {
  return options.length_unit_m > 0.0 ? options.length_unit_m : 1.0;
}

/// Classifies the points of a cloud according to the options.
class PointJudge {
 public:
  enum class Kind : unsigned char { kReturn, kOfNamedRange, kNothing };

  explicit PointJudge(const CloudOptions& options)
      : ranges_m_(options.no_return_ranges_m),
        sensor_from_cloud_(options.T_cloud_sensor.inverse()),
        sensor_cloud_(options.T_cloud_sensor.translation()),
        is_elsewhere_(!options.T_cloud_sensor.matrix().isIdentity(0.0)) {}

  [[nodiscard]] Kind judge(const Eigen::Vector3d& point) const {
    if (!isReturn(point)) return Kind::kNothing;
    if (!is_elsewhere_ && ranges_m_.empty()) return Kind::kReturn;
    // A reading of zero has moved with the cloud, and was rounded to float before.
    constexpr double kAtSensor_m = 1e-4;
    const Eigen::Vector3d beam = point - sensor_cloud_;
    if (is_elsewhere_ && beam.squaredNorm() < kAtSensor_m * kAtSensor_m) return Kind::kNothing;
    if (ranges_m_.empty()) return Kind::kReturn;
    const double range_m = beam.norm();
    const double depth_m = (sensor_from_cloud_ * point).cwiseAbs().maxCoeff();
    const bool is_named = contains(ranges_m_, range_m) || contains(ranges_m_, depth_m);
    return is_named ? Kind::kOfNamedRange : Kind::kReturn;
  }

  [[nodiscard]] Eigen::Vector3d toSensor(const Eigen::Vector3d& point) const {
    return sensor_from_cloud_ * point;
  }

 private:
  const NoReturnRanges& ranges_m_;
  Eigen::Isometry3d sensor_from_cloud_;
  Eigen::Vector3d sensor_cloud_;
  bool is_elsewhere_;
};

/// Adds the end of a beam without return. @param direction_sensor  Of length 1.
void addNoReturn(const Eigen::Vector3d& direction_sensor, std::uint32_t number,
                 const CloudOptions& options, CloudPoints& cloud) {
  const Eigen::Vector3d end_cloud =
      options.T_cloud_sensor * (direction_sensor * options.no_return_range_m);
  cloud.no_returns.emplace_back((end_cloud - cloud.anchor_cloud).cast<float>());
  if (options.wants_numbers) cloud.no_return_numbers.push_back(number);
}

/// Adds beams without return whose directions are estimated from their neighbours.
void addNoReturns(const PointReader& reader, const PointJudge& judge, const CloudOptions& options,
                  CloudPoints& cloud) {
  const CloudLayout& layout = reader.layout();
  std::vector<Eigen::Vector3f> points_sensor;
  std::vector<bool> are_wanted;
  points_sensor.reserve(layout.width * layout.height);
  are_wanted.reserve(points_sensor.capacity());
  visitPoints(reader, [&](const Eigen::Vector3d& point) {
    const bool is_nothing = judge.judge(point) == PointJudge::Kind::kNothing;
    points_sensor.push_back(Eigen::Vector3f::Zero());
    if (!is_nothing) points_sensor.back() = judge.toSensor(point).cast<float>();
    const bool is_zero = is_nothing && isReturn(point);
    are_wanted.push_back(is_zero ? contains(options.no_return_points, NoReturnPoints::kZero)
                                 : isNoReturn(point, options.no_return_points));
  });
  const auto estimate = estimateNoReturnBeams(points_sensor, layout.width, layout.height);
  cloud.no_returns.reserve(estimate.beams.size());
  for (const auto& beam : estimate.beams) {
    if (!are_wanted[beam.index]) continue;
    addNoReturn(beam.direction.cast<double>(), static_cast<std::uint32_t>(beam.index), options,
                cloud);
  }
}

}  // namespace

ConvertedCloud convertCloud(const sensor_msgs::PointCloud2& message, const CloudOptions& options) {
  const XyzFields fields = findFields(message);
  if (auto error = checkCloud(message, fields)) return *error;
  const PointReader reader(message, fields, unitOf(options));
  if (!reader.order().makes_sense) {
    return makeError(DropReason::kBadLayout, message,
                     "most of its coordinates can be no lengths, in either byte order: the offsets "
                     "or datatypes of its fields are not those of its data");
  }
  const PointJudge judge(options);
  const bool wants_no_returns = options.no_return_range_m > 0.0;
  CloudPoints cloud;
  if (!reader.order().warning.empty()) cloud.warnings.push_back(reader.order().warning);
  if (message.data.size() >= 2 * reader.layout().numBytes()) {
    cloud.warnings.push_back(
        "the clouds have data of more points than width and height say: the rest is left out. "
        "Correct them in the driver");
  }
  cloud.anchor_cloud = findAnchor(reader, options.T_cloud_sensor.translation());
  cloud.points.reserve(reader.layout().width * reader.layout().height);
  std::uint32_t number = 0;
  visitPoints(reader, [&](const Eigen::Vector3d& point) {
    const PointJudge::Kind kind = judge.judge(point);
    if (kind == PointJudge::Kind::kReturn) {
      cloud.points.emplace_back((point - cloud.anchor_cloud).cast<float>());
      if (options.wants_numbers) cloud.point_numbers.push_back(number);
    } else {
      ++cloud.num_invalid;
      if (kind == PointJudge::Kind::kOfNamedRange && wants_no_returns) {
        addNoReturn(judge.toSensor(point).normalized(), number, options, cloud);
      }
    }
    ++number;
  });
  if (reader.layout().height > 1 && cloud.num_invalid > 0 && wants_no_returns) {
    addNoReturns(reader, judge, options, cloud);
  }
  if (cloud.points.empty() && cloud.no_returns.empty()) {
    return makeError(
        DropReason::kNoValidPoints, message,
        "all of its " + std::to_string(cloud.num_invalid) + " points are NaN, infinite or zero" +
            (options.no_return_ranges_m.empty() ? "" : ", or of a range of no_return_points"));
  }
  if (auto error = checkUnit(cloud, options, message.header)) return *error;
  cloud.num_skipped = cloud.num_invalid - cloud.no_returns.size();
  return cloud;
}

std::optional<CloudError> checkUnit(const CloudPoints& cloud, const CloudOptions& options,
                                    const std_msgs::Header& header) {
  constexpr double kLeast_m = 1e3;  ///< Farther than lidars on the ground measure.
  constexpr double kMost_m = 2e5;   ///< Farther points are coordinates of the earth, such as UTM.
  constexpr std::size_t kSamples = 1000;
  if (options.length_unit_m > 0.0 || cloud.points.empty()) return std::nullopt;
  const Eigen::Vector3f sensor =
      (options.T_cloud_sensor.translation() - cloud.anchor_cloud).cast<float>();
  std::vector<float> ranges_m;
  for (std::size_t i = 0; i < cloud.points.size(); i += sampleStep(cloud.points.size(), kSamples)) {
    ranges_m.push_back((cloud.points[i] - sensor).norm());
  }
  const auto median_m = static_cast<double>(quantileOf(ranges_m));
  if (median_m < kLeast_m || median_m > kMost_m) return std::nullopt;
  return describeError(DropReason::kWrongUnit, "cloud", header,
                       "as metres, half of its points are more than " +
                           std::to_string(std::llround(median_m)) + " m from the sensor");
}

std::vector<bool> findReturns(const PointCloud2& message) {
  const XyzFields fields = findFields(message);
  std::vector<bool> are_returns;
  if (checkCloud(message, fields)) return are_returns;
  const PointReader reader(message, fields, 1.0);
  are_returns.reserve(reader.layout().width * reader.layout().height);
  visitPoints(reader,
              [&](const Eigen::Vector3d& point) { are_returns.push_back(isReturn(point)); });
  return are_returns;
}

Scan toScan(const CloudPoints& cloud, const Eigen::Isometry3d& T_map_cloud,
            const Eigen::Vector3d& origin_map) {
  return cuboid_mapping::makeScan(T_map_cloud * Eigen::Translation3d(cloud.anchor_cloud),
                                  origin_map, cloud.points, cloud.no_returns);
}

}  // namespace cuboid_mapping_ros
