// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/clouds/depth_pairs.h"
#include "cuboid_mapping/ros/conversions/sensor_conversions.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/node_handle.h>
#include <ros/subscriber.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Topic of camera_info beside an image topic, compressed or not, where drivers publish it.
[[nodiscard]] std::string cameraInfoBeside(const std::string& image_topic);

/// Listens to the topic of a source, whatever its type.
class SourceSubscriber {
 public:
  struct Callbacks {
    /// A message has arrived. @return Whether it is wanted.
    std::function<bool(std::size_t source, const std_msgs::Header& header)> arrived;
    std::function<void(const SensorMessage& message)> take;
    /// A depth image that was wanted has no camera_info.
    std::function<void(std::size_t source, const std::string& why)> drop;
  };

  /// @param nh  Handle of a separate thread, in which the callbacks take some microseconds.
  SourceSubscriber(const ros::NodeHandle& nh, const SourceParameters& source, std::size_t index,
                   Callbacks callbacks);
  SourceSubscriber(const SourceSubscriber&) = delete;
  SourceSubscriber& operator=(const SourceSubscriber&) = delete;

  /// Topic after remapping.
  [[nodiscard]] const std::string& topic() const { return topic_; }
  [[nodiscard]] std::size_t numPublishers() const {
    return subscribers_.front().getNumPublishers();
  }

 private:
  template <typename MessageT>
  void listen();
  void listenToDepth(const SourceParameters& source);

  ros::NodeHandle nh_;
  std::size_t index_;
  Callbacks callbacks_;
  std::string topic_;
  std::unique_ptr<DepthPairs> pairs_;
  std::vector<ros::Subscriber> subscribers_;  ///< The first one subscribes to the topic.
};

}  // namespace cuboid_mapping_ros
