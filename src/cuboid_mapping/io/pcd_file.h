// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/map_snapshot.h"

#include <Eigen/Geometry>
#include <boost/algorithm/string/predicate.hpp>

#include <string>
#include <vector>

namespace cuboid_mapping {

/// The points of a PCD file.
struct PcdFile {
  std::vector<Eigen::Vector3d> points;  ///< Points, also those that are not finite.
  Eigen::Isometry3d viewpoint = Eigen::Isometry3d::Identity();
};

/// Reads a PCD file of any DATA, whose x, y and z are float or double.
/// @throws std::runtime_error naming the file and its defect.
[[nodiscard]] PcdFile readPcd(const std::string& file);

/// Whether a name ends in .pcd, in lower or upper case.
[[nodiscard]] inline bool isPointCloudFile(const std::string& file) {
  return boost::algorithm::iends_with(file, ".pcd");
}

/// Map of a cloud of points in the map's frame, as SLAM programs save it: voxels with a point are occupied,
/// with the greatest log-odds; all others are unknown. Points that are not finite, or beyond the grid, are left
/// out.
/// @throws std::runtime_error as readPcd(), and for a file without a point.
[[nodiscard]] MapSnapshot readPointCloudMap(const std::string& file, double resolution_m,
                                            const SensorModelConfig& model);

/// readPointCloudMap() for those who load the library while they run.
// NOLINTNEXTLINE(readability-identifier-naming): a symbol of C, in the names of all libraries.
extern "C" void cuboid_mapping_read_point_cloud_map(const std::string& file, double resolution_m,
                                                    const SensorModelConfig& model,
                                                    MapSnapshot& snapshot);

}  // namespace cuboid_mapping
