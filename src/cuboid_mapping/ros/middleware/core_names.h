// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace cuboid_mapping {}  // namespace cuboid_mapping

namespace cuboid_mapping_ros {

/// Names of the core need no qualifier in the ROS layer, except functions that this layer overloads.
using namespace cuboid_mapping;

}  // namespace cuboid_mapping_ros
