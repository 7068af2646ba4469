// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/isometry.h"

#include <Eigen/Core>

#include <vector>

namespace cuboid_mapping {

/// One observation of a range sensor (z_t of the paper), in metres, in the frame of the map where nothing else is said.
///
/// Positions are float32 relative to `anchor_map`, so that they stay exact far from the origin of
/// the map: the position of a point p is anchor_map + p. With a zero anchor the numbers are those
/// that OctoMap computes with.
struct Scan {
  /// Origin of all other positions.
  Eigen::Vector3d anchor_map = Eigen::Vector3d::Zero();
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();  ///< Start of all beams.
  std::vector<Eigen::Vector3f> points;               ///< End points of beams that were reflected.
  /// End points of the known free part of beams without return: every voxel up to and including that of the end
  /// point is a miss.
  std::vector<Eigen::Vector3f> no_returns;
  /// End points of beams that something other than an obstacle reflects, such as the ground: every voxel before
  /// that of the end point is a miss, and the last voxel is not observed.
  std::vector<Eigen::Vector3f> open_ends;
  /// Points that are known to be free without a beam, such as points inside the robot: the voxel of each is a
  /// miss. Points more than kMaxBeamVoxels from the origin are ignored.
  std::vector<Eigen::Vector3f> free_points;
};

/// A scan of points given in the frame of a cloud.
///
/// The anchor is the multiple of 1024 m nearest to the sensor on each axis: zero within 512 m of
/// the origin of the map. The points are transformed in float32, as pcl::transformPointCloud does.
///
/// @param T_map_cloud  Takes points from the cloud's frame to the map.
/// @param origin_map   Start of the beams: T_map_cloud.translation() unless the cloud comes in a
///                     frame that is not the sensor's.
/// @param points_cloud, no_returns_cloud  Metres; see Scan.
[[nodiscard]] Scan makeScan(const Eigen::Isometry3d& T_map_cloud, const Eigen::Vector3d& origin_map,
                            const std::vector<Eigen::Vector3f>& points_cloud,
                            const std::vector<Eigen::Vector3f>& no_returns_cloud = {});

}  // namespace cuboid_mapping
