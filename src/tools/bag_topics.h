// SPDX-License-Identifier: BSD-3-Clause
// Choice of the topics of bags to map, if none are given.
#pragma once

#include "bag_files.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// A topic in some bags.
struct BagTopic {
  std::string datatype;
  std::uint64_t num_messages = 0;
  // Members for topics of sensors, from the first message:
  std::optional<SourceType> type;  ///< Nothing if it cannot be mapped.
  bool is_image = false;           ///< Of any content.
  std::string frame_id;
};

/// All topics, by their names with a slash.
class BagTopics {
 public:
  /// Reads the first message of each topic of a sensor.
  explicit BagTopics(BagFiles& bags);

  [[nodiscard]] const BagTopic* find(const std::string& topic) const;
  [[nodiscard]] const std::map<std::string, BagTopic>& all() const { return topics_; }
  /// The same, where the given images are depth images; all images, if none is one.
  [[nodiscard]] BagTopics withDepth(const std::vector<std::string>& wanted) const;

 private:
  void look(BagFiles& bags, const std::string& name, BagTopic& topic) const;

  std::map<std::string, BagTopic> topics_;
};

/// The chosen topics, and remarks about them.
struct ChosenSources {
  NodeParameters parameters;
  std::vector<std::string> notes;  ///< Lines: topics that are used, and left out; warnings.
};

/// Sets the topics of the bags as sources of the parameters.
///
/// Cases:
///   - a list of sources: these, of which one at least must be in the bags;
///   - given topics: each is a source of its type, with the same parameters;
///   - no topics: all clouds that are not in the frame of the map, else all planar scans, else all depth images
///     with camera_info, else all clouds; with `is_type_set`, all of the parameters' type.
/// With the type of depth images, images that are given, or the only ones, are taken as such, whatever their encoding.
///
/// @throws std::runtime_error  if a given topic is missing or has another type, or no topic is left; the text
///                             lists the topics, and says what to do.
[[nodiscard]] ChosenSources chooseSources(const BagTopics& topics, const NodeParameters& parameters,
                                          bool is_type_set, const std::vector<std::string>& wanted);

}  // namespace cuboid_mapping_ros
