// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace cuboid_mapping {}  // namespace cuboid_mapping

namespace cuboid_mapping_ros {

/// The ROS layer is written in the words of the map: its names need no qualifier, except functions that this layer overloads.
using namespace cuboid_mapping;

}  // namespace cuboid_mapping_ros
