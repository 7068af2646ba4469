// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/cloud_conversions.h"

#include "cuboid_mapping/ros/conversions/point_bytes.h"
#include "cuboid_mapping/scan/no_return_beams.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <sstream>
#include <utility>

// sensor_msgs::PointCloud2ConstIterator and pcl::fromROSMsg are not used: they trust the numbers of
// the message, and know neither the other byte order nor FLOAT64 (nor the iterator row_step).

namespace cuboid_mapping_ros {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

constexpr std::array<const char*, 3> kAxisNames{"x", "y", "z"};
/// Beyond it, float32 steps are wider than 0.5 mm.
constexpr double kMaxFloatRange_m = 8192.0;

/// Fields x, y and z.
using XyzFields = std::array<const PointField*, 3>;

std::size_t sizeOf(const PointField& field) {
  return field.datatype == PointField::FLOAT64 ? sizeof(double) : sizeof(float);
}

CloudError makeError(CloudDefect defect, const PointCloud2& message, const std::string& what,
                     const std::string& advice) {
  return {defect, "cloud in frame '" + message.header.frame_id + "': " + what + ". " + advice};
}

XyzFields findFields(const PointCloud2& message) {
  XyzFields fields{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto field =
        std::find_if(message.fields.begin(), message.fields.end(),
                     [&](const PointField& f) { return f.name == kAxisNames[axis]; });
    if (field != message.fields.end()) fields[axis] = &*field;
  }
  return fields;
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
    return makeError(CloudDefect::kNoXyzFields, message,
                     "it needs fields x, y and z, but has: " + listFields(message),
                     "Connect cloud_in to a topic with 3D points");
  }
  for (const PointField* field : fields) {
    if (field->datatype == PointField::FLOAT32 || field->datatype == PointField::FLOAT64) continue;
    return makeError(CloudDefect::kWrongDatatype, message,
                     "field " + field->name + " has datatype " + std::to_string(field->datatype) +
                         ", but must be FLOAT32 (7) or FLOAT64 (8)",
                     "Configure the driver to publish metres as floating-point numbers");
  }
  return std::nullopt;
}

std::optional<CloudError> checkLayout(const PointCloud2& message, const XyzFields& fields) {
  const std::string advice = "Its description is wrong: fix the program that makes it";
  const std::uint64_t point_step = message.point_step;
  const std::uint64_t row_step = message.row_step;
  for (const PointField* field : fields) {
    if (field->offset + std::uint64_t{sizeOf(*field)} <= point_step) continue;
    return makeError(CloudDefect::kBadLayout, message,
                     "field " + field->name + " at offset " + std::to_string(field->offset) +
                         " reaches beyond point_step " + std::to_string(point_step),
                     advice);
  }
  const std::uint64_t row_bytes = message.width * point_step;
  if (message.height > 1 && row_step < row_bytes) {
    return makeError(CloudDefect::kBadLayout, message,
                     "row_step " + std::to_string(row_step) + " is less than a row of " +
                         std::to_string(message.width) + " points of " +
                         std::to_string(point_step) + " bytes",
                     advice);
  }
  const std::uint64_t num_bytes = numPointBytes(message);
  if (message.data.size() < num_bytes) {
    return makeError(CloudDefect::kShortData, message,
                     "it has " + std::to_string(message.data.size()) + " bytes of data, but " +
                         std::to_string(message.width) + " x " + std::to_string(message.height) +
                         " points need " + std::to_string(num_bytes),
                     "Look for a driver or a relay that truncates it");
  }
  return std::nullopt;
}

std::optional<CloudError> checkCloud(const PointCloud2& message, const XyzFields& fields) {
  if (message.header.frame_id.empty()) {
    return makeError(CloudDefect::kEmptyFrame, message, "header.frame_id is empty",
                     "Set the frame of the sensor in its driver");
  }
  if (message.width == 0 || message.height == 0) {
    return makeError(CloudDefect::kNoPoints, message,
                     "it has no points (" + std::to_string(message.width) + " x " +
                         std::to_string(message.height) + ")",
                     "Check the sensor and any filters before this node");
  }
  if (auto error = checkFields(message, fields)) return error;
  return checkLayout(message, fields);
}

