// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/isometry.h"

#include <memory>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// A sequence of range scans with their poses, read one at a time.
class ScanDataset {
 public:
  /// One scan as it was taken.
  struct Item {
    /// Takes points from the sensor to the map.
    Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
    std::vector<Eigen::Vector3f> points_sensor;  ///< Metres.
  };

  virtual ~ScanDataset() = default;
  /// Number of scans.
  [[nodiscard]] virtual std::size_t size() const = 0;

  /// Reads one scan. @pre index < size().
  /// @throws std::runtime_error naming the file and its defect.
  [[nodiscard]] virtual Item read(std::size_t index) const = 0;
};

/// Opens a data set.
///
/// Cases:
///   - a folder: `poses.txt` with a line `index tx ty tz qx qy qz qw` per scan (map <- sensor; lines
///     beginning with # are comments), and `scans/NNNN.pcd`, the index in four digits;
///   - a folder with `pcd/*.pcd` and no `poses.txt`, as KTH's DynamicMap benchmark has them: clouds in the
///     map's frame, in the order of their names, whose VIEWPOINT is T_map_sensor;
///   - a folder with .bin files of float32 x y z intensity, or with them in velodyne/, velodyne_points/data/ or
///     scans/, and `poses.txt` with a line for each file: a 3 x 4 matrix row by row, as in KITTI, or a line as
///     above. A `Tr:` in calib.txt takes points to the camera, whose poses KITTI gives;
///   - a file that ends in `.graph`: an octomap::ScanGraph.
///
/// x, y and z of a .pcd file are float or double.
///
/// @throws std::runtime_error naming the defect and its place.
[[nodiscard]] std::unique_ptr<ScanDataset> openScanDataset(const std::string& path);

}  // namespace cuboid_mapping
