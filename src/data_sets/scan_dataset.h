// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/isometry.h"

#include <cstddef>
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

/// A row of .bin files, which begins with x, y and z.
struct BinRow {
  std::size_t num_bytes = 0;  ///< Bytes from row to row; 0: found from the data.
  bool has_doubles = false;   ///< Whether x, y and z are float64, not float32.
};

/// Help of the programs for parseBinRow().
constexpr char kBinRowHelp[] =
    "bytes of a row of .bin files, such as 20 for five float32, or 24d for three float64; it "
    "begins "
    "with x y z. Without it, found from the data";

/// Parses "20" or, with float64, "24d"; "" is found from the data. @throws std::runtime_error for other texts.
[[nodiscard]] BinRow parseBinRow(const std::string& text);

/// Opens a data set.
///
/// Cases:
///   - a folder: `poses.txt` with a line `index tx ty tz qx qy qz qw` per scan (map <- sensor; lines
///     beginning with # are comments), and `scans/NNNN.pcd`, the index in four digits;
///   - a folder with `pcd/*.pcd` and no `poses.txt`, as KTH's DynamicMap benchmark has them: clouds in the
///     map's frame, in the order of their numbers, whose VIEWPOINT is T_map_sensor;
///   - a folder with .bin files, or with them in velodyne/, velodyne_points/data/ or scans/, and `poses.txt` with a
///     line for each file in the order of their numbers: a 3 x 4 matrix row by row, as in KITTI, or a line as above. `Tr`, `Tr_velo_to_cam` or
///     `Tr_velo_cam` in calib.txt takes points to the camera, whose poses KITTI gives. Rows are float32 x y z
///     intensity, unless other ones (3 to 8 float32 or float64) make much more sense;
///   - a file that ends in `.graph`: an octomap::ScanGraph.
///
/// x, y and z of a .pcd file are float or double.
///
/// @throws std::runtime_error naming the defect and its place.
[[nodiscard]] std::unique_ptr<ScanDataset> openScanDataset(const std::string& path,
                                                           const BinRow& bin_row = {});

}  // namespace cuboid_mapping
