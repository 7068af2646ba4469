// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/sensor_message.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <rosbag/bag.h>
#include <rosbag/message_instance.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

using Bags = std::vector<std::unique_ptr<rosbag::Bag>>;

/// The parameters with the topics of bags for sources.
///
/// With a list of sources: these, each of which is checked for being in the bags. Else the topics that are
/// wanted, or all of the parameters' type: each is a source, with the same parameters.
///
/// @param missing  Gets the topics of the list that no bag has.
/// @throws std::runtime_error  for what is wanted and not there, or of another type, and where no topic is left.
[[nodiscard]] NodeParameters chooseSources(const Bags& bags, const NodeParameters& parameters,
                                           const std::vector<std::string>& wanted,
                                           std::vector<std::string>& missing);

/// The messages of sources in rosbags, in the order in which the node puts them into the map: of one source
/// as they were recorded, of several by (stamp, source). Those beyond max_rate, and depth images without
/// camera_info, are left out.
class BagMessages {
 public:
  /// Reads the stamps, unless they do not matter. @param parameters  See chooseSources().
  /// @param bags  Must outlive this object.
  BagMessages(const Bags& bags, const NodeParameters& parameters);

  [[nodiscard]] std::size_t size() const { return messages_.size(); }
  /// One of them; nothing when its bytes are none.
  [[nodiscard]] std::optional<SensorMessage> read(std::size_t number) const;
  [[nodiscard]] std::size_t numWithoutCamera() const { return num_without_camera_; }

 private:
  struct Message {
    std::size_t source;
    std::size_t instance;
    std::size_t camera;  ///< Of a depth image: the instance of its camera_info.
    ros::Time stamp;     ///< 0 where it does not matter.
  };
  using Range = std::pair<std::size_t, std::size_t>;

  Range collect(const Bags& bags, const std::string& topic);
  void add(const Bags& bags, std::size_t source);

  std::vector<NodeParameters> sources_;
  std::vector<rosbag::MessageInstance> instances_;
  std::vector<Message> messages_;
  std::size_t num_without_camera_ = 0;
};

}  // namespace cuboid_mapping_ros