/// Reads points of a checked message.
class PointReader {
 public:
  PointReader(const PointCloud2& message, const XyzFields& fields)
      : message_(message), is_other_order_(isOtherOrder(message)) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      offsets_[axis] = fields[axis]->offset;
      is_double_[axis] = fields[axis]->datatype == PointField::FLOAT64;
    }
  }

  [[nodiscard]] bool hasDouble() const { return is_double_[0] || is_double_[1] || is_double_[2]; }

  [[nodiscard]] Eigen::Vector3d read(std::size_t row, std::size_t column) const {
    const std::uint8_t* point =
        message_.data.data() + row * message_.row_step + column * message_.point_step;
    Eigen::Vector3d xyz;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint8_t* data = point + offsets_[axis];
      xyz[static_cast<Eigen::Index>(axis)] =
          is_double_[axis] ? readAs<double, std::uint64_t>(data, is_other_order_)
                           : readAs<float, std::uint32_t>(data, is_other_order_);
    }
    return xyz;
  }

 private:
  const PointCloud2& message_;
  bool is_other_order_;
  std::array<std::size_t, 3> offsets_{};
  std::array<bool, 3> is_double_{};
};

using NamedReadings = std::pair<const char*, NoReturnPoints>;
constexpr std::array<NamedReadings, 4> kReadings{{{"plus_inf", NoReturnPoints::kPlusInf},
                                                  {"nan", NoReturnPoints::kNan},
                                                  {"zero", NoReturnPoints::kZero},
                                                  {"minus_inf", NoReturnPoints::kMinusInf}}};
constexpr std::array<NamedReadings, 5> kSetsOfReadings{{{"rep_117", NoReturnPoints::kRep117},
                                                        {"with_nan", NoReturnPoints::kWithNan},
                                                        {"with_zero", NoReturnPoints::kWithZero},
                                                        {"all", NoReturnPoints::kAll},
                                                        {"none", NoReturnPoints::kNone}}};

/// Of a size that float32 can hold.
constexpr double kMaxCoordinate_m = 1e30;

/// Not NaN, not at the origin, and not infinite.
bool isReturn(const Eigen::Vector3d& point) {
  // NaN fails the comparison.
  return (point.array().abs() <= kMaxCoordinate_m).all() && !point.isZero(0.0);
}

/// Whether a point that is no return says that its beam met nothing.
bool isNoReturn(const Eigen::Vector3d& point, NoReturnPoints wanted) {
  if (point.hasNaN()) return contains(wanted, NoReturnPoints::kNan);
  if (point.isZero(0.0)) return contains(wanted, NoReturnPoints::kZero);
  const bool is_minus = point.minCoeff() < -kMaxCoordinate_m;
  return contains(wanted, is_minus ? NoReturnPoints::kMinusInf : NoReturnPoints::kPlusInf);
}

/// Calls visit(point) for every point, row by row, until it returns false.
template <typename VisitorT>
void visitPoints(const PointCloud2& message, const PointReader& reader, VisitorT visit) {
  for (std::size_t row = 0; row < message.height; ++row) {
    for (std::size_t column = 0; column < message.width; ++column) {
      if (!visit(reader.read(row, column))) return;
    }
  }
}

/// See CloudPoints::anchor_cloud: multiples of 1024 m, near the first point.
Eigen::Vector3d findAnchor(const PointCloud2& message, const PointReader& reader) {
  Eigen::Vector3d anchor = Eigen::Vector3d::Zero();
  if (!reader.hasDouble()) return anchor;
  visitPoints(message, reader, [&anchor](const Eigen::Vector3d& point) {
    if (!isReturn(point)) return true;
    constexpr double kSpacing_m = 1024.0;
    if (point.cwiseAbs().maxCoeff() > kMaxFloatRange_m) {
      anchor = (point / kSpacing_m).array().round().matrix() * kSpacing_m;
    }
    return false;
  });
  return anchor;
}

void addNoReturns(const PointCloud2& message, const PointReader& reader,
                  const CloudOptions& options, CloudPoints& cloud) {
  const Eigen::Isometry3d T_sensor_cloud = options.T_cloud_sensor.inverse();
  std::vector<Eigen::Vector3f> points_sensor;
  std::vector<bool> are_wanted;
  points_sensor.reserve(std::size_t{message.width} * message.height);
  are_wanted.reserve(points_sensor.capacity());
  visitPoints(message, reader, [&](const Eigen::Vector3d& point) {
    points_sensor.push_back(Eigen::Vector3f::Zero());
    if (isReturn(point)) points_sensor.back() = (T_sensor_cloud * point).cast<float>();
    are_wanted.push_back(isNoReturn(point, options.no_return_points));
    return true;
  });
  const auto estimate =
      cuboid_mapping::estimateNoReturnBeams(points_sensor, message.width, message.height);
  cloud.no_returns.reserve(estimate.beams.size());
  for (const auto& beam : estimate.beams) {
    if (!are_wanted[beam.index]) continue;
    const Eigen::Vector3d end_sensor = beam.direction.cast<double>() * options.no_return_range_m;
    const Eigen::Vector3d end_cloud = options.T_cloud_sensor * end_sensor;
    cloud.no_returns.emplace_back((end_cloud - cloud.anchor_cloud).cast<float>());
    if (options.wants_numbers)
      cloud.no_return_numbers.push_back(static_cast<std::uint32_t>(beam.index));
  }
}

}  // namespace

