// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/cloud_queue.h"

#include "cuboid_mapping/ros/diagnostics/diagnostics.h"
#include "cuboid_mapping/ros/middleware/function_callback.h"
#include "cuboid_mapping/ros/middleware/time_jump.h"

#include <algorithm>
#include <chrono>
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

double steadySeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

CloudQueue::CloudQueue(ros::CallbackQueueInterface& callback_queue, const CloudLimits& limits,
                       Callbacks callbacks)
    : callback_queue_(callback_queue),
      limits_(limits),
      callbacks_(std::move(callbacks)),
      newest_(limits.num_sources) {}

CloudQueue::~CloudQueue() { removePosted(callback_queue_, this); }

void CloudQueue::push(const SensorMessage& cloud, const ros::Time& now) {
  try {
    insert(cloud, now);
  } catch (const std::exception&) {
    callbacks_.drop(cloud.source, DropReason::kInternalError, {});
  }
}

void CloudQueue::insert(const SensorMessage& cloud, const ros::Time& now) {
  newest_.at(cloud.source) = cloud.header().stamp;
  if (cloud.header().frame_id.empty()) {
    callbacks_.drop(cloud.source, DropReason::kEmptyFrame,
                    "header.frame_id is empty; set it in the driver");
    return;
  }
  Entry entry{cloud, now, std::nullopt, {}};
  const bool may_come = searchPoses(entry);
  const auto place = clouds_.insert(placeOf(cloud), std::move(entry));
  num_bytes_ += cloud.numBytes();  // From here on nothing throws.
  if (!may_come) return drop(place, DropReason::kTooOldForTf);
  makePlace();
  requestTurn();
}

CloudQueue::Entries::iterator CloudQueue::placeOf(const SensorMessage& cloud) {
  if (limits_.num_sources == 1) return clouds_.end();
  const auto key = [](const SensorMessage& of) {
    return std::make_pair(of.header().stamp, of.source);
  };
  return std::upper_bound(
      clouds_.begin(), clouds_.end(), cloud,
      [&key](const SensorMessage& a, const Entry& b) { return key(a) < key(b.cloud); });
}

bool CloudQueue::searchPoses(Entry& entry) {
  PoseSearch search = callbacks_.find_poses(entry.cloud);
  entry.poses = std::move(search.poses);
  if (entry.poses) entry.ready_since_s = callbacks_.clock_s();
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
  beginAnew(entry.since, now);
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
    text = describe(gone.cloud.header(), gone.why, reason);
  } catch (const std::exception&) {
    // There is no memory for words; it is counted.
  }
  callbacks_.drop(gone.cloud.source, reason, text);
}

CloudQueue::Entry CloudQueue::take(const Entries::iterator& entry) {
  Entry taken = std::move(*entry);
  clouds_.erase(entry);
  num_bytes_ -= taken.cloud.numBytes();
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

CloudQueue::Entries::iterator CloudQueue::findNext() {
  if (limits_.num_sources == 1) return findReady();
  const double now_s = callbacks_.clock_s();
  bool is_first = true;
  for (auto entry = clouds_.begin(); entry != clouds_.end(); ++entry) {
    if (!entry->poses) {
      is_first = false;
      continue;
    }
    const bool may_go = (is_first && haveOthersGoneOn(entry->cloud)) ||
                        now_s - entry->ready_since_s >= limits_.order_wait_s;
    return may_go ? entry : clouds_.end();
  }
  return clouds_.end();
}

bool CloudQueue::haveOthersGoneOn(const SensorMessage& cloud) const {
  return std::none_of(newest_.begin(), newest_.end(),
                      [&cloud](const ros::Time& newest) { return newest < cloud.header().stamp; });
}

void CloudQueue::forgetOrder() {
  std::fill(newest_.begin(), newest_.end(), ros::Time());
  last_handled_ = ros::Time();
}

void CloudQueue::requestTurn() {
  if (has_turn_ || findNext() == clouds_.end()) return;
  try {
    post(callback_queue_, this, [this] { takeTurn(); });
    has_turn_ = true;
  } catch (const std::exception&) {
    // The next update() tries again.
  }
}

void CloudQueue::takeTurn() {
  has_turn_ = false;
  const auto next = findNext();
  if (next == clouds_.end()) return;
  const Entry entry = take(next);
  requestTurn();  // behind all that has come so far, also when this cloud fails
  const ros::Time& stamp = entry.cloud.header().stamp;
  if (limits_.num_sources > 1 && stamp < last_handled_) ++num_out_of_order_;
  last_handled_ = stamp;
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
