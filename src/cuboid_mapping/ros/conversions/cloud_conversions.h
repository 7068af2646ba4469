// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/no_return_points.h"
#include "cuboid_mapping/scan/scan.h"

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace cuboid_mapping_ros {

/// Why a cloud cannot be used, in the order in which it is checked.
enum class CloudDefect : unsigned char {
  kEmptyFrame,     ///< header.frame_id is empty.
  kNoPoints,       ///< width or height is 0, see layoutOf().
  kNoXyzFields,    ///< There is no field x, y or z.
  kWrongDatatype,  ///< x, y or z is neither FLOAT32 nor FLOAT64.
  kBadLayout,      ///< point_step is 0, a field reaches beyond it, or row_step is less than a row.
  kShortData,      ///< There is less data than width, height and steps say.
  kNoValidPoints,  ///< All points are NaN, infinite or zero, and no beam without return is known.
  kNoPointTimes,   ///< With deskew: it does not say when its points were measured.
};

/// Number of enumerators of CloudDefect, for counters.
constexpr std::size_t kNumCloudDefects = 8;

/// A short name for diagnostics, as "no x/y/z fields".
[[nodiscard]] const char* toString(CloudDefect defect);

/// Why a cloud is refused.
struct CloudError {
  CloudDefect defect;
  std::string text;  ///< For the log: the numbers, and what to do.
};

/// Content of a cloud, in metres in the cloud's frame.
struct CloudPoints {
  /// A point p lies at anchor_cloud + p. Zero unless the coordinates are FLOAT64 and beyond 8 km,
  /// where float32 would not do: near the sensor, or in the middle of the points where they are far from it; see
  /// toScan().
  Eigen::Vector3d anchor_cloud = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3f> points;      ///< Ends of reflected beams.
  std::vector<Eigen::Vector3f> no_returns;  ///< Ends of beams without return, see Scan::no_returns.
  /// Which points of the message these are, row by row; only where wanted.
  ///@{
  std::vector<std::uint32_t> point_numbers;
  std::vector<std::uint32_t> no_return_numbers;
  ///@}
  std::size_t num_invalid = 0;  ///< Points that are no return.
  std::size_t num_skipped = 0;  ///< Points left out because their beams are unknown or not wanted.
  std::string warning;  ///< Warning about an unusual message that was converted; else empty.
};

/// How to convert a message.
struct CloudOptions {
  /// Length of a beam without return in metres, see Scan::no_returns; 0: such beams are skipped.
  double no_return_range_m = 0.0;
  /// Which readings stand for such a beam.
  NoReturnPoints no_return_points = NoReturnPoints::kRep117;
  /// Readings of these ranges or depths are no returns, too, and stand for such a beam.
  NoReturnRanges no_return_ranges_m;
  /// Pose of the sensor in the cloud's frame, for the directions of beams without return. Only to
  /// be set where the cloud has been transformed out of its sensor's frame.
  Eigen::Isometry3d T_cloud_sensor = Eigen::Isometry3d::Identity();
  bool wants_numbers = false;  ///< See CloudPoints::point_numbers.
  double depth_unit_m = 1e-3;  ///< Unit of depth images of whole numbers.
};

/// Takes the points out of a message, whatever its numbers say: nothing is read outside its data.
///
/// x, y and z are found by name, each with its own offset and datatype (FLOAT32 or FLOAT64); a
/// count other than 1 stands for the first element. Both byte orders; organized or not; see layoutOf().
/// is_dense is not looked at: every point is checked. A point at exactly (0, 0, 0), or at the sensor where the
/// cloud has been transformed out of its frame, is no return: so drivers write that do without NaN.
/// So is one whose range or greatest coordinate from the sensor is of `no_return_ranges_m`: its beam is known.
///
/// Points that are no return, in an organized cloud (height > 1) with `no_return_range_m` > 0,
/// become no-returns when they are of `no_return_points`, as far as
/// cuboid_mapping::estimateNoReturnBeams() finds their directions. In any other case they are
/// skipped. A point with a NaN counts as NaN, else one with a coordinate below -1e30 as -inf, else
/// one with a coordinate above 1e30 as +inf.
///
/// @return At least one point or no-return; or why the message is refused.
/// @complexity O(width * height).
[[nodiscard]] std::variant<CloudPoints, CloudError> convertCloud(
    const sensor_msgs::PointCloud2& message, const CloudOptions& options = {});

/// Which points of a message are finite and not (0, 0, 0), row by row; empty where it cannot be converted.
[[nodiscard]] std::vector<bool> findReturns(const sensor_msgs::PointCloud2& message);

/// cuboid_mapping::makeScan() of a converted cloud, with its anchor.
///
/// @param T_map_cloud  Takes points from the cloud's frame to the map.
/// @param origin_map   Where the beams start.
[[nodiscard]] cuboid_mapping::Scan toScan(const CloudPoints& cloud,
                                          const Eigen::Isometry3d& T_map_cloud,
                                          const Eigen::Vector3d& origin_map);

}  // namespace cuboid_mapping_ros
