// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/clouds/depth_pairs.h"
#include "cuboid_mapping/ros/conversions/sensor_message.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/node_handle.h>
#include <ros/subscriber.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Beside the topic of an image, where drivers publish its camera_info.
[[nodiscard]] std::string cameraInfoBeside(const std::string& image_topic);

/// Listens to the topic of a source, whatever its type.
class SourceSubscriber {
 public:
  using Take = std::function<void(const SensorMessage& message)>;

  /// @param nh  With a GuardedQueue. @param take  Called in the thread that receives, side by side.
  SourceSubscriber(const ros::NodeHandle& nh, const NodeParameters& source, std::size_t index,
                   const Take& take);

  /// As it is after remapping.
  [[nodiscard]] const std::string& topic() const { return topic_; }
  [[nodiscard]] std::size_t numPublishers() const {
    return subscribers_.front().getNumPublishers();
  }
  /// Depth images that have been left without camera_info.
  [[nodiscard]] std::uint64_t numWithoutCamera() const { return num_without_camera_; }

 private:
  template <typename MessageT, typename WorkT>
  void listen(const std::string& topic, const WorkT& work);

  void listenToDepth(const SourceParameters& source,
                     const std::function<void(const DepthImage& depth)>& take);

  ros::NodeHandle nh_;
  std::string topic_;
  std::atomic<std::uint64_t> num_without_camera_{0};
  std::unique_ptr<DepthPairs> pairs_;
  std::vector<ros::Subscriber> subscribers_;  ///< The first is that of the topic.
};

}  // namespace cuboid_mapping_ros
