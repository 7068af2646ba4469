// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/cloud_queue.h"

#include "cuboid_mapping/ros/diagnostics.h"
#include "cuboid_mapping/ros/function_callback.h"
#include "cuboid_mapping/ros/time_jump.h"

#include <algorithm>
#include <exception>
#include <iterator>
#include <sstream>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

std::string describe(const std_msgs::Header& header, const std::string& why, DropReason reason) {
  std::ostringstream text;
  text << "frame '" << header.frame_id << "', stamp " << header.stamp << ": ";
  if (!why.empty()) text << why << "; ";
  text << toAdvice(reason);
  return text.str();
}

}  // namespace

std::size_t countBytes(const sensor_msgs::PointCloud2& cloud) {
  return sizeof(cloud) + cloud.data.capacity();
}

CloudQueue::CloudQueue(ros::CallbackQueueInterface& callback_queue, const CloudLimits& limits,
                       Callbacks callbacks)
    : callback_queue_(callback_queue), limits_(limits), callbacks_(std::move(callbacks)) {}

CloudQueue::~CloudQueue() { removePosted(callback_queue_, this); }

void CloudQueue::push(const CloudPtr& cloud, const ros::Time& now) {
  try {
    insert(cloud, now);
  } catch (const std::exception&) {
    callbacks_.drop(DropReason::kInternalError, {});
  }
}

void CloudQueue::insert(const CloudPtr& cloud, const ros::Time& now) {
  if (cloud->header.frame_id.empty()) {
    callbacks_.drop(DropReason::kEmptyFrame, "header.frame_id is empty; set it in the driver");
    return;
  }
  Entry entry{cloud, now, std::nullopt, {}};
  const bool may_come = searchPoses(entry);
  clouds_.push_back(std::move(entry));  // From here on nothing throws.
  num_bytes_ += countBytes(*cloud);
  if (!may_come) return drop(std::prev(clouds_.end()), DropReason::kTooOldForTf);
  makePlace();
  requestTurn();
}

bool CloudQueue::searchPoses(Entry& entry) {
  PoseSearch search = callbacks_.find_poses(entry.cloud->header);
  entry.poses = std::move(search.poses);
  entry.why = std::move(search.why);
  return entry.poses || !search.is_too_old;
}

void CloudQueue::makePlace() {
  while (numWaitingForTf() > limits_.max_clouds) drop(findWaiting(), DropReason::kNoTransform);
  while (clouds_.size() - numWaitingForTf() > limits_.max_clouds) {
    drop(findReady(), DropReason::kQueueFull);
  }
  while (num_bytes_ > limits_.max_bytes && clouds_.size() > 1) {
    const auto waiting = findWaiting();
    const bool is_newest = waiting == clouds_.end() || std::next(waiting) == clouds_.end();
    if (is_newest) {
      drop(clouds_.begin(), DropReason::kQueueFull);
    } else {
      drop(waiting, DropReason::kNoTransform);
    }
  }
}

void CloudQueue::update(const ros::Time& now) {
  for (std::size_t i = 0; i < clouds_.size();) {
    Entry& entry = clouds_[i];
    const auto place = clouds_.begin() + static_cast<std::ptrdiff_t>(i);
    if (!entry.poses && !searchPoses(entry)) {
      drop(place, DropReason::kTooOldForTf);
    } else if (!entry.poses && hasExpired(entry, now)) {
      std::ostringstream why;
      why << "waited for " << limits_.max_wait.toSec() << " s: " << entry.why;
      entry.why = why.str();
      drop(place, DropReason::kNoTransform);
    } else {
      ++i;
    }
  }
  makePlace();
  requestTurn();
}

bool CloudQueue::hasExpired(Entry& entry, const ros::Time& now) const {
  if (now < entry.since) entry.since = now;  // Time has jumped back: it begins to wait anew.
  return isOlder(entry.since, now, limits_.max_wait);
}

void CloudQueue::searchAnew(const ros::Time& now) {
  for (Entry& entry : clouds_) entry.poses.reset();
  update(now);
}

void CloudQueue::drop(const Entries::iterator& entry, DropReason reason) {
  const Entry gone = take(entry);
  std::string text;
  try {
    text = describe(gone.cloud->header, gone.why, reason);
  } catch (const std::exception&) {
    // There is no memory for words; it is counted.
  }
  callbacks_.drop(reason, text);
}

CloudQueue::Entry CloudQueue::take(const Entries::iterator& entry) {
  Entry taken = std::move(*entry);
  clouds_.erase(entry);
  num_bytes_ -= countBytes(*taken.cloud);
  return taken;
}

CloudQueue::Entries::iterator CloudQueue::findReady() {
  return std::find_if(clouds_.begin(), clouds_.end(),
                      [](const Entry& entry) { return entry.poses.has_value(); });
}

CloudQueue::Entries::iterator CloudQueue::findWaiting() {
  return std::find_if(clouds_.begin(), clouds_.end(),
                      [](const Entry& entry) { return !entry.poses; });
}

void CloudQueue::requestTurn() {
  if (has_turn_ || findReady() == clouds_.end()) return;
  try {
    post(callback_queue_, this, [this] { takeTurn(); });
    has_turn_ = true;
  } catch (const std::exception&) {
    // The next update() tries again.
  }
}

void CloudQueue::takeTurn() {
  has_turn_ = false;
  const auto ready = findReady();
  if (ready == clouds_.end()) return;
  const Entry entry = take(ready);
  requestTurn();  // behind all that has come so far, also when this cloud fails
  callbacks_.handle(entry.cloud, *entry.poses);
}

std::size_t CloudQueue::numWaitingForTf() const {
  return static_cast<std::size_t>(std::count_if(clouds_.begin(), clouds_.end(),
                                                [](const Entry& entry) { return !entry.poses; }));
}

std::string CloudQueue::whyItWaits() const {
  const auto waiting =
      std::find_if(clouds_.begin(), clouds_.end(), [](const Entry& entry) { return !entry.poses; });
  return waiting == clouds_.end() ? std::string() : waiting->why;
}

}  // namespace cuboid_mapping_ros
