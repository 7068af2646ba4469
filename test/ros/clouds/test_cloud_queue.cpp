// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/cloud_queue.h"

#include "cuboid_mapping/ros/middleware/function_callback.h"

#include <gtest/gtest.h>
#include <ros/callback_queue.h>
#include <boost/make_shared.hpp>

#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using Ids = std::vector<unsigned>;

struct Drop {
  DropReason reason;
  std::string text;
};

/// A queue of three clouds, of 10 s and 10 kB, and a tf that knows some frames; what has become of the
/// clouds, by width.
class CloudQueueTest : public ::testing::Test {
 protected:
  void push(unsigned id, const std::string& frame_id = "lidar", std::size_t num_bytes = 0) {
    const auto cloud = boost::make_shared<sensor_msgs::PointCloud2>();
    cloud->width = id;
    cloud->header.frame_id = frame_id;
    cloud->data.resize(num_bytes);
    queue_->push({cloud}, now_);
  }

  void callAll() {
    while (callbacks_.callOne() == ros::CallbackQueue::Called) {
    }
  }

  PoseSearch search(const std_msgs::Header& header) const {
    if (known_frames_.count(header.frame_id) > 0) return {CloudPoses{}, "", false};
    return {std::nullopt, "map <- " + header.frame_id + " is missing",
            too_old_frames_.count(header.frame_id) > 0};
  }

  CloudQueue::Callbacks makeCallbacks() {
    CloudQueue::Callbacks callbacks;
    callbacks.find_poses = [this](const SensorMessage& cloud) { return search(cloud.header()); };
    callbacks.handle = [this](const SensorMessage& cloud, const CloudPoses& /*poses*/) {
      handled_.push_back(std::get<sensor_msgs::PointCloud2::ConstPtr>(cloud.content)->width);
      if (handled_.back() == kFailing) throw std::runtime_error("this one fails");
    };
    callbacks.drop = [this](std::size_t /*source*/, DropReason reason, const std::string& text) {
      drops_.push_back({reason, text});
    };
    return callbacks;
  }

  [[nodiscard]] std::size_t numDrops(DropReason reason) const {
    std::size_t count = 0;
    for (const Drop& drop : drops_) count += drop.reason == reason ? 1 : 0;
    return count;
  }

  static constexpr unsigned kFailing = 99;
  std::set<std::string> known_frames_{"lidar"};
  std::set<std::string> too_old_frames_;
  ros::Time now_{1000.0};
  Ids handled_;
  std::vector<Drop> drops_;
  ros::CallbackQueue callbacks_;
  std::unique_ptr<CloudQueue> queue_ = std::make_unique<CloudQueue>(
      callbacks_, CloudLimits{3, 10000, ros::Duration(10.0)}, makeCallbacks());
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
  EXPECT_TRUE(drops_.empty());
  EXPECT_EQ(queue_->numBytes(), 0U);
  push(4);
  callbacks_.callOne();
  EXPECT_EQ(handled_, (Ids{1, 2, 3, 4}));
}

TEST_F(CloudQueueTest, DropsTheOldestWhenFullAndTellsSo) {
  for (unsigned id = 1; id <= 5; ++id) push(id);
  EXPECT_EQ(numDrops(DropReason::kQueueFull), 2U);
  EXPECT_EQ(queue_->size(), 3U);
  callAll();
  EXPECT_EQ(handled_, (Ids{3, 4, 5}));
  EXPECT_EQ(queue_->size(), 0U);
}

TEST_F(CloudQueueTest, HoldsNoMoreBytesThanItMay) {
  push(1, "lidar", 4000);
  push(2, "lidar", 4000);
  push(3, "lidar", 4000);
  EXPECT_LE(queue_->numBytes(), 10000U);
  EXPECT_EQ(numDrops(DropReason::kQueueFull), 1U);
  push(4, "lidar", 50000);
  EXPECT_EQ(numDrops(DropReason::kQueueFull), 3U);
  callAll();
  EXPECT_EQ(handled_, (Ids{4})) << "one may always wait";
}

TEST_F(CloudQueueTest, TakesTheBytesOfACloudThatWaitsForTfFirst) {
  push(1, "lidar", 3000);
  push(2, "nowhere", 3000);
  push(3, "lidar", 3000);
  push(4, "lidar", 3000);
  EXPECT_EQ(numDrops(DropReason::kNoTransform), 1U);
  callAll();
  EXPECT_EQ(handled_, (Ids{1, 3, 4}));
}

TEST_F(CloudQueueTest, LetsOthersHaveTheirTurnBetweenTwoClouds) {
  push(1);
  push(2);
  post(callbacks_, nullptr, [this] { handled_.push_back(0); });
  for (int i = 0; i < 3; ++i) callbacks_.callOne();
  EXPECT_EQ(handled_, (Ids{1, 0, 2}));
}

TEST_F(CloudQueueTest, GoesOnAfterACloudThatFails) {
  push(kFailing);
  push(2);
  EXPECT_THROW(callbacks_.callOne(), std::runtime_error);
  callAll();
  EXPECT_EQ(handled_, (Ids{kFailing, 2}));
}

