// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/map_publisher.h"

#include "cuboid_mapping/map/map_follower.h"
#include "cuboid_mapping/ros/names.h"
#include "cuboid_mapping/ros/tf_lookup.h"

namespace cuboid_mapping_ros {

using cuboid_mapping::ChangeSet;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::MapDetail;

MapPublisher::MapPublisher(ros::NodeHandle nh, ros::NodeHandle private_nh,
                           const NodeParameters& parameters, GuardedMap& map)
    : map_(map),
      frame_id_(withoutSlash(parameters.frame_id)),
      detail_(parameters.publish_values ? MapDetail::kValues : MapDetail::kClasses),
      instance_(ros::WallTime::now().toNSec()),
      image_publisher_(advertiseImage(nh, kCuboidMapTopic, [this] { return makeImage(detail_); })),
      delta_publisher_(advertiseDelta(nh, kCuboidMapUpdatesTopic)),
      get_map_server_(advertiseGetMap(private_nh, kGetMapService,
                                      [this](MapDetail detail) { return makeImage(detail); })) {}

ImageMessage MapPublisher::makeImage(MapDetail detail) const {
  return map_.read([&](const CuboidMap& map, const ros::Time& stamp) {
    ImageMessage message;
    message.header.frame_id = frame_id_;
    message.header.stamp = stamp;
    message.image = cuboid_mapping::makeImage(map, instance_, detail);
    return message;
  });
}

ChangeSet MapPublisher::publish() {
  const bool is_heard = delta_publisher_.getNumSubscribers() > 0;
  map_.fuse();
  ChangeSet changes;
  DeltaMessage message;
  map_.read([&](const CuboidMap& map, const ros::Time& stamp) {
    changes =
        map_.takeChanges();  // While nobody changes the map: neither more nor less than it has.
    message.header.stamp = stamp;
    message.delta.revision = map.revision();
    if (is_heard) message.delta = makeDelta(map, changes, instance_, published_revision_, detail_);
    return true;
  });
  published_revision_ = message.delta.revision;
  message.header.frame_id = frame_id_;
  if (is_heard) publishDelta(delta_publisher_, message);
  if (changes.is_everything && image_publisher_.getNumSubscribers() > 0) {
    publishImage(image_publisher_, makeImage(detail_));
  }
  return changes;
}

}  // namespace cuboid_mapping_ros
