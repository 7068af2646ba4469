// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/publishers/map_publisher.h"

#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/sharing/map_follower.h"

namespace cuboid_mapping_ros {

namespace {

/// Bricks in a message of about 100 MB: the whole map is not much larger.
constexpr std::size_t kMaxDeltaBricks = 200000;

bool isTooMuch(const ChangeSet& changes) { return changes.bricks.size() > kMaxDeltaBricks; }

std::size_t partBytes(const NodeParameters& parameters) {
  return static_cast<std::size_t>(1e6 * parameters.map_part_size_mb);
}

ChangeSet everythingOf(const ChangeSet& changes) { return {changes.revision, true, {}}; }

}  // namespace

MapPublisher::MapPublisher(ros::NodeHandle nh, const ros::NodeHandle& private_nh,
                           const NodeParameters& parameters, GuardedMap& map)
    : map_(map),
      server_(private_nh.getNamespace()),
      frame_id_(withoutSlash(parameters.frame_id)),
      detail_(parameters.publish_values ? MapDetail::kValues : MapDetail::kClasses),
      instance_(ros::WallTime::now().toNSec()),
      delta_publisher_(advertiseDelta(nh, kCuboidMapUpdatesTopic)),
      images_(
          nh, private_nh, guardOf(nh),
          {detail_, partBytes(parameters), parameters.keyframe_period_s},
          [this](MapDetail detail) { return makeImage(detail); },
          [this] { return describeLeftOut(); }) {}

ImageMessage MapPublisher::makeImage(MapDetail detail) const {
  return map_.read([&](const CuboidMap& map, const ros::Time& stamp) {
    ImageMessage message;
    message.server = server_;
    message.header.frame_id = frame_id_;
    message.header.stamp = stamp;
    message.image = cuboid_mapping::makeImage(map, instance_, detail);
    return message;
  });
}

std::string MapPublisher::describeLeftOut() const {
  const auto window = map_.windowFigures();
  if (!window || window->num_on_disk_only == 0) return {};
  return "this is the map in memory, as on the topics, without " +
         describePages(window->num_on_disk_only) + ", on disk: ~save_map writes all";
}

ChangeSet MapPublisher::publish() {
  const bool is_heard = delta_publisher_.getNumSubscribers() > 0;
  DeltaMessage message;
  message.server = server_;
  message.header.frame_id = frame_id_;
  // Exactly the changes of the map, while nobody changes it.
  ChangeSet changes =
      map_.takeChanges([&](const CuboidMap& map, const ros::Time& stamp, const ChangeSet& taken) {
        message.header.stamp = stamp;
        if (is_heard) {
          message.delta = makeDelta(map, isTooMuch(taken) ? everythingOf(taken) : taken, instance_,
                                    published_revision_, detail_);
        }
        message.delta.revision = map.revision();
        message.delta.is_everything = taken.is_everything || isTooMuch(taken);
      });
  try {
    published_revision_ = message.delta.revision;
    if (is_heard) publishDelta(delta_publisher_, message);
    images_.noteUpdate(published_revision_);
    if (message.delta.is_everything) images_.publishSoon();
  } catch (...) {
    map_.noteEverything();  // The message was not sent.
    throw;
  }
  return changes;
}

}  // namespace cuboid_mapping_ros
