// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/cloud_conversions.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Ranges that the beams of a source may have.
struct RangeLimits {
  double max_range_m;  ///< Longer beams are cut.
  double max_beam_m;   ///< Longer beams that are not cut are left out.
};

/// Finds implausible readings of one source: a range that a tenth of all points have, ranges or depths
/// beyond those of most sensors, hardly a point within the limits, a frame that no sensor has, and warnings of the
/// conversion. Reports each once.
///
/// One depth of a tenth of the pixels may be a wall across the view. It is only reported if it is the greatest,
/// and no other depth comes near it, as far clips of simulated cameras are.
class CloudChecks {
 public:
  /// @param is_depth  Depth images: checks z, not the distance.
  CloudChecks(bool is_depth, const RangeLimits& limits) : is_depth_(is_depth), limits_(limits) {}

  /// @param sensor_cloud  Start of the beams. @complexity O(1): reads a sample of the points.
  void note(const CloudPoints& cloud, const Eigen::Vector3d& sensor_cloud);

  /// Notes warnings of a conversion; note() does so with those of the cloud.
  void noteWarnings(const std::vector<std::string>& warnings);

  /// Notes the frame of a cloud whose beams start at its origin. Reports frames that no sensor has: the map's,
  /// and those that REP 105 fixes in the world.
  void noteFrame(const std::string& frame_id, const std::string& map_frame_id);

  /// Does not report again what those of the source before a change of parameters have reported; only points beyond
  /// another max_range.
  void goOnFrom(const CloudChecks& earlier);

  /// Findings since the last call, with their cure.
  [[nodiscard]] std::vector<std::string> takeWarnings();

 private:
  void warnOnce(const std::string& kind, const std::string& text);
  void checkOneRange();
  void checkLimits();
  void checkUnit(std::vector<double>& ranges_m);

  bool is_depth_;
  RangeLimits limits_;
  std::map<std::int64_t, std::size_t> counts_;  ///< Points of the sample, by range in millimetres.
  std::size_t num_points_ = 0;                  ///< Number of points in the sample.
  std::size_t num_beyond_range_ = 0;
  std::size_t num_beyond_beam_ = 0;
  std::map<std::string, bool> said_;
  std::vector<std::string> warnings_;
};

}  // namespace cuboid_mapping_ros
