// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/sharing/map_publisher.h"

#include "cuboid_mapping/ros/parameters/parameter_table.h"

namespace cuboid_mapping_ros {
namespace {

using P = NodeParameters;

}  // namespace

std::vector<ParameterDeclaration> MapPublisher::declare() {
  return {
      {"publish_values", "", boolean(&P::publish_values),
       "true: cuboid_map and cuboid_map_updates carry the log-odds of every voxel. false: only "
       "classes, which suffice for planners."},
      {"map_part_size", "MB", number(&P::map_part_size_mb, 0.001, 500.0),
       "A larger map is sent in several messages (cuboid_map, ~get_map). This is the size before "
       "compression."},
  };
}

}  // namespace cuboid_mapping_ros
