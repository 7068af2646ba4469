// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/markers/marker_publisher.h"

#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <visualization_msgs/MarkerArray.h>

#include <algorithm>

namespace cuboid_mapping_ros {

MarkerPublisher::MarkerPublisher(const ros::NodeHandle& nh, CuboidFilter filter,
                                 const NodeParameters& parameters, const GuardedMap& map)
    : map_(map),
      cache_(map.grid(), {filter}),
      keyframe_period_(parameters.keyframe_period_s),
      last_picture_(ros::SteadyTime::now()),
      topic_(
          nh, filter == CuboidFilter::kFree ? kFreeCuboidsTopic : kOccupiedCuboidsTopic, kQueueSize,
          [this](const auto& listener) { onConnect(listener); },
          [this](const auto& /*listener*/) { onDisconnect(); }) {
  header_.frame_id = withoutSlash(parameters.frame_id);
}

void MarkerPublisher::readMap() {
  const auto read = [this](const CuboidMap& map, const ros::Time& stamp, Budget& budget) {
    header_.stamp = stamp;
    cache_.read(map, budget);
    return 0;
  };
  map_.readInTurns({}, nullptr, read);
}

void MarkerPublisher::publish() {
  const ros::SteadyTime start = ros::SteadyTime::now();
  if (num_listeners_ == 0 || start < next_) return;
  if (cache_.hasChanges()) publishDifference();
  if (isKeyframeDue()) publishPicture();
  const ros::SteadyTime end = ros::SteadyTime::now();
  next_ = std::min(endOfRest(start, end), end + ros::WallDuration(kMaxRest_s));
}

bool MarkerPublisher::isKeyframeDue() const {
  return owes_keyframe_ && !keyframe_period_.isZero() &&
         ros::SteadyTime::now() - last_picture_ >= keyframe_period_;
}

void MarkerPublisher::publishDifference() {
  readMap();
  owes_keyframe_ = true;  // Set even if a later step fails: a keyframe repairs it.
  const visualization_msgs::MarkerArray difference = cache_.takeDifference(header_);
  if (difference.markers.empty()) return;
  if (!isKeyframeDue()) topic_.publish(difference);
}

void MarkerPublisher::publishPicture() {
  topic_.publish(cache_.makePicture(header_));
  owes_keyframe_ = false;
  last_picture_ = ros::SteadyTime::now();
}

void MarkerPublisher::onConnect(const ros::SingleSubscriberPublisher& listener) {
  ++num_listeners_;
  // The other subscribers have this picture, too: all get the later changes with the next
  // publish().
  if (num_listeners_ == 1) {
    readMap();
    (void)cache_.takeDifference(header_);
  }
  listener.publish(cache_.makePicture(header_));
}

void MarkerPublisher::onDisconnect() {
  if (--num_listeners_ > 0) return;
  cache_.release();
  owes_keyframe_ = false;
}

}  // namespace cuboid_mapping_ros
