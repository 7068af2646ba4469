// SPDX-License-Identifier: BSD-3-Clause
// Packed scans, from which a map can be made again with other poses.
#pragma once

#include "cuboid_mapping/scan/scan.h"

#include <Eigen/Geometry>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace cuboid_mapping {

class SqliteDatabase;

/// Programs round the points of kept clouds to this part of a voxel: less than 2 bytes a point are left.
constexpr double kKeptStepsPerVoxel = 16.0;

/// Rounds all positions of a scan, but its origin, to multiples of a step, so that packScans() loses nothing. Positions
/// that are not finite, or more than 2^30 steps away, are left out. @param step_m  > 0.
void roundScan(Scan& scan, double step_m);

/// Puts a scan, given in the frame of a body, where the body is. As makeScan().
[[nodiscard]] Scan placeScan(const Eigen::Isometry3d& T_map_body, const Scan& scan_body);

/// Scans as bytes, and back. @pre They are rounded to the step, and their anchors are 0.
/// @throws MapFileError  (kCorrupted, kTruncated) of unpackScans(), for bytes that are none.
///@{
[[nodiscard]] std::string packScans(const std::vector<Scan>& scans_body, double step_m);
[[nodiscard]] std::vector<Scan> unpackScans(std::string_view bytes, double step_m);
///@}

/// Scans of clouds, in the frame of the body that carried the sensor, in an SQLite table by number. The table is a
/// temporary file of SQLite, which spills to the disk when its cache is full, and is removed with this object.
///
/// Functions throw MapFileError, as of a full disk. Not thread-safe.
class KeptClouds {
 public:
  /// @param step_m  See roundScan(): > 0.
  explicit KeptClouds(double step_m);
  ~KeptClouds();
  KeptClouds(const KeptClouds&) = delete;
  KeptClouds& operator=(const KeptClouds&) = delete;

  /// Keeps the scans of one observation. @param number  Higher than all earlier numbers.
  /// @return Its bytes. @pre As of packScans().
  std::size_t add(std::uint64_t number, const std::vector<Scan>& scans_body);
  /// The bytes of a cloud, for unpackScans(). @throws MapFileError  if it is not there, too.
  [[nodiscard]] std::string read(std::uint64_t number) const;
  /// Forgets a cloud.
  void remove(std::uint64_t number);
  /// Forgets all.
  void clear();

  /// Step of the rounding of points.
  [[nodiscard]] double step_m() const { return step_m_; }

 private:
  double step_m_;
  std::unique_ptr<SqliteDatabase> database_;
};

}  // namespace cuboid_mapping
