// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/map_messages.h"

#include "cuboid_mapping/CuboidBricks.h"
#include "cuboid_mapping/CuboidMapUpdate.h"
#include "cuboid_mapping/GetMap.h"
#include "cuboid_mapping/io/brick_codec.h"
#include "cuboid_mapping/ros/middleware/checked_messages.h"

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

ImageMessage fromMessage(const ImageType& message) {
  ImageMessage result{message.header, {message.instance, message.revision, message.resolution, {}}};
  // Without a resolution no follower takes it.
  if (!fromMessage(message.bricks, result.image.content)) result.image.resolution_m = 0.0;
  result.num_parts = message.num_parts;
  return result;
}

DeltaType toMessage(const DeltaMessage& from) {
  DeltaType message;
  message.header = from.header;
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
  // Damaged: that is as if everything had changed, the listener asks for the map.
  result.delta.is_everything |= !fromMessage(message.bricks, result.delta.content);
  // In any case: tells the listener what to ask for.
  result.delta.content.has_values = message.bricks.has_values != 0;
  return result;
}

/// Calls GetMap for one part.
bool callForPart(ros::NodeHandle& nh, const std::string& name, GetMap& service,
                 std::string& error) {
  if (!callChecked(nh, name, service, error)) return false;
  error = service.response.message;
  return service.response.success != 0;
}

}  // namespace

ImageType toMessage(const ImageMessage& from, const cuboid_mapping::BrickArrays& content) {
  ImageType message;
  message.header = from.header;
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
  return subscribeGuarded<ImageType>(
      nh, topic, {1, false},
      [take = std::move(take)](const ros::MessageEvent<const ImageType>& event) {
        take(fromMessage(*event.getConstMessage()));
      });
}

ros::Subscriber subscribeDelta(ros::NodeHandle& nh, const std::string& topic,
                               std::function<void(const DeltaMessage&)> take) {
  return subscribeGuarded<DeltaType>(
      nh, topic, {kReceivedDeltas, false},
      [take = std::move(take)](const ros::MessageEvent<const DeltaType>& event) {
        take(fromMessage(*event.getConstMessage()));
      });
}

bool callGetMap(ros::NodeHandle& nh, const std::string& name, MapDetail detail,
                ImageMessage& message, std::string& error) {
  GetMap service;
  service.request.with_values = static_cast<std::uint8_t>(detail == MapDetail::kValues);
  if (!callForPart(nh, name, service, error)) return false;
  message = fromMessage(service.response.map);
  return fetchOtherParts(nh, name, message, error);
}

bool fetchOtherParts(ros::NodeHandle& nh, const std::string& name, ImageMessage& message,
                     std::string& error) {
  GetMap service;
  service.request.with_values = static_cast<std::uint8_t>(message.image.content.has_values);
  service.request.revision = message.image.revision;
  for (std::uint32_t part = 1; part < message.num_parts; ++part) {
    service.request.part = part;
    if (!callForPart(nh, name, service, error)) return false;
    const ImageMessage other = fromMessage(service.response.map);
    const bool is_of_it = service.response.map.part == part &&
                          other.image.instance == message.image.instance &&
                          other.image.revision == message.image.revision &&
                          other.image.content.has_values == message.image.content.has_values;
    if (!is_of_it || other.image.resolution_m != message.image.resolution_m) {
      error = "part " + std::to_string(part) + " of the map is damaged";
      return false;
    }
    appendBricks(other.image.content, message.image.content);
  }
  message.num_parts = 1;
  return true;
}

}  // namespace cuboid_mapping_ros
