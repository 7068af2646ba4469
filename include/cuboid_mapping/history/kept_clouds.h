// SPDX-License-Identifier: BSD-3-Clause
// Packed scans, from which a map can be made again with other poses.
#pragma once

#include "cuboid_mapping/geometry/isometry.h"

#include "cuboid_mapping/scan/scan.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace cuboid_mapping {

class SqliteDatabase;

/// Steps per voxel to which programs round the points of kept clouds; a point then takes less than 2 bytes.
constexpr double kKeptStepsPerVoxel = 16.0;

/// Rounds all positions of a scan except its origin to multiples of a step, so that packScans() loses nothing.
/// Removes positions that are not finite, or more than 2^30 steps away. @param step_m  > 0.
void roundScan(Scan& scan, double step_m);

/// Takes a scan from the frame of a body to the map, as makeScan() does.
[[nodiscard]] Scan placeScan(const Eigen::Isometry3d& T_map_body, const Scan& scan_body);

/// Converts scans to bytes and back. @pre Scans are rounded to the step, and their anchors are 0.
/// @throws MapFileError  (kCorrupted, kTruncated) from unpackScans(), for damaged bytes.
///@{
[[nodiscard]] std::string packScans(const std::vector<Scan>& scans_body, double step_m);
[[nodiscard]] std::vector<Scan> unpackScans(std::string_view bytes, double step_m);
///@}

/// Scans of clouds, in the frame of the body that carried the sensor, in an SQLite table by number. The table
/// is a temporary file of SQLite, which spills to the disk when its cache is full, and is removed with this
/// object.
///
/// Functions throw MapFileError, for example if the disk is full. Not thread-safe.
class KeptClouds {
 public:
  /// @param step_m  See roundScan(): > 0, else std::invalid_argument.
  explicit KeptClouds(double step_m);
  ~KeptClouds();
  KeptClouds(const KeptClouds&) = delete;
  KeptClouds& operator=(const KeptClouds&) = delete;

  /// Keeps the scans of one observation. @param number  Higher than those of all other clouds; a cloud with this
  ///               number is replaced.
  /// @return Size of the bytes. @pre As for packScans().
  std::size_t add(std::uint64_t number, const std::vector<Scan>& scans_body);
  /// The bytes of a cloud, for unpackScans(). @throws MapFileError  also if the cloud is not there.
  [[nodiscard]] std::string read(std::uint64_t number) const;
  /// Forgets the clouds with lower numbers.
  void removeBefore(std::uint64_t number);
  /// Forgets all clouds.
  void clear();

  /// Step to which points are rounded.
  [[nodiscard]] double step_m() const { return step_m_; }

 private:
  double step_m_;
  std::unique_ptr<SqliteDatabase> database_;
};

}  // namespace cuboid_mapping
