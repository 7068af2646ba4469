// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/scan_filter.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace cuboid_mapping {

bool isInside(const MetricBox& box, const Eigen::Vector3d& point) {
  return (point.array() >= box.min_m.array()).all() && (point.array() <= box.max_m.array()).all();
}

FilterCounts filterScan(Scan& scan, const ScanLimits& limits) {
  if (std::isnan(limits.min_range_m)) {
    throw std::invalid_argument("the minimum range is NaN: give metres; 0 is no limit");
  }
  FilterCounts counts;
  const auto is_left_out = [&](const Eigen::Vector3f& point) {
    if (limits.min_range_m > 0.0 &&
        (point - scan.origin).cast<double>().norm() < limits.min_range_m) {
      ++counts.num_too_near;
      return true;
    }
    if (limits.crop_map ? !isInside(*limits.crop_map, scan.anchor_map + point.cast<double>())
                        : point.hasNaN()) {
      ++counts.num_outside_crop;
      return true;
    }
    return false;
  };
  scan.points.erase(std::remove_if(scan.points.begin(), scan.points.end(), is_left_out),
                    scan.points.end());
  return counts;
}

}  // namespace cuboid_mapping
