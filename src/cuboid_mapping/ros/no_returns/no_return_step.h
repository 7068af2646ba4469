// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/mapping/sensor_step.h"

#include <vector>

namespace cuboid_mapping_ros {

/// Beams without return clear the space up to a range.
class NoReturnStep : public SensorStep {
 public:
  NoReturnStep(const NodeParameters& /*parameters*/, const SourceParameters& source)
      : range_m_(source.no_return_range_m),
        points_(source.no_return_points),
        ranges_m_(source.no_return_ranges_m) {}

  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  /// Also without such beams: the parameters say which readings are no points.
  [[nodiscard]] static bool isOn(const NodeParameters& /*parameters*/,
                                 const SourceParameters& /*source*/) {
    return true;
  }

  void setOptions(CloudOptions& options) const override;

 private:
  double range_m_;
  NoReturnPoints points_;
  NoReturnRanges ranges_m_;
};

}  // namespace cuboid_mapping_ros
