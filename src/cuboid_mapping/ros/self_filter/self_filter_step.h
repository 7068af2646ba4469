// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/ros/mapping/sensor_step.h"

#include <vector>

namespace cuboid_mapping_ros {

/// Points on the robot are left out, with their beams.
class SelfFilterStep : public SensorStep {
 public:
  SelfFilterStep(const NodeParameters& parameters, const SourceParameters& /*source*/)
      : parameters_(parameters.self_filter), grid_(parameters.map.resolution_m) {}

  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  /// loadRobotParts().
  static void readReferences(NodeParameters& parameters, const FindText& find_text);
  [[nodiscard]] static bool isOn(const NodeParameters& parameters,
                                 const SourceParameters& /*source*/) {
    return !parameters.self_filter.parts.empty();
  }

  [[nodiscard]] std::vector<StepFrame> frames() const override;
  void apply(SensorPart& part, const StepPoses& poses, CloudFigures& figures) const override;
  [[nodiscard]] std::vector<Eigen::Vector3f> findFreePoints(
      const StepPoses& poses, const Eigen::Vector3d& anchor_map) const override;

 private:
  SelfFilterParameters parameters_;
  Grid grid_;
};

}  // namespace cuboid_mapping_ros
