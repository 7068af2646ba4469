// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/mapping/source_subscriber.h"

#include "cuboid_mapping/ros/conversions/compressed_depth.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"

#include <ros/message_traits.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// Messages that roscpp keeps before it drops them silently. This limit is never reached: each message goes to
/// the CloudQueue on arrival, whose limits count.
constexpr std::uint32_t kReceiveQueueSize = 1000;

}  // namespace

std::string cameraInfoBeside(const std::string& image_topic) {
  const std::string topic = withoutTransport(image_topic);
  return topic.substr(0, topic.rfind('/') + 1) + "camera_info";
}

SourceSubscriber::SourceSubscriber(const ros::NodeHandle& nh, const SourceParameters& source,
                                   std::size_t index, Callbacks callbacks)
    : nh_(nh),
      index_(index),
      callbacks_(std::move(callbacks)),
      topic_(nh.resolveName(source.topic)) {
  switch (source.type) {
    case SourceType::kPointCloud: listen<sensor_msgs::PointCloud2>(); break;
    case SourceType::kLaserScan: listen<sensor_msgs::LaserScan>(); break;
    case SourceType::kDepthImage: listenToDepth(source); break;
  }
}

template <typename MessageT>
void SourceSubscriber::listen() {
  subscribers_.push_back(
      subscribeTo<MessageT>(nh_, topic_, kReceiveQueueSize, [this](const auto& message) {
        if (callbacks_.arrived(index_, message->header)) callbacks_.take({message, index_});
      }));
}

void SourceSubscriber::listenToDepth(const SourceParameters& source) {
  const std::string camera_topic =
      source.camera_info.empty() ? cameraInfoBeside(topic_) : nh_.resolveName(source.camera_info);
  pairs_ = std::make_unique<DepthPairs>(DepthPairs::Callbacks{
      [this](const DepthImage& depth) {
        callbacks_.take({depth, index_});
      },
      [this, camera_topic] {
        callbacks_.drop(index_, "nothing has come on " + camera_topic +
                                    ": check its publisher, or name the topic in camera_info");
      }});
  const auto take_image = [this](const sensor_msgs::Image::ConstPtr& image) {
    if (callbacks_.arrived(index_, image->header)) pairs_->add(image);
  };
  const auto take_compressed = [this](const sensor_msgs::CompressedImage::ConstPtr& image) {
    if (callbacks_.arrived(index_, image->header)) pairs_->add(toCompressedImage(*image));
  };
  subscribers_.push_back(isCompressed(topic_) ? subscribeTo<sensor_msgs::CompressedImage>(
                                                    nh_, topic_, kReceiveQueueSize, take_compressed)
                                              : subscribeTo<sensor_msgs::Image>(
                                                    nh_, topic_, kReceiveQueueSize, take_image));
  subscribers_.push_back(subscribeTo<sensor_msgs::CameraInfo>(
      nh_, camera_topic, kReceiveQueueSize, [this](const auto& camera) { pairs_->add(camera); }));
}

double stampDistance(const ros::Time& camera, const ros::Time& image) {
  return camera.isZero() ? 0.0 : std::abs(camera.toSec() - image.toSec());
}

void DepthPairs::add(const sensor_msgs::Image::ConstPtr& image) {
  images_.push_back(image);
  ++num_images_since_camera_;
  const auto waits = [this] {
    if (cameras_.empty()) return images_.size() <= kMaxCameras;
    const ros::Time& newest = cameras_.back()->header.stamp;
    const bool may_come = !newest.isZero() && newest < images_.front()->header.stamp &&
                          num_images_since_camera_ <= kMaxWaiting;
    return may_come && images_.size() <= kMaxWaiting;
  };
  while (!images_.empty() && !waits()) takeOldest();
}

void DepthPairs::add(const sensor_msgs::CameraInfo::ConstPtr& camera) {
  const auto is_uncalibrated = [](const auto& other) { return !hasFocalLength(*other); };
  // Without any calibrated one, the refusal of the images says so.
  if (is_uncalibrated(camera)) {
    if (!cameras_.empty() && !is_uncalibrated(cameras_.back())) return;
  } else {
    cameras_.erase(std::remove_if(cameras_.begin(), cameras_.end(), is_uncalibrated),
                   cameras_.end());
  }
  cameras_.push_back(camera);
  if (cameras_.size() > kMaxCameras) cameras_.pop_front();
  num_images_since_camera_ = 0;
  const ros::Time& stamp = camera->header.stamp;
  while (!images_.empty() && (stamp.isZero() || stamp >= images_.front()->header.stamp)) {
    takeOldest();
  }
}

void DepthPairs::takeOldest() {
  const auto image = images_.front();
  images_.pop_front();
  if (cameras_.empty()) return callbacks_.drop();
  const ros::Time& stamp = image->header.stamp;
  const auto nearest =
      std::min_element(cameras_.begin(), cameras_.end(), [&stamp](const auto& a, const auto& b) {
        return stampDistance(a->header.stamp, stamp) < stampDistance(b->header.stamp, stamp);
      });
  callbacks_.take({image, *nearest});
}

const char* datatypeOf(SourceType type, const std::string& topic) {
  using ros::message_traits::datatype;
  if (type == SourceType::kLaserScan) return datatype<sensor_msgs::LaserScan>();
  if (type == SourceType::kPointCloud) return datatype<sensor_msgs::PointCloud2>();
  return isCompressed(topic) ? datatype<sensor_msgs::CompressedImage>()
                             : datatype<sensor_msgs::Image>();
}

std::string adviseOn(const std::string& datatype) {
  constexpr std::array<std::pair<const char*, const char*>, 6> kAdvice{
      {{"sensor_msgs/PointCloud", "convert it with point_cloud_converter"},
       {"sensor_msgs/MultiEchoLaserScan", "take one echo of it with laser_proc"},
       {"velodyne_msgs/VelodyneScan", "make clouds of its packets with velodyne_pointcloud"},
       {"ouster_ros/PacketMsg", "make clouds of its packets with ouster_ros"},
       {"livox_ros_driver/CustomMsg", "have the driver send PointCloud2 (xfer_format 0)"},
       {"livox_ros_driver2/CustomMsg", "have the driver send PointCloud2 (xfer_format 0)"}}};
  for (const auto& [name, advice] : kAdvice) {
    if (datatype == name) return advice;
  }
  return "";
}

std::string describeWrongType(const SourceParameters& source, const std::string& topic,
                              const std::string& datatype) {
  if (datatype == datatypeOf(source.type, topic)) return "";
  std::string cure = adviseOn(datatype);
  for (const SourceType type :
       {SourceType::kPointCloud, SourceType::kLaserScan, SourceType::kDepthImage}) {
    if (datatype == datatypeOf(type, topic))
      cure = std::string("set type to ") + toString(type) + " (roslaunch: type:=" + toString(type) +
             ")";
  }
  if (cure.empty()) cure = "name a topic of clouds, planar scans or depth images";
  return topic + " has messages of " + datatype + ", not of " + datatypeOf(source.type, topic) +
         " (type " + toString(source.type) + "): " + cure;
}

}  // namespace cuboid_mapping_ros
