// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/publishers/marker_publisher.h"

#include <visualization_msgs/MarkerArray.h>

namespace cuboid_mapping_ros {

MarkerPublisher::MarkerPublisher(ros::NodeHandle nh, const MarkerTopic& topic,
                                 const GuardedMap& map)
    : map_(map),
      late_listener_(topic.late_listener),
      cache_(map.grid(), topic.style),
      picture_period_(topic.picture_period_s),
      last_picture_(ros::WallTime::now()) {
  header_.frame_id = topic.frame_id;
  publisher_ = nh.advertise<visualization_msgs::MarkerArray>(
      topic.name, kQueueSize,
      [this](const ros::SingleSubscriberPublisher& listener) { onConnect(listener); },
      [this](const ros::SingleSubscriberPublisher& /*listener*/) { onDisconnect(); });
}

void MarkerPublisher::readMap() {
  map_.read([this](const cuboid_mapping::CuboidMap& map, const ros::Time& stamp) {
    header_.stamp = stamp;
    cache_.read(map);
  });
}

void MarkerPublisher::setColors(ColorBy color_by, double color_period_m) {
  const std::lock_guard<std::mutex> lock(pending_mutex_);
  pending_ = Colors{color_by, color_period_m};
}

void MarkerPublisher::takePendingColors() {
  const std::lock_guard<std::mutex> lock(pending_mutex_);
  if (pending_) cache_.setColors(pending_->color_by, pending_->color_period_m);
  pending_.reset();
}

void MarkerPublisher::publish() {
  takePendingColors();
  if (num_listeners_ == 0) return;
  if (cache_.hasChanges()) publishDifference();
  const bool is_due = ros::WallTime::now() - last_picture_ >= picture_period_;
  if (num_pictures_left_ == 0 || !is_due || picture_period_.isZero()) return;
  publishPicture();
  --num_pictures_left_;
}

void MarkerPublisher::publishDifference() {
  readMap();
  num_pictures_left_ = kNumPictures;  // Also when what follows fails: a picture mends it.
  const visualization_msgs::MarkerArray difference = cache_.takeDifference(header_);
  if (difference.markers.empty()) return;
  if (is_picture_due_) {
    publishPicture();
  } else {
    publisher_.publish(difference);
  }
}

void MarkerPublisher::publishPicture() {
  publisher_.publish(cache_.makePicture(header_));
  is_picture_due_ = false;
  last_picture_ = ros::WallTime::now();
}

void MarkerPublisher::onConnect(const ros::SingleSubscriberPublisher& listener) {
  ++num_listeners_;
  if (late_listener_ == LateListener::kGetsPictureLater) {
    is_picture_due_ = true;
    return;
  }
  // The picture is what the others have, too: they get what has changed since with the next
  // publish(), and so does this one.
  if (num_listeners_ == 1) {
    readMap();
    (void)cache_.takeDifference(header_);
  }
  listener.publish(cache_.makePicture(header_));
}

void MarkerPublisher::onDisconnect() {
  if (--num_listeners_ > 0) return;
  cache_.release();
  num_pictures_left_ = 0;
}

}  // namespace cuboid_mapping_ros
