// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/clouds/cloud_pipeline.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <memory>
#include <vector>

namespace cuboid_mapping_ros {

/// A sensor, without the topic: what becomes of its messages. Not thread-safe.
struct Source {
  explicit Source(const NodeParameters& source) : parameters(source), pipeline(source) {}

  NodeParameters parameters;
  CloudPipeline pipeline;
};

/// One for each of sourcesOf().
[[nodiscard]] std::vector<std::unique_ptr<Source>> makeSources(const NodeParameters& parameters);

}  // namespace cuboid_mapping_ros
