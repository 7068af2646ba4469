// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/mapping/sensor_step.h"

#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Points of the ground are no obstacles: beams to them free the voxels before their last one, and do not observe that
/// one.
class GroundStep : public SensorStep {
 public:
  GroundStep(const NodeParameters& parameters, const SourceParameters& source)
      : base_frame_id_(parameters.octomap_server.base_frame_id),
        crop_base_(source.crop),
        config_(source.ground_filter) {}

  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  [[nodiscard]] static bool isOn(const NodeParameters& /*parameters*/,
                                 const SourceParameters& source) {
    return source.filter_ground;
  }

  [[nodiscard]] std::vector<StepFrame> frames() const override { return {{base_frame_id_, ""}}; }
  void apply(SensorPart& part, const StepPoses& poses, CloudFigures& figures) const override;

 private:
  std::string base_frame_id_;
  MetricBox crop_base_;
  GroundFilterConfig config_;
};

}  // namespace cuboid_mapping_ros
