// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/cloud_inbox.h"

#include "cuboid_mapping/ros/function_callback.h"

#include <new>
#include <utility>

namespace cuboid_mapping_ros {

CloudInbox::CloudInbox(ros::CallbackQueueInterface& callback_queue, const CloudLimits& limits,
                       Callbacks callbacks)
    : callback_queue_(callback_queue), limits_(limits), callbacks_(std::move(callbacks)) {}

CloudInbox::~CloudInbox() { removePosted(callback_queue_, this); }

void CloudInbox::put(const CloudPtr& cloud) {
  const std::lock_guard<std::mutex> lock(mutex_);
  try {
    clouds_.push_back(cloud);
    num_bytes_ += countBytes(*cloud);
  } catch (const std::bad_alloc&) {
    ++num_dropped_;
  }
  while (clouds_.size() > 1 &&
         (clouds_.size() > limits_.max_clouds || num_bytes_ > limits_.max_bytes)) {
    num_bytes_ -= countBytes(*clouds_.front());
    clouds_.pop_front();
    ++num_dropped_;
  }
  if (is_delivery_due_) return;
  post(callback_queue_, this, [this] { deliver(); });
  is_delivery_due_ = true;
}

void CloudInbox::deliver() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_delivery_due_ = false;  // What fails now is tried again when the next cloud comes.
  }
  std::deque<CloudPtr> clouds;
  std::size_t num_dropped = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    num_bytes_ = 0;
    clouds.swap(clouds_);
    std::swap(num_dropped, num_dropped_);
  }
  if (num_dropped > 0) callbacks_.drop(num_dropped);
  for (const CloudPtr& cloud : clouds) callbacks_.take(cloud);
}

std::size_t CloudInbox::numBytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return num_bytes_;
}

}  // namespace cuboid_mapping_ros