TEST_F(CloudQueueTest, LetsCloudsWaitForTfAndOthersPass) {
  push(1, "late");
  push(2);
  callAll();
  EXPECT_EQ(handled_, (Ids{2}));
  EXPECT_EQ(queue_->numWaitingForTf(), 1U);
  EXPECT_EQ(queue_->whyItWaits(), "map <- late is missing");
  queue_->update(now_);
  callAll();
  EXPECT_EQ(handled_, (Ids{2}));
  known_frames_.insert("late");
  queue_->update(now_);
  callAll();
  EXPECT_EQ(handled_, (Ids{2, 1}));
  EXPECT_EQ(queue_->whyItWaits(), "");
  EXPECT_TRUE(drops_.empty());
}

TEST_F(CloudQueueTest, KeepsThePosesThatWereFoundWhateverTfForgets) {
  push(1);
  known_frames_.clear();
  callAll();
  EXPECT_EQ(handled_, (Ids{1}));
}

TEST_F(CloudQueueTest, SearchesAnewWhenOtherFramesAreNeeded) {
  push(1);
  known_frames_.clear();
  queue_->searchAnew(now_);
  callAll();
  EXPECT_TRUE(handled_.empty());
  EXPECT_EQ(queue_->numWaitingForTf(), 1U);
}

TEST_F(CloudQueueTest, DropsTheOldestThatWaitsForTfAndSaysWhatIsMissing) {
  for (unsigned id = 1; id <= 4; ++id) push(id, "nowhere");
  push(5);
  ASSERT_EQ(drops_.size(), 1U);
  EXPECT_EQ(drops_[0].reason, DropReason::kNoTransform);
  EXPECT_NE(drops_[0].text.find("frame 'nowhere'"), std::string::npos);
  EXPECT_NE(drops_[0].text.find("map <- nowhere is missing"), std::string::npos);
  callAll();
  EXPECT_EQ(handled_, (Ids{5})) << "others are not held up";
}

TEST_F(CloudQueueTest, DropsWhatHasWaitedTooLong) {
  push(1, "nowhere");
  now_ += ros::Duration(6.0);
  push(2, "nowhere");
  now_ += ros::Duration(6.0);
  queue_->update(now_);
  ASSERT_EQ(drops_.size(), 1U);
  EXPECT_EQ(drops_[0].reason, DropReason::kNoTransform);
  EXPECT_NE(drops_[0].text.find("waited for 10 s: map <- nowhere is missing"), std::string::npos);
  EXPECT_EQ(queue_->size(), 1U);
  now_ += ros::Duration(6.0);
  queue_->update(now_);
  EXPECT_EQ(drops_.size(), 2U);
  EXPECT_EQ(queue_->size(), 0U);
}

TEST_F(CloudQueueTest, BeginsToWaitAnewWhenTimeJumpsBack) {
  push(1, "nowhere");
  now_ = ros::Time(100.0);
  for (int i = 0; i < 4; ++i, now_ += ros::Duration(3.0)) queue_->update(now_);
  EXPECT_TRUE(drops_.empty());
  now_ += ros::Duration(3.0);
  queue_->update(now_);
  EXPECT_EQ(numDrops(DropReason::kNoTransform), 1U);
}

TEST_F(CloudQueueTest, BeginsToWaitWhenSimulatedTimeBegins) {
  now_ = ros::Time();  // Before the first /clock.
  push(1, "nowhere");
  now_ = ros::Time(1000.0);
  for (int i = 0; i < 4; ++i, now_ += ros::Duration(3.0)) queue_->update(now_);
  EXPECT_TRUE(drops_.empty());
  now_ += ros::Duration(3.0);
  queue_->update(now_);
  EXPECT_EQ(numDrops(DropReason::kNoTransform), 1U);
}

TEST_F(CloudQueueTest, WaitsOnWhateverTheTimeIs) {
  for (const double now_s : {0.0, 2147483649.0, 1.0, 4294967290.0}) {
    now_ = ros::Time(now_s);
    EXPECT_NO_THROW(push(1, "nowhere"));
    EXPECT_NO_THROW(queue_->update(now_));
  }
}

TEST_F(CloudQueueTest, DropsAtOnceWhatTfHasForgotten) {
  too_old_frames_.insert("slow");
  push(1, "slow");
  EXPECT_EQ(numDrops(DropReason::kTooOldForTf), 1U);
  push(2, "nowhere");
  too_old_frames_.insert("nowhere");
  queue_->update(now_);
  EXPECT_EQ(numDrops(DropReason::kTooOldForTf), 2U);
  EXPECT_EQ(queue_->size() + queue_->numBytes(), 0U);
}

TEST_F(CloudQueueTest, DropsACloudWithoutFrame) {
  push(1, "");
  EXPECT_EQ(numDrops(DropReason::kEmptyFrame), 1U);
  EXPECT_EQ(queue_->size(), 0U);
}

TEST_F(CloudQueueTest, TakesItsTurnBackWhenItGoes) {
  push(1);
  queue_.reset();
  EXPECT_EQ(callbacks_.callOne(), ros::CallbackQueue::Empty);
  EXPECT_TRUE(handled_.empty());
}

}  // namespace
}  // namespace cuboid_mapping_ros
