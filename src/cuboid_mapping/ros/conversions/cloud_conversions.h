// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/cloud_error.h"
#include "cuboid_mapping/ros/conversions/no_return_points.h"
#include "cuboid_mapping/ros/middleware/core_names.h"
#include "cuboid_mapping/scan/scan.h"

#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace cuboid_mapping_ros {

/// Content of a cloud, in metres in the cloud's frame.
struct CloudPoints {
  /// Origin of all positions. Zero unless the coordinates are FLOAT64 and beyond 8 km, where float32 is too
  /// coarse: then it is near the sensor, or in the middle of the points if they are far from it; see
  /// toScan().
  Eigen::Vector3d anchor_cloud = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3f> points;      ///< Ends of reflected beams.
  std::vector<Eigen::Vector3f> no_returns;  ///< Ends of beams without return, see Scan::no_returns.
  /// Indices of these points in the message, row by row; only on request.
  ///@{
  std::vector<std::uint32_t> point_numbers;
  std::vector<std::uint32_t> no_return_numbers;
  ///@}
  std::size_t num_invalid = 0;  ///< Points that are no return.
  std::size_t num_skipped = 0;  ///< Points left out because their beams are unknown or not wanted.
  std::vector<std::string> warnings;  ///< About an unusual message that was converted.
};

/// A converted message, or the reason of its refusal.
using ConvertedCloud = std::variant<CloudPoints, CloudError>;

/// Options for the conversion of a message.
struct CloudOptions {
  /// Length of a beam without return in metres, see Scan::no_returns; 0: such beams are skipped.
  double no_return_range_m = 0.0;
  /// Readings that stand for such a beam.
  NoReturnPoints no_return_points = NoReturnPoints::kRep117;
  /// Readings of these ranges or depths also are no returns, and stand for such a beam.
  NoReturnRanges no_return_ranges_m;
  /// Pose of the sensor in the cloud's frame, for the directions of beams without return. Set it
  /// only if the cloud has been transformed out of its sensor's frame.
  Eigen::Isometry3d T_cloud_sensor = Eigen::Isometry3d::Identity();
  bool wants_numbers = false;  ///< See CloudPoints::point_numbers.
  /// Unit of points, ranges and depths; 0: see checkUnit() and convertDepthImage().
  double length_unit_m = 0.0;
};

/// Reads the points of a message. Wrong numbers in it never cause a read outside its data.
///
/// x, y and z are found by name, each with its own offset and datatype (FLOAT32 or FLOAT64); a
/// count other than 1 stands for the first element. Both byte orders, see findByteOrder(); organized or not; see
/// layoutOf().
/// is_dense is ignored: every point is checked. A point at exactly (0, 0, 0), or at the sensor if the
/// cloud has been transformed out of its frame, is no return: drivers without NaN write these.
/// A point whose range or greatest coordinate from the sensor is in `no_return_ranges_m` is no return, too; its
/// beam is known.
///
/// Points that are no return, in an organized cloud (height > 1) with `no_return_range_m` > 0,
/// become no-returns if they are of `no_return_points`, and if
/// estimateNoReturnBeams() finds their directions. In any other case they are
/// skipped. A point with a NaN counts as NaN, else one with a coordinate below -1e30 as -inf, else
/// one with a coordinate above 1e30 as +inf.
///
/// @return At least one point or no-return; or why the message is refused.
/// @complexity O(width * height).
[[nodiscard]] ConvertedCloud convertCloud(const sensor_msgs::PointCloud2& message,
                                          const CloudOptions& options = {});

/// Checks points that were read as metres: if their median is 1 to 200 km from the sensor, they are in millimetres
/// or centimetres. @return The refusal; nothing if a unit was given.
[[nodiscard]] std::optional<CloudError> checkUnit(const CloudPoints& cloud,
                                                  const CloudOptions& options,
                                                  const std_msgs::Header& header);

/// Marks the points of a message that are finite and not (0, 0, 0), row by row; empty if it cannot be
/// converted.
[[nodiscard]] std::vector<bool> findReturns(const sensor_msgs::PointCloud2& message);

/// cuboid_mapping::makeScan() of a converted cloud, with its anchor.
///
/// @param T_map_cloud  Takes points from the cloud's frame to the map.
/// @param origin_map   Start of the beams.
[[nodiscard]] Scan toScan(const CloudPoints& cloud, const Eigen::Isometry3d& T_map_cloud,
                          const Eigen::Vector3d& origin_map);

}  // namespace cuboid_mapping_ros
