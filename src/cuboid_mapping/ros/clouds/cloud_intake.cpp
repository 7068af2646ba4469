// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/cloud_intake.h"

#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <ros/console.h>

#include <algorithm>
#include <exception>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

CloudLimits makeCloudLimits(const NodeParameters& parameters) {
  CloudLimits limits;
  limits.num_sources = sourcesOf(parameters).size();
  limits.order_wait_s = parameters.order_wait_s;
  limits.max_clouds = static_cast<std::size_t>(parameters.queue_size) * limits.num_sources;
  limits.max_bytes = static_cast<std::size_t>(parameters.queue_memory_mb) * 500000;
  limits.max_wait = ros::Duration(parameters.tf_wait_s);
  return limits;
}

CloudIntake::CloudIntake(ros::CallbackQueueInterface& callback_queue, tf2::BufferCore& tf,
                         const NodeParameters& parameters, Callbacks callbacks)
    : tf_(tf),
      sources_(sourcesOf(parameters)),
      tf_history_(tf.getCacheLength()),
      time_jump_detector_(tf_history_),
      queue_(callback_queue, makeCloudLimits(parameters),
             {[this](const SensorMessage& cloud) { return findPoses(cloud); },
              std::move(callbacks.handle), std::move(callbacks.drop)}) {}

void CloudIntake::receive(const SensorMessage& cloud, const ros::Time& now) {
  const ros::Time stamp = cloud.header().stamp;
  const StampOrder order = time_jump_detector_.judge(stamp);
  if (order == StampOrder::kJump) queue_.forgetOrder();
  if (order != StampOrder::kInOrder && isTfOutdated(cloud.header().frame_id, stamp)) {
    if (order == StampOrder::kLate) {
      held_cloud_ = cloud;  // Late, or the first after a jump: the next one tells.
      held_since_ = now;
      return;
    }
    ROS_WARN_NAMED(kNodeName, "time has jumped back: transforms received before are discarded");
    tf_.clear();
  }
  releaseHeldCloud(now);
  queue_.push(cloud, now);
}

void CloudIntake::update(const ros::Time& now) {
  if (held_cloud_ && isHeldInVain(now)) releaseHeldCloud(now);
  queue_.update(now);
}

bool CloudIntake::isHeldInVain(const ros::Time& now) {
  beginAnew(held_since_, now);
  // No cloud comes any more that could tell.
  if (isOlder(held_since_, now, ros::Duration(sources_.front().tf_wait_s))) return true;
  // tf may have noticed a jump of time by itself meanwhile, by its clock.
  return !isTfOutdated(held_cloud_->header().frame_id, held_cloud_->header().stamp);
}

void CloudIntake::setParameters(const NodeParameters& parameters, const ros::Time& now) {
  sources_ = sourcesOf(parameters);
  queue_.searchAnew(now);
}

std::size_t CloudIntake::numWaiting() const { return queue_.size() + (held_cloud_ ? 1 : 0); }

bool CloudIntake::awaitsTf() const { return held_cloud_ || queue_.numWaitingForTf() > 0; }

void CloudIntake::releaseHeldCloud(const ros::Time& now) {
  if (!held_cloud_) return;
  const SensorMessage cloud = *std::move(held_cloud_);
  held_cloud_.reset();
  queue_.push(cloud, now);
}

bool CloudIntake::isTfOutdated(const std::string& frame_id, const ros::Time& stamp) const {
  try {
    const ros::Time newest = tf_.lookupTransform(withoutSlash(sources_.front().frame_id),
                                                 withoutSlash(frame_id), ros::Time())
                                 .header.stamp;
    return isOlder(stamp, newest, tf_history_);
  } catch (const std::exception&) {
    return false;  // There is none.
  }
}

PoseSearch CloudIntake::findPoses(const SensorMessage& cloud) const {
  const NodeParameters& parameters = sources_.at(cloud.source);
  const std_msgs::Header& header = cloud.header();
  PoseSearch search;
  search.poses = lookupPoses(tf_, parameters, cloud, search.why);
  if (search.poses || header.stamp.isZero()) return search;
  std::vector<std::string> frame_ids = neededFrames(parameters);
  frame_ids.push_back(header.frame_id);
  search.is_too_old = std::any_of(
      frame_ids.begin(), frame_ids.end(),
      [&](const std::string& frame_id) { return isTfOutdated(frame_id, header.stamp); });
  return search;
}

}  // namespace cuboid_mapping_ros
