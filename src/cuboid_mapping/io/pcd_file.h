// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

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

}  // namespace cuboid_mapping
