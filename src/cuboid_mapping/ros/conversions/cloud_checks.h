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

/// Finds implausible readings of one source: a range that a tenth of all points have, depths that no camera
/// measures, hardly a point within the maximum range, and warnings of the conversion. Reports each once.
class CloudChecks {
 public:
  /// @param is_depth  Depth images: checks z, not the distance. @param max_range_m  Limit of the beams.
  CloudChecks(bool is_depth, double max_range_m) : is_depth_(is_depth), max_range_m_(max_range_m) {}

  /// @param sensor_cloud  Start of the beams. @complexity O(1): reads a sample of the points.
  void note(const CloudPoints& cloud, const Eigen::Vector3d& sensor_cloud);

  /// Findings since the last call, with their cure.
  [[nodiscard]] std::vector<std::string> takeWarnings();

 private:
  void warnOnce(const std::string& kind, const std::string& text);
  void checkOneRange();
  void checkMaxRange();
  void checkUnit(std::vector<double>& ranges_m);

  bool is_depth_;
  double max_range_m_;
  std::map<std::int64_t, std::size_t> counts_;  ///< Points of the sample, by range in millimetres.
  std::size_t num_points_ = 0;                  ///< Number of points in the sample.
  std::size_t num_too_far_ = 0;
  std::map<std::string, bool> said_;
  std::vector<std::string> warnings_;
};

}  // namespace cuboid_mapping_ros
