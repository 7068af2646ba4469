// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/clouds/cloud_pipeline.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <memory>
#include <vector>

namespace cuboid_mapping_ros {

/// Processing of a sensor's messages, without the topic. Not thread-safe.
struct Source {
  Source(const NodeParameters& node, const SourceParameters& source)
      : parameters(source), frames(node, source), pipeline(node, source) {}

  SourceParameters parameters;
  PoseFrames frames;
  CloudPipeline pipeline;
};

/// One for each of sourcesOf().
[[nodiscard]] std::vector<std::unique_ptr<Source>> makeSources(const NodeParameters& parameters);

}  // namespace cuboid_mapping_ros
