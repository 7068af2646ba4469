// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/markers/map_markers.h"

#include "cuboid_mapping/query/height_range.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <visualization_msgs/MarkerArray.h>

#include <algorithm>

namespace cuboid_mapping_ros {

MarkerTopic::MarkerTopic(const ros::NodeHandle& nh, CuboidFilter filter,
                         const NodeParameters& parameters, const GuardedMap& map)
    : map_(map),
      cache_(map.grid(), {filter}),
      has_colors_(filter == CuboidFilter::kOccupied),
      is_span_old_(has_colors_),
      keyframe_period_(parameters.keyframe_period_s),
      last_picture_(ros::SteadyTime::now()),
      topic_(
          nh, has_colors_ ? kOccupiedCuboidsTopic : kFreeCuboidsTopic, kQueueSize,
          [this](const auto& listener) { onConnect(listener); },
          [this](const auto& /*listener*/) { onDisconnect(); }) {
  header_.frame_id = withoutSlash(parameters.frame_id);
}

void MarkerTopic::noteChanges(const ChangeSet& changes) {
  if (changes.is_everything || !changes.bricks.empty()) is_span_old_ = has_colors_;
  cache_.noteChanges(changes);
}

void MarkerTopic::readMap() {
  map_.readInTurns({}, nullptr,
                   [this](const CuboidMap& map, const ros::Time& stamp, Budget& budget) {
                     header_.stamp = stamp;
                     cache_.read(map, budget);
                   });
}

void MarkerTopic::publish() {
  const ros::SteadyTime start = ros::SteadyTime::now();
  if (num_listeners_ == 0 || start < next_) return;
  updateColorSpan();
  if (cache_.hasChanges()) publishDifference();
  if (isKeyframeDue()) publishPicture();
  const ros::SteadyTime end = ros::SteadyTime::now();
  next_ = std::min(endOfRest(start, end), end + ros::WallDuration(kMaxRest_s));
}

void MarkerTopic::updateColorSpan() {
  if (!is_span_old_) return;
  is_span_old_ = false;
  const auto span = map_.readWhole([](const CuboidMap& map) { return findHeightRange(map); });
  if (color_span_ && !isOtherSpan(span, *color_span_)) return;
  color_span_ = span;
  cache_.setColorSpan(span);
}

bool MarkerTopic::isKeyframeDue() const {
  return owes_keyframe_ && !keyframe_period_.isZero() &&
         ros::SteadyTime::now() - last_picture_ >= keyframe_period_;
}

void MarkerTopic::publishDifference() {
  readMap();
  owes_keyframe_ = true;  // Set even if a later step fails: a keyframe repairs it.
  const visualization_msgs::MarkerArray difference = cache_.takeDifference(header_);
  if (difference.markers.empty()) return;
  if (!isKeyframeDue()) topic_.publish(difference);
}

void MarkerTopic::publishPicture() {
  topic_.publish(cache_.makePicture(header_));
  owes_keyframe_ = false;
  last_picture_ = ros::SteadyTime::now();
}

void MarkerTopic::onConnect(const ros::SingleSubscriberPublisher& listener) {
  ++num_listeners_;
  // The other subscribers have this picture, too: all get the later changes with the next
  // publish().
  if (num_listeners_ == 1) {
    readMap();
    (void)cache_.takeDifference(header_);
  }
  listener.publish(cache_.makePicture(header_));
}

void MarkerTopic::onDisconnect() {
  if (--num_listeners_ > 0) return;
  cache_.release();
  owes_keyframe_ = false;
}

}  // namespace cuboid_mapping_ros
