// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/sharing/map_publisher.h"

#include "cuboid_mapping/io/packed_bricks.h"
#include "cuboid_mapping/ros/map/map_storage.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/publish.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"
#include "cuboid_mapping/sharing/map_follower.h"

#include <algorithm>
#include <exception>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// Parts in the queue of a slow subscriber, which asks the service for lost ones.
constexpr std::uint32_t kQueueSize = 2;
/// Queue of updates for a subscriber: older ones would be of no use.
constexpr std::uint32_t kUpdatesQueue = 20;
/// Time between two parts of a keyframe.
constexpr double kTimerPeriod_s = 0.05;

/// Bricks in a message of about 100 MB: the whole map is not much larger.
constexpr std::size_t kMaxDeltaBricks = 200000;

bool isTooMuch(const ChangeSet& changes) { return changes.bricks.size() > kMaxDeltaBricks; }

ChangeSet everythingOf(const ChangeSet& changes) { return {changes.revision, true, {}}; }

}  // namespace

MapImageServer::MapImageServer(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                               const Options& options, Make make, Note note)
    : options_(options), make_(std::move(make)), note_(std::move(note)) {
  topic_.emplace(nh, kCuboidMapTopic, kQueueSize, [this](const auto& listener) {
    listener.publish(current(options_.topic_detail).parts.front());
  });
  server_ = offerService<GetMap>(
      private_nh, kGetMapService,
      [this, &guard = guardOf(nh)](const auto& request, auto& response) {
        try {
          answer(request, response);
        } catch (const std::exception& exception) {
          guard.noteFailure(kGetMapService, exception.what());
          response = GetMap::Response();
          response.info.message = std::string("the node could not answer: ") + exception.what();
        }
      });
  timer_ = Timer(nh, kTimerPeriod_s, [this] { onTimer(); });
}

void MapImageServer::onTimer() {
  forgetOld();
  if (!topic_->hasListeners()) {
    outgoing_.clear();
  } else if (!outgoing_.empty()) {
    topic_->publish(outgoing_.front());
    outgoing_.pop_front();
  } else if (is_publish_due_ || isKeyframeDue()) {
    is_publish_due_ = false;
    const Kept& image = current(options_.topic_detail);
    outgoing_.assign(image.parts.begin(), image.parts.end());
    keyframe_revision_ = image.revision();
    next_keyframe_ = std::max(
        image.good_until, ros::SteadyTime::now() + ros::WallDuration(options_.keyframe_period_s));
  }
}

bool MapImageServer::isKeyframeDue() const {
  return options_.keyframe_period_s > 0.0 && keyframe_revision_ != updated_revision_ &&
         ros::SteadyTime::now() >= next_keyframe_;
}

MapImageServer::Kept& MapImageServer::current(MapDetail detail) {
  const ros::SteadyTime start = ros::SteadyTime::now();
  for (Kept& kept : kept_) {
    const bool is_current = kept.revision() >= updated_revision_ && start < kept.good_until;
    if (kept.detail != detail || !is_current) continue;
    kept.used = start;
    return kept;
  }
  const ImageMessage whole = make_(detail);
  if (Kept* const kept = find(detail, whole.image.revision)) return *kept;
  std::vector<Message> parts = makeParts(whole);
  if (kept_.size() == kKept) kept_.pop_front();
  const ros::SteadyTime end = ros::SteadyTime::now();
  kept_.push_back({detail, std::move(parts), end, endOfRest(start, end)});
  return kept_.back();
}

void MapImageServer::forgetOld() {
  const ros::SteadyTime now = ros::SteadyTime::now();
  const auto is_old = [now](const Kept& kept) {
    return now - kept.used > ros::WallDuration(kKeptFor_s);
  };
  kept_.erase(std::remove_if(kept_.begin(), kept_.end(), is_old), kept_.end());
}

std::vector<MapImageServer::Message> MapImageServer::makeParts(const ImageMessage& whole) const {
  std::vector<Message> parts;
  const MapImage& image = whole.image;
  const VoxelBrick* first = image.bricks.data();
  const VoxelBrick* const last = first + image.bricks.size();
  do {
    const auto* const end = endOfPart(first, last, image.detail, options_.max_part_bytes);
    parts.push_back(toMessage(whole, first, end));
    first = end;
  } while (first != last);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    parts[i].part = static_cast<std::uint32_t>(i);
    parts[i].num_parts = static_cast<std::uint32_t>(parts.size());
  }
  return parts;
}

