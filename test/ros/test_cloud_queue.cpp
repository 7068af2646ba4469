// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/cloud_queue.h"

#include <gtest/gtest.h>
#include <ros/callback_queue.h>
#include <boost/make_shared.hpp>

#include <memory>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using Ids = std::vector<unsigned>;

/// A queue of three clouds on a callback queue, and what has become of the clouds, by width.
class CloudQueueTest : public ::testing::Test {
 protected:
  void push(unsigned id) {
    const auto cloud = boost::make_shared<sensor_msgs::PointCloud2>();
    cloud->width = id;
    queue_->push(cloud);
  }

  Ids handled_;
  Ids dropped_;
  ros::CallbackQueue callbacks_;
  std::unique_ptr<CloudQueue> queue_ = std::make_unique<CloudQueue>(
      &callbacks_, 3,
      [this](const CloudQueue::CloudPtr& cloud) { handled_.push_back(cloud->width); },
      [this](const CloudQueue::CloudPtr& cloud) { dropped_.push_back(cloud->width); });
};

TEST_F(CloudQueueTest, HandlesCloudsInOrderAndOneInATurn) {
  for (unsigned id = 1; id <= 3; ++id) push(id);
  EXPECT_TRUE(handled_.empty());
  for (std::size_t turn = 1; turn <= 3; ++turn) {
    callbacks_.callOne();
    EXPECT_EQ(handled_.size(), turn);
  }
  EXPECT_EQ(callbacks_.callOne(), ros::CallbackQueue::Empty);
  EXPECT_EQ(handled_, (Ids{1, 2, 3}));
  EXPECT_TRUE(dropped_.empty());
  push(4);
  callbacks_.callOne();
  EXPECT_EQ(handled_, (Ids{1, 2, 3, 4}));
}

TEST_F(CloudQueueTest, DropsTheOldestWhenFullAndTellsSo) {
  for (unsigned id = 1; id <= 5; ++id) push(id);
  EXPECT_EQ(dropped_, (Ids{1, 2}));
  EXPECT_EQ(queue_->size(), 3U);
  callbacks_.callAvailable();
  while (callbacks_.callOne() == ros::CallbackQueue::Called) {
  }
  EXPECT_EQ(handled_, (Ids{3, 4, 5}));
  EXPECT_EQ(queue_->size(), 0U);
}

TEST_F(CloudQueueTest, LetsOthersHaveTheirTurnBetweenTwoClouds) {
  class Note : public ros::CallbackInterface {
   public:
    explicit Note(Ids& ids) : ids_(ids) {}
    CallResult call() override {
      ids_.push_back(0);
      return Success;
    }

   private:
    Ids& ids_;
  };
  push(1);
  push(2);
  callbacks_.addCallback(boost::make_shared<Note>(handled_));
  for (int i = 0; i < 3; ++i) callbacks_.callOne();
  EXPECT_EQ(handled_, (Ids{1, 0, 2}));
}

TEST_F(CloudQueueTest, TakesItsTurnBackWhenItGoes) {
  push(1);
  queue_.reset();
  EXPECT_EQ(callbacks_.callOne(), ros::CallbackQueue::Empty);
  EXPECT_TRUE(handled_.empty());
}

}  // namespace
}  // namespace cuboid_mapping_ros
