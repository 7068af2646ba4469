// SPDX-License-Identifier: BSD-3-Clause
// Who publishes a topic, and why a subscriber hears nothing.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Message types of all topics that are published, by name; empty if the master does not answer.
///
/// Asks the master once, without waiting for it.
[[nodiscard]] std::map<std::string, std::string> publishedTypes();

/// Names of the nodes that publish a topic, as publishedTypes().
[[nodiscard]] std::vector<std::string> publishersOf(const std::string& topic);

/// Cause and cure if no message comes on a topic. @param is_published  The master knows a publisher.
/// @param check  What else to do.
[[nodiscard]] std::string describeUnheard(std::size_t num_publishers, bool is_published,
                                          const std::string& check);

}  // namespace cuboid_mapping_ros