NoReturnPoints classifyReading(double number) {
  if (std::isnan(number)) return NoReturnPoints::kNan;
  if (number == 0.0) return NoReturnPoints::kZero;
  if (number < -kMaxCoordinate_m) return NoReturnPoints::kMinusInf;
  return number > kMaxCoordinate_m ? NoReturnPoints::kPlusInf : NoReturnPoints::kNone;
}

std::string toText(NoReturnPoints points) {
  for (const auto& [name, set] : kSetsOfReadings) {
    if (points == set) return name;
  }
  std::string text;
  for (const auto& [name, reading] : kReadings) {
    if (contains(points, reading)) text += (text.empty() ? "" : " ") + std::string(name);
  }
  return text;
}

std::optional<NoReturnPoints> parseNoReturnPoints(const std::string& text) {
  for (const auto& [name, set] : kSetsOfReadings) {
    if (text == name) return set;
  }
  unsigned set = 0;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const auto known = std::find_if(kReadings.begin(), kReadings.end(),
                                    [&word](const auto& reading) { return word == reading.first; });
    if (known == kReadings.end()) return std::nullopt;
    set |= static_cast<unsigned>(known->second);
  }
  if (set == 0) return std::nullopt;
  return static_cast<NoReturnPoints>(set);
}

const char* toString(CloudDefect defect) {
  switch (defect) {
    case CloudDefect::kEmptyFrame: return "empty frame_id";
    case CloudDefect::kNoPoints: return "no points";
    case CloudDefect::kNoXyzFields: return "no x/y/z fields";
    case CloudDefect::kWrongDatatype: return "wrong datatype";
    case CloudDefect::kBadLayout: return "bad layout";
    case CloudDefect::kShortData: return "short data";
    case CloudDefect::kNoValidPoints: return "no valid points";
    case CloudDefect::kNoPointTimes: break;
  }
  return "no point times";
}

std::variant<CloudPoints, CloudError> convertCloud(const sensor_msgs::PointCloud2& message,
                                                   const CloudOptions& options) {
  const XyzFields fields = findFields(message);
  if (auto error = checkCloud(message, fields)) return *error;
  const PointReader reader(message, fields);
  CloudPoints cloud;
  cloud.anchor_cloud = findAnchor(message, reader);
  cloud.points.reserve(std::size_t{message.width} * message.height);
  std::uint32_t number = 0;
  visitPoints(message, reader, [&](const Eigen::Vector3d& point) {
    if (isReturn(point)) {
      cloud.points.emplace_back((point - cloud.anchor_cloud).cast<float>());
      if (options.wants_numbers) cloud.point_numbers.push_back(number);
    } else {
      ++cloud.num_invalid;
    }
    ++number;
    return true;
  });
  if (message.height > 1 && cloud.num_invalid > 0 && options.no_return_range_m > 0.0) {
    addNoReturns(message, reader, options, cloud);
  }
  if (cloud.points.empty() && cloud.no_returns.empty()) {
    return makeError(
        CloudDefect::kNoValidPoints, message,
        "all of its " + std::to_string(cloud.num_invalid) + " points are NaN, infinite or zero",
        "Check that nothing covers the sensor, and check any filters before this node");
  }
  cloud.num_skipped = cloud.num_invalid - cloud.no_returns.size();
  return cloud;
}

cuboid_mapping::Scan toScan(const CloudPoints& cloud, const Eigen::Isometry3d& T_map_cloud,
                            const Eigen::Vector3d& origin_map) {
  return cuboid_mapping::makeScan(T_map_cloud * Eigen::Translation3d(cloud.anchor_cloud),
                                  origin_map, cloud.points, cloud.no_returns);
}

}  // namespace cuboid_mapping_ros
