// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/publishers/map_image_server.h"

#include "cuboid_mapping/io/brick_codec.h"
#include "cuboid_mapping/ros/middleware/checked_messages.h"
#include "cuboid_mapping/ros/middleware/names.h"

#include <ros/single_subscriber_publisher.h>

#include <algorithm>
#include <exception>
#include <utility>

namespace cuboid_mapping_ros {

using cuboid_mapping::GetMap;
using cuboid_mapping::MapDetail;

MapImageServer::MapImageServer(ros::NodeHandle nh, ros::NodeHandle private_nh,
                               const Options& options, Make make, Note note)
    : options_(options), make_(std::move(make)), note_(std::move(note)) {
  publisher_ = nh.advertise<Message>(kCuboidMapTopic, 1,
                                     [this](const ros::SingleSubscriberPublisher& listener) {
                                       listener.publish(makeFirst(options_.topic_detail));
                                     });
  CallbackGuard& guard = guardOf(private_nh);
  server_ = advertiseGuarded<GetMap::Request, GetMap::Response>(
      private_nh, kGetMapService,
      [this, &guard](GetMap::Request& request, GetMap::Response& response) {
        try {
          answer(request, response);
        } catch (const std::exception& exception) {
          guard.noteFailure(kGetMapService, exception.what());
          response = GetMap::Response();
          response.message = std::string("the node could not answer: ") + exception.what();
        }
        return true;
      });
}

void MapImageServer::publish() { publisher_.publish(makeFirst(options_.topic_detail)); }

void MapImageServer::forgetOld() {
  const ros::WallTime now = ros::WallTime::now();
  const auto is_old = [now](const Kept& kept) {
    return now - kept.used > ros::WallDuration(kKeptFor_s);
  };
  kept_.erase(std::remove_if(kept_.begin(), kept_.end(), is_old), kept_.end());
}

MapImageServer::Message MapImageServer::makeFirst(MapDetail detail) {
  const ImageMessage whole = make_(detail);
  if (Kept* const kept = find(detail, whole.image.revision)) return kept->parts.front();
  std::vector<Message> parts = makeParts(whole);
  if (parts.size() == 1) return std::move(parts.front());
  if (kept_.size() == kKept) kept_.pop_front();
  kept_.push_back({detail, std::move(parts), ros::WallTime::now()});
  return kept_.back().parts.front();
}

std::vector<MapImageServer::Message> MapImageServer::makeParts(const ImageMessage& whole) const {
  std::vector<Message> parts;
  cuboid_mapping::BrickSplitter splitter(whole.image.content, options_.max_part_bytes);
  do {
    parts.push_back(toMessage(whole, splitter.next()));
  } while (!splitter.isDone());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    parts[i].part = static_cast<std::uint32_t>(i);
    parts[i].num_parts = static_cast<std::uint32_t>(parts.size());
  }
  return parts;
}

void MapImageServer::answer(const GetMap::Request& request, GetMap::Response& response) {
  const MapDetail detail = request.with_values != 0 ? MapDetail::kValues : MapDetail::kClasses;
  if (request.part == 0) {
    response.map = makeFirst(detail);
    response.message = note_();
    response.success = static_cast<std::uint8_t>(true);
    return;
  }
  const Kept* const kept = find(detail, request.revision);
  if (kept == nullptr || request.part >= kept->parts.size()) {
    response.message = "there is no part " + std::to_string(request.part) + " of revision " +
                       std::to_string(request.revision) + " (any more): begin again with part 0";
    return;
  }
  response.map = kept->parts[request.part];
  response.success = static_cast<std::uint8_t>(true);
}

MapImageServer::Kept* MapImageServer::find(MapDetail detail, std::uint64_t revision) {
  for (Kept& kept : kept_) {
    if (kept.detail != detail || kept.parts.front().revision != revision) continue;
    kept.used = ros::WallTime::now();
    return &kept;
  }
  return nullptr;
}

}  // namespace cuboid_mapping_ros
