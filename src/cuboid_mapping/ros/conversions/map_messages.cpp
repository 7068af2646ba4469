// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/map_messages.h"

#include "cuboid_mapping/CuboidBricks.h"
#include "cuboid_mapping/io/packed_bricks.h"

#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

CuboidBricks toMessage(const VoxelBrick* first, const VoxelBrick* last, MapDetail detail) {
  PackedBricks packed = packBricks(first, last, detail);
  CuboidBricks message;
  message.num_bricks = packed.num_bricks;
  message.has_values = static_cast<std::uint8_t>(packed.has_values);
  message.num_values = packed.num_values;
  message.data = std::move(packed.data);
  return message;
}

MapDetail detailOf(const CuboidBricks& message) {
  return message.has_values != 0 ? MapDetail::kValues : MapDetail::kClasses;
}

bool readBricks(const CuboidBricks& message, std::vector<VoxelBrick>& bricks) {
  const PackedBricks packed{message.num_bricks, message.num_values, message.has_values != 0,
                            message.data};
  auto unpacked = unpackBricks(packed);
  if (unpacked) bricks = std::move(*unpacked);
  return unpacked.has_value();
}

template <typename MessageT>
MapLabel labelOf(const MessageT& message) {
  return {message.header.frame_id, static_cast<std::int64_t>(message.header.stamp.toNSec()),
          message.replacements};
}

template <typename MessageT>
void setLabel(const MapLabel& label, MessageT& message) {
  message.header.frame_id = label.frame_id;
  message.header.stamp.fromNSec(static_cast<std::uint64_t>(label.stamp_ns));
  message.replacements = label.num_replaced;
}

/// Whether the voxels lie at multiples of the resolution, as they do here.
bool isAtZero(const geometry_msgs::Point& origin) {
  return origin.x == 0.0 && origin.y == 0.0 && origin.z == 0.0;
}

}  // namespace

ImageMessage fromMessage(const FullCuboidMap& message) {
  ImageMessage result;
  result.image = {
      message.instance, message.revision, message.resolution, detailOf(message.bricks), {},
      labelOf(message)};
  // Followers refuse an image without a resolution.
  if (!isAtZero(message.origin) || !readBricks(message.bricks, result.image.bricks)) {
    result.image.resolution_m = 0.0;
  }
  result.num_parts = message.num_parts;
  result.part = message.part;
  result.server = message.server;
  return result;
}

CuboidMapUpdate toMessage(const DeltaMessage& from) {
  CuboidMapUpdate message;
  setLabel(from.delta.label, message);
  message.server = from.server;
  message.instance = from.delta.instance;
  message.base = from.delta.base;
  message.revision = from.delta.revision;
  message.everything = static_cast<std::uint8_t>(from.delta.is_everything);
  message.resolution = from.delta.resolution_m;
  const std::vector<VoxelBrick>& bricks = from.delta.bricks;
  message.bricks = toMessage(bricks.data(), bricks.data() + bricks.size(), from.delta.detail);
  return message;
}

DeltaMessage fromMessage(const CuboidMapUpdate& message) {
  DeltaMessage result;
  result.delta.label = labelOf(message);
  result.delta.instance = message.instance;
  result.delta.base = message.base;
  result.delta.revision = message.revision;
  result.delta.is_everything = message.everything != 0;
  result.delta.resolution_m = message.resolution;
  result.server = message.server;
  // A damaged message counts as a change of everything: the client asks for the map.
  result.delta.is_everything |=
      !isAtZero(message.origin) || !readBricks(message.bricks, result.delta.bricks);
  // Set also for a damaged message: the client asks for a map of this detail.
  result.delta.detail = detailOf(message.bricks);
  return result;
}

FullCuboidMap toMessage(const ImageMessage& from, const VoxelBrick* first, const VoxelBrick* last) {
  FullCuboidMap message;
  setLabel(from.image.label, message);
  message.server = from.server;
  message.instance = from.image.instance;
  message.revision = from.image.revision;
  message.resolution = from.image.resolution_m;
  message.num_parts = 1;
  message.bricks = toMessage(first, last, from.image.detail);
  return message;
}

FullCuboidMap toMessage(const ImageMessage& from) {
  const std::vector<VoxelBrick>& bricks = from.image.bricks;
  return toMessage(from, bricks.data(), bricks.data() + bricks.size());
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
  service.request.with_values =
      static_cast<std::uint8_t>(message.image.detail == MapDetail::kValues);
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
                       part.image.detail == message.image.detail;
  if (!is_next) return false;
  message.image.bricks.insert(message.image.bricks.end(), part.image.bricks.begin(),
                              part.image.bricks.end());
  message.part = part.part;
  return true;
}

}  // namespace cuboid_mapping_ros
