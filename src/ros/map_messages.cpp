// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/map_messages.h"

#include "cuboid_mapping/CuboidMap.h"
#include "cuboid_mapping/CuboidMapUpdate.h"
#include "cuboid_mapping/GetMap.h"
#include "cuboid_mapping/ros/delta_codec.h"

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
  auto packed = packArrays(from.delta);
  if (!packed) {  // Too many values for the message: listeners have to ask for the map.
    message.everything = static_cast<std::uint8_t>(true);
    return message;
  }
  message.num_boxes = packed->num_boxes;
  message.num_cuboids = packed->num_cuboids;
  message.values = std::move(packed->values);
  message.data = std::move(packed->data);
  return message;
}

DeltaMessage fromMessage(const DeltaType& message) {
  DeltaMessage result;
  result.header = message.header;
  result.delta.instance = message.instance;
  result.delta.base = message.base;
  result.delta.revision = message.revision;
  result.delta.is_everything = message.everything != 0;
  result.delta.resolution_m = message.resolution;
  if (result.delta.is_everything) return result;
  const PackedDelta packed{message.num_boxes, message.num_cuboids, message.values, message.data};
  // Damaged: that is as if everything had changed, the listener asks for the map.
  result.delta.is_everything = !unpackArrays(packed, result.delta);
  return result;
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
