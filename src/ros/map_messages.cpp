// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/map_messages.h"

#include "cuboid_mapping/CuboidMap.h"
#include "cuboid_mapping/CuboidMapUpdate.h"
#include "cuboid_mapping/GetMap.h"

#include <ros/single_subscriber_publisher.h>
#include <boost/function.hpp>

#include <exception>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using ImageType = cuboid_mapping::CuboidMap;
using DeltaType = cuboid_mapping::CuboidMapUpdate;
using cuboid_mapping::GetMap;

/// Deltas that may wait for a listener: many minutes of them would be of no use.
constexpr std::uint32_t kDeltaQueue = 20;

ImageType toMessage(ImageMessage&& from) {
  ImageType message;
  message.header = std::move(from.header);
  message.instance = from.image.instance;
  message.revision = from.image.revision;
  message.resolution = from.image.resolution_m;
  message.bounds = std::move(from.image.bounds);
  message.log_odds = std::move(from.image.log_odds);
  return message;
}

ImageMessage fromMessage(const ImageType& message) {
  return {
      message.header,
      {message.instance, message.revision, message.resolution, message.bounds, message.log_odds}};
}

DeltaType toMessage(DeltaMessage&& from) {
  DeltaType message;
  message.header = std::move(from.header);
  message.instance = from.delta.instance;
  message.base = from.delta.base;
  message.revision = from.delta.revision;
  message.everything = static_cast<std::uint8_t>(from.delta.is_everything);
  message.resolution = from.delta.resolution_m;
  message.boxes = std::move(from.delta.boxes);
  message.counts = std::move(from.delta.counts);
  message.offsets = std::move(from.delta.offsets);
  message.log_odds = std::move(from.delta.log_odds);
  return message;
}

DeltaMessage fromMessage(const DeltaType& message) {
  return {message.header,
          {message.instance, message.base, message.revision, message.everything != 0,
           message.resolution, message.boxes, message.counts, message.offsets, message.log_odds}};
}

}  // namespace

ros::Publisher advertiseImage(ros::NodeHandle& nh, const std::string& topic,
                              std::function<ImageMessage()> make) {
  const auto on_connect = [make = std::move(make)](const ros::SingleSubscriberPublisher& listener) {
    listener.publish(toMessage(make()));
  };
  return nh.advertise<ImageType>(topic, 1, on_connect);
}

void publishImage(const ros::Publisher& publisher, ImageMessage message) {
  publisher.publish(toMessage(std::move(message)));
}

ros::Publisher advertiseDelta(ros::NodeHandle& nh, const std::string& topic) {
  return nh.advertise<DeltaType>(topic, kDeltaQueue);
}

std::size_t publishDelta(const ros::Publisher& publisher, DeltaMessage message) {
  const DeltaType type = toMessage(std::move(message));
  publisher.publish(type);
  return ros::serialization::serializationLength(type);
}

ros::ServiceServer advertiseGetMap(ros::NodeHandle& nh, const std::string& name,
                                   std::function<ImageMessage()> make) {
  const boost::function<bool(GetMap::Request&, GetMap::Response&)> callback =
      [make = std::move(make)](GetMap::Request& /*request*/, GetMap::Response& response) {
        try {
          response.map = toMessage(make());
          response.success = static_cast<std::uint8_t>(true);
        } catch (const std::exception& exception) {
          response.message = std::string("the node could not answer: ") + exception.what();
        }
        return true;
      };
  return nh.advertiseService(name, callback);
}

ros::Subscriber subscribeImage(ros::NodeHandle& nh, const std::string& topic,
                               std::function<void(const ImageMessage&)> take) {
  const boost::function<void(const ImageType::ConstPtr&)> callback =
      [take = std::move(take)](const ImageType::ConstPtr& message) { take(fromMessage(*message)); };
  return nh.subscribe<ImageType>(topic, 1, callback);
}

ros::Subscriber subscribeDelta(ros::NodeHandle& nh, const std::string& topic,
                               std::function<void(const DeltaMessage&)> take) {
  const boost::function<void(const DeltaType::ConstPtr&)> callback =
      [take = std::move(take)](const DeltaType::ConstPtr& message) { take(fromMessage(*message)); };
  return nh.subscribe<DeltaType>(topic, kDeltaQueue, callback);
}

bool callGetMap(ros::NodeHandle& nh, const std::string& name, ImageMessage& message,
                std::string& error) {
  GetMap service;
  if (!nh.serviceClient<GetMap>(name).call(service)) {
    error = "no answer from " + nh.resolveName(name);
    return false;
  }
  error = service.response.message;
  if (service.response.success == 0) return false;
  message = fromMessage(service.response.map);
  return true;
}

}  // namespace cuboid_mapping_ros
