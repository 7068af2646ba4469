// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/cloud_inbox.h"

#include "cuboid_mapping/ros/middleware/function_callback.h"

#include <new>
#include <utility>

namespace cuboid_mapping_ros {

CloudInbox::CloudInbox(ros::CallbackQueueInterface& callback_queue, const CloudLimits& limits,
                       Callbacks callbacks)
    : callback_queue_(callback_queue),
      limits_(limits),
      callbacks_(std::move(callbacks)),
      num_dropped_(limits.num_sources) {}

CloudInbox::~CloudInbox() { removePosted(callback_queue_, this); }

void CloudInbox::put(const SensorMessage& cloud) {
  const std::lock_guard<std::mutex> lock(mutex_);
  try {
    clouds_.push_back(cloud);
    num_bytes_ += cloud.numBytes();
  } catch (const std::bad_alloc&) {
    ++num_dropped_[cloud.source];
  }
  while (clouds_.size() > 1 &&
         (clouds_.size() > limits_.max_clouds || num_bytes_ > limits_.max_bytes)) {
    num_bytes_ -= clouds_.front().numBytes();
    ++num_dropped_[clouds_.front().source];
    clouds_.pop_front();
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
  std::deque<SensorMessage> clouds;
  std::vector<std::size_t> num_dropped(limits_.num_sources);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    num_bytes_ = 0;
    clouds.swap(clouds_);
    num_dropped.swap(num_dropped_);
  }
  for (std::size_t source = 0; source < num_dropped.size(); ++source) {
    if (num_dropped[source] > 0) callbacks_.drop(source, num_dropped[source]);
  }
  for (const SensorMessage& cloud : clouds) callbacks_.take(cloud);
}

std::size_t CloudInbox::numBytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return num_bytes_;
}

}  // namespace cuboid_mapping_ros
