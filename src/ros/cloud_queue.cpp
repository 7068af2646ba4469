// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/cloud_queue.h"

#include <boost/make_shared.hpp>

#include <cstdint>
#include <utility>

namespace cuboid_mapping_ros {

class CloudQueue::Turn : public ros::CallbackInterface {
 public:
  explicit Turn(CloudQueue* owner) : owner_(owner) {}

  CallResult call() override {
    owner_->takeTurn();
    return Success;
  }

 private:
  CloudQueue* owner_;
};

CloudQueue::CloudQueue(ros::CallbackQueueInterface* callback_queue, std::size_t max_size,
                       Callback handle, Callback on_drop)
    : callback_queue_(callback_queue),
      max_size_(max_size),
      handle_(std::move(handle)),
      on_drop_(std::move(on_drop)) {}

CloudQueue::~CloudQueue() { callback_queue_->removeByID(reinterpret_cast<std::uintptr_t>(this)); }

void CloudQueue::push(const CloudPtr& cloud) {
  if (clouds_.size() == max_size_) {
    const CloudPtr oldest = clouds_.front();
    clouds_.pop_front();
    on_drop_(oldest);
  }
  clouds_.push_back(cloud);
  if (!has_turn_) requestTurn();
}

void CloudQueue::requestTurn() {
  has_turn_ = true;
  callback_queue_->addCallback(boost::make_shared<Turn>(this),
                               reinterpret_cast<std::uintptr_t>(this));
}

void CloudQueue::takeTurn() {
  const CloudPtr cloud = clouds_.front();
  clouds_.pop_front();
  handle_(cloud);
  has_turn_ = false;
  if (!clouds_.empty()) requestTurn();  // behind all that came while the cloud was handled
}

}  // namespace cuboid_mapping_ros
