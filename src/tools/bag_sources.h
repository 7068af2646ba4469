// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "bag_files.h"
#include "cuboid_mapping/ros/conversions/sensor_conversions.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

/// The messages of sources in rosbags, in the order in which the node puts them into the map: those of one
/// source as recorded, of several by (stamp, source). Messages beyond max_rate, and depth images without
/// camera_info, are left out.
class BagMessages {
 public:
  /// Reads the stamps, if they matter. @param parameters  See chooseSources().
  /// @param bags  Must outlive this object.
  BagMessages(BagFiles& bags, const NodeParameters& parameters);

  [[nodiscard]] std::size_t size() const { return messages_.size(); }
  /// Reads a message; nothing if it cannot be read.
  [[nodiscard]] std::optional<SensorMessage> read(std::size_t number) const;
  /// Time at which a message was recorded.
  [[nodiscard]] ros::Time recorded(std::size_t number) const {
    return instances_[messages_.at(number).instance].instance.getTime();
  }
  [[nodiscard]] std::size_t numWithoutCamera() const { return num_without_camera_; }

 private:
  struct Message {
    std::size_t source;
    std::size_t instance;
    std::size_t camera;  ///< Instance of the camera_info of a depth image.
    ros::Time stamp;     ///< For the order of sources; time of recording if it has none.
  };
  using Range = std::pair<std::size_t, std::size_t>;

  Range collect(const std::string& topic);
  void add(std::size_t source);

  BagFiles& bags_;
  std::vector<SourceParameters> sources_;
  std::vector<BagMessage> instances_;
  std::vector<Message> messages_;
  std::size_t num_without_camera_ = 0;
};

}  // namespace cuboid_mapping_ros
