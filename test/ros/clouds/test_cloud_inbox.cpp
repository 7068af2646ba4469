// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/cloud_inbox.h"

#include <gtest/gtest.h>
#include <ros/callback_queue.h>
#include <boost/make_shared.hpp>

#include <algorithm>
#include <memory>
#include <thread>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using Ids = std::vector<unsigned>;

/// An inbox of three clouds and 10 kB.
class CloudInboxTest : public ::testing::Test {
 protected:
  void put(unsigned id, std::size_t num_bytes = 0) {
    const auto cloud = boost::make_shared<sensor_msgs::PointCloud2>();
    cloud->width = id;
    cloud->data.resize(num_bytes);
    inbox_->put({cloud});
  }

  Ids taken_;
  std::size_t num_dropped_ = 0;
  ros::CallbackQueue callbacks_;
  std::unique_ptr<CloudInbox> inbox_ = std::make_unique<CloudInbox>(
      callbacks_, CloudLimits{3, 10000, ros::Duration(10.0)},
      CloudInbox::Callbacks{
          [this](const SensorMessage& cloud) {
            taken_.push_back(std::get<sensor_msgs::PointCloud2::ConstPtr>(cloud.content)->width);
          },
          [this](std::size_t /*source*/, std::size_t count) { num_dropped_ += count; }});
};

TEST_F(CloudInboxTest, DeliversInOrderAndOnTheCallbackQueueOnly) {
  for (unsigned id = 1; id <= 3; ++id) put(id);
  EXPECT_TRUE(taken_.empty());
  callbacks_.callAvailable();
  EXPECT_EQ(taken_, (Ids{1, 2, 3}));
  EXPECT_EQ(num_dropped_, 0U);
  put(4);
  callbacks_.callAvailable();
  EXPECT_EQ(taken_, (Ids{1, 2, 3, 4}));
}

TEST_F(CloudInboxTest, DropsTheOldestAndTellsHowMany) {
  for (unsigned id = 1; id <= 8; ++id) put(id);
  callbacks_.callAvailable();
  EXPECT_EQ(taken_, (Ids{6, 7, 8}));
  EXPECT_EQ(num_dropped_, 5U);
}

TEST_F(CloudInboxTest, HoldsNoMoreBytesThanItMay) {
  for (unsigned id = 1; id <= 3; ++id) {
    put(id, 4000);
    EXPECT_LE(inbox_->numBytes(), 10000U);
  }
  callbacks_.callAvailable();
  EXPECT_EQ(taken_, (Ids{2, 3}));
  EXPECT_EQ(inbox_->numBytes(), 0U);
  put(4, 50000);
  callbacks_.callAvailable();
  EXPECT_EQ(taken_, (Ids{2, 3, 4})) << "one may always wait";
}

TEST_F(CloudInboxTest, CountsEveryCloudThatAThreadPutsIn) {
  constexpr unsigned kCount = 2000;
  std::thread receiver([this] {
    for (unsigned id = 1; id <= kCount; ++id) put(id);
  });
  while (taken_.size() + num_dropped_ < kCount) callbacks_.callAvailable();
  receiver.join();
  callbacks_.callAvailable();
  EXPECT_EQ(taken_.size() + num_dropped_, kCount);
  EXPECT_EQ(taken_.back(), kCount);
  EXPECT_TRUE(std::is_sorted(taken_.begin(), taken_.end()));
}

TEST_F(CloudInboxTest, TakesItsDeliveryBackWhenItGoes) {
  put(1);
  inbox_.reset();
  callbacks_.callAvailable();
  EXPECT_TRUE(taken_.empty());
}

}  // namespace
}  // namespace cuboid_mapping_ros
