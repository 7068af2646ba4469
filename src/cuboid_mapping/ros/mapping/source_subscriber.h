// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/sensor_conversions.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/node_handle.h>
#include <ros/subscriber.h>

#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

/// Finds the camera_info of each depth image. Needs no master.
///
/// The camera_info with the image's stamp counts; else one without a stamp, or the nearest by stamp: those of
/// one camera are equal, even if they come 3 ms later, or only once. message_filters has no policy for this:
/// its synchronizers need a camera_info for each image.
///
/// An image waits until a camera_info arrives that is not earlier; for at most kMaxWaiting other images, and
/// not at all if none has come for as many images. Before the first camera_info, kMaxCameras images wait. Not
/// thread-safe.
class DepthPairs {
 public:
  struct Callbacks {
    std::function<void(const DepthImage& depth)> take;
    std::function<void()> drop;  ///< Drops an image without camera_info. Must not throw.
  };

  static constexpr std::size_t kMaxWaiting = 3;
  static constexpr std::size_t kMaxCameras = 10;

  explicit DepthPairs(Callbacks callbacks) : callbacks_(std::move(callbacks)) {}

  void add(const sensor_msgs::Image::ConstPtr& image);
  void add(const sensor_msgs::CameraInfo::ConstPtr& camera);

 private:
  void takeOldest();

  Callbacks callbacks_;
  std::deque<sensor_msgs::Image::ConstPtr> images_;  ///< Waiting images.
  std::deque<sensor_msgs::CameraInfo::ConstPtr> cameras_;
  std::size_t num_images_since_camera_ = 0;
};

/// Seconds between the stamps of a camera_info and an image; 0 if the camera_info has none.
[[nodiscard]] double stampDistance(const ros::Time& camera, const ros::Time& image);

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

  /// @param nh  Handle of a separate thread, in which the callbacks take some milliseconds at most.
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

/// Message type that a source expects on a topic, such as "sensor_msgs/LaserScan".
[[nodiscard]] const char* datatypeOf(SourceType type, const std::string& topic);

/// Advice for sensor messages that cannot be mapped directly; empty for all other types.
[[nodiscard]] std::string adviseOn(const std::string& datatype);

/// Error and cure if a topic has another type than its source; else empty.
[[nodiscard]] std::string describeWrongType(const SourceParameters& source,
                                            const std::string& topic, const std::string& datatype);

}  // namespace cuboid_mapping_ros
