// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace cuboid_mapping_ros {

/// Time between two calls of giveMemoryBack().
constexpr double kMemoryPeriod_s = 10.0;

/// Gives free memory back to the system. glibc keeps it between objects that live on: copies of a large map, made
/// for files and topics by several threads, would leave many times its memory with the node.
void giveMemoryBack();

}  // namespace cuboid_mapping_ros
