// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/map_messages.h"

#include "cuboid_mapping/CuboidBricks.h"
#include "cuboid_mapping/CuboidMapUpdate.h"
#include "cuboid_mapping/io/brick_codec.h"

#include <string>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using BricksType = cuboid_mapping::CuboidBricks;
using ImageType = cuboid_mapping::FullCuboidMap;
using DeltaType = cuboid_mapping::CuboidMapUpdate;
using cuboid_mapping::GetMap;
using cuboid_mapping::MapDetail;

/// Deltas that may wait for a listener: many minutes of them would be of no use.
constexpr std::uint32_t kDeltaQueue = 20;
/// Deltas that may wait while a listener fetches the parts of a map.
constexpr std::uint32_t kReceivedDeltas = 500;
/// Parts of a map that may wait.
constexpr std::uint32_t kReceivedParts = 100;

BricksType toMessage(const cuboid_mapping::BrickArrays& arrays) {
  cuboid_mapping::PackedBricks packed = packBricks(arrays);
  BricksType message;
  message.num_bricks = packed.num_bricks;
  message.num_cuboids = packed.num_cuboids;
  message.has_values = static_cast<std::uint8_t>(packed.has_values);
  message.values = std::move(packed.values);
  message.data = std::move(packed.data);
  return message;
}

bool fromMessage(const BricksType& message, cuboid_mapping::BrickArrays& arrays) {
  return unpackBricks({message.num_bricks, message.num_cuboids, message.has_values != 0,
                       message.values, message.data},
                      arrays);
}

/// Voxels of a map here lie at multiples of the resolution.
bool isAtZero(const geometry_msgs::Point& origin) {
  return origin.x == 0.0 && origin.y == 0.0 && origin.z == 0.0;
}

ImageMessage fromMessage(const ImageType& message) {
  ImageMessage result;
  result.header = message.header;
  result.image = {message.instance, message.revision, message.resolution, {}};
  // Without a resolution no follower takes it.
  if (!isAtZero(message.origin) || !fromMessage(message.bricks, result.image.content)) {
    result.image.resolution_m = 0.0;
  }
  result.num_parts = message.num_parts;
  result.part = message.part;
  result.server = message.server;
  return result;
}

DeltaType toMessage(const DeltaMessage& from) {
  DeltaType message;
  message.header = from.header;
  message.server = from.server;
  message.instance = from.delta.instance;
  message.base = from.delta.base;
  message.revision = from.delta.revision;
  message.everything = static_cast<std::uint8_t>(from.delta.is_everything);
  message.resolution = from.delta.resolution_m;
  message.bricks = toMessage(from.delta.content);
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
  result.server = message.server;
  // Damaged: that is as if everything had changed, the listener asks for the map.
  result.delta.is_everything |=
      !isAtZero(message.origin) || !fromMessage(message.bricks, result.delta.content);
  // In any case: tells the listener what to ask for.
  result.delta.content.has_values = message.bricks.has_values != 0;
  return result;
}

}  // namespace

ImageType toMessage(const ImageMessage& from, const cuboid_mapping::BrickArrays& content) {
  ImageType message;
  message.header = from.header;
  message.server = from.server;
  message.instance = from.image.instance;
  message.revision = from.image.revision;
  message.resolution = from.image.resolution_m;
  message.num_parts = 1;
  message.bricks = toMessage(content);
  return message;
}

ros::Publisher advertiseDelta(ros::NodeHandle& nh, const std::string& topic) {
  return nh.advertise<DeltaType>(topic, kDeltaQueue);
}

std::size_t publishDelta(const ros::Publisher& publisher, const DeltaMessage& message) {
  const DeltaType type = toMessage(message);
  publisher.publish(type);
  return ros::serialization::serializationLength(type);
}

ros::Subscriber subscribeImage(ros::NodeHandle& nh, const std::string& topic,
                               std::function<void(const ImageMessage&)> take) {
  const boost::function<void(const ImageType::ConstPtr&)> callback =
      [take = std::move(take)](const ImageType::ConstPtr& message) { take(fromMessage(*message)); };
  return nh.subscribe(topic, kReceivedParts, callback);
}

ros::Subscriber subscribeDelta(ros::NodeHandle& nh, const std::string& topic,
                               std::function<void(const DeltaMessage&)> take) {
  const boost::function<void(const DeltaType::ConstPtr&)> callback =
      [take = std::move(take)](const DeltaType::ConstPtr& message) { take(fromMessage(*message)); };
  return nh.subscribe(topic, kReceivedDeltas, callback);
}

bool GetMapClient::call(const std::string& name, MapDetail detail, ImageMessage& message,
                        std::string& error) {
  GetMap service;
  service.request.with_values = static_cast<std::uint8_t>(detail == MapDetail::kValues);
  if (!callForPart(name, service, error)) return false;
  message = fromMessage(service.response.map);
  return callForRest(name, message, error);
}

bool GetMapClient::callForRest(const std::string& name, ImageMessage& message, std::string& error) {
  GetMap service;
  service.request.with_values = static_cast<std::uint8_t>(message.image.content.has_values);
  service.request.revision = message.image.revision;
  while (message.part + 1 < message.num_parts) {
    service.request.part = message.part + 1;
    if (!callForPart(name, service, error)) return false;
    if (!appendPart(fromMessage(service.response.map), message)) {
      error = "part " + std::to_string(service.request.part) + " of the map is damaged";
      return false;
    }
  }
  return true;
}

bool GetMapClient::callForPart(const std::string& name, GetMap& service, std::string& error) {
  if (!calls_.call(nh_, name, service)) {
    error = "no answer from " + nh_.resolveName(name);
    return false;
  }
  error = service.response.info.message;
  return service.response.info.success != 0;
}

bool appendPart(const ImageMessage& part, ImageMessage& message) {
  const bool is_next = part.part == message.part + 1 && part.num_parts == message.num_parts &&
                       part.image.instance == message.image.instance &&
                       part.image.revision == message.image.revision &&
                       part.image.resolution_m == message.image.resolution_m &&
                       part.image.content.has_values == message.image.content.has_values;
  if (!is_next) return false;
  appendBricks(part.image.content, message.image.content);
  message.part = part.part;
  return true;
}

}  // namespace cuboid_mapping_ros
