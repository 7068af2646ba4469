// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/source.h"

namespace cuboid_mapping_ros {

std::vector<std::unique_ptr<Source>> makeSources(const NodeParameters& parameters) {
  std::vector<std::unique_ptr<Source>> sources;
  for (const SourceParameters& source : sourcesOf(parameters)) {
    sources.push_back(std::make_unique<Source>(parameters, source));
  }
  return sources;
}

}  // namespace cuboid_mapping_ros
