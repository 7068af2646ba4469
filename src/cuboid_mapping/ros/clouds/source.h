// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/clouds/cloud_pipeline.h"
#include "cuboid_mapping/ros/conversions/sensor_message.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/time.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace cuboid_mapping_ros {

/// Lets so many messages a second through, by their stamps: the first of each slot of 1 / rate. The same
/// messages therefore pass whenever a recording is played.
class RateLimit {
 public:
  /// @param max_rate_hz  >= 0; 0: no limit.
  explicit RateLimit(double max_rate_hz) : max_rate_hz_(max_rate_hz) {}

  /// To be called for every message. A stamp of 0 always passes.
  [[nodiscard]] bool lets(const ros::Time& stamp);

 private:
  double max_rate_hz_;
  std::optional<std::int64_t> last_slot_;
};

/// A sensor, without the topic: what becomes of its messages. Not thread-safe.
struct Source {
  explicit Source(const NodeParameters& source)
      : parameters(source), rate_limit(source.source.max_rate_hz), pipeline(source) {}

  NodeParameters parameters;
  RateLimit rate_limit;
  CloudPipeline pipeline;
};

/// One for each of sourcesOf().
[[nodiscard]] std::vector<std::unique_ptr<Source>> makeSources(const NodeParameters& parameters);

}  // namespace cuboid_mapping_ros