void MapImageServer::answer(const GetMap::Request& request, GetMap::Response& response) {
  const MapDetail detail = request.with_values != 0 ? MapDetail::kValues : MapDetail::kClasses;
  if (request.part == 0) {
    response.map = current(detail).parts.front();
    response.info.message = note_();
  } else {
    const Kept* const kept = find(detail, request.revision);
    if (kept == nullptr || request.part >= kept->parts.size()) {
      response.info.message = "there is no part " + std::to_string(request.part) + " of revision " +
                              std::to_string(request.revision) +
                              " (any more): begin again with part 0";
      return;
    }
    response.map = kept->parts[request.part];
  }
  response.info.header = response.map.header;
  response.info.revision = response.map.revision;
  response.info.instance = response.map.instance;
  response.info.replacements = response.map.replacements;
  response.info.success = static_cast<std::uint8_t>(true);
}

MapImageServer::Kept* MapImageServer::find(MapDetail detail, std::uint64_t revision) {
  for (Kept& kept : kept_) {
    if (kept.detail != detail || kept.revision() != revision) continue;
    kept.used = ros::SteadyTime::now();
    return &kept;
  }
  return nullptr;
}

MapPublisher::MapPublisher(const MapHost& host)
    : map_(host.map),
      server_(host.private_nh.getNamespace()),
      frame_id_(withoutSlash(host.parameters.frame_id)),
      detail_(host.parameters.publish_values ? MapDetail::kValues : MapDetail::kClasses),
      delta_publisher_(ros::NodeHandle(host.nh).advertise<CuboidMapUpdate>(kCuboidMapUpdatesTopic,
                                                                           kUpdatesQueue)),
      images_(
          withQueue(host.nh, host.slow_queue), withQueue(host.private_nh, host.slow_queue),
          {detail_, MapImageServer::kMaxPartBytes, host.parameters.keyframe_period_s},
          [this](MapDetail detail) { return makeImage(detail); },
          [this] { return describeLeftOut(); }) {}

std::string MapPublisher::name() const { return kCuboidMapUpdatesTopic; }

ImageMessage MapPublisher::makeImage(MapDetail detail) const {
  return map_.readWhole([&](const CuboidMap& map, const ros::Time& stamp) {
    ImageMessage message;
    message.server = server_;
    message.image = cuboid_mapping::makeImage(map, map_.instance(), detail);
    message.image.label = label(stamp);
    return message;
  });
}

/// @pre Nobody changes the map.
MapLabel MapPublisher::label(const ros::Time& stamp) const {
  return {frame_id_, static_cast<std::int64_t>(stamp.toNSec()), map_.numReplaced()};
}

std::string MapPublisher::describeLeftOut() const {
  const auto window = map_.windowFigures();
  if (!window || window->num_on_disk_only == 0) return {};
  return "this is the map in memory, as on the topics, without " +
         describePages(window->num_on_disk_only) + ", on disk: ~save_map writes all";
}

void MapPublisher::onChanges(const MapChanges& changes) {
  const bool is_too_much = isTooMuch(changes.changed);
  message_ = {};
  message_.server = server_;
  if (delta_publisher_.getNumSubscribers() > 0) {
    message_.delta =
        makeDelta(changes.map, is_too_much ? everythingOf(changes.changed) : changes.changed,
                  map_.instance(), published_revision_, detail_);
  }
  message_.delta.label = label(changes.stamp);
  message_.delta.revision = changes.map.revision();
  message_.delta.is_everything = changes.changed.is_everything || is_too_much;
}

void MapPublisher::publish() {
  published_revision_ = message_.delta.revision;
  if (message_.delta.instance != 0) publishLarge(delta_publisher_, toMessage(message_));
  images_.noteUpdate(published_revision_);
  if (message_.delta.is_everything) images_.publishSoon();
}

std::vector<ParameterDeclaration> MapPublisher::declare() {
  using P = NodeParameters;
  return {
      {"publish_values", "", boolean(&P::publish_values),
       "true: cuboid_map and cuboid_map_updates carry the log-odds of every voxel. false: only "
       "classes, which suffice for planners."},
  };
}

}  // namespace cuboid_mapping_ros
