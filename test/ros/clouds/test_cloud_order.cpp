// SPDX-License-Identifier: BSD-3-Clause
// Clouds of several sources are taken in the order of their stamps.
#include "cuboid_mapping/ros/clouds/cloud_buffer.h"

#include "support/random.h"

#include <gtest/gtest.h>
#include <boost/make_shared.hpp>

#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

/// Pairs (stamp in seconds, source).
using Clouds = std::vector<std::pair<double, std::size_t>>;

/// A buffer for three sources that waits 0.2 s for earlier clouds, with a clock of the test.
class CloudOrderTest : public ::testing::Test {
 protected:
  void push(double stamp_s, std::size_t source, const std::string& frame_id = "lidar") {
    const auto cloud = boost::make_shared<sensor_msgs::PointCloud2>();
    cloud->header.frame_id = frame_id;
    cloud->header.stamp = ros::Time(stamp_s);
    buffer_.put({cloud, source});
    callAll();
  }

  void pass(double seconds) {
    clock_s_ += seconds;
    callAll();
  }

  void callAll() {
    while (const auto next = buffer_.takeNext()) {
      handled_.emplace_back(next->message.header().stamp.toSec(), next->message.source);
    }
  }

  CloudBuffer::Callbacks makeCallbacks() {
    CloudBuffer::Callbacks callbacks;
    callbacks.find_poses = [this](const SensorMessage& cloud, const Slices&) {
      PoseSearch search;
      if (known_frames_.count(cloud.header().frame_id) > 0) search.poses = CloudPoses{};
      return search;
    };
    callbacks.now = [] { return ros::Time(1000.0); };
    callbacks.drop = [this](std::size_t, DropReason, const std::string&) { ++num_dropped_; };
    callbacks.clock_s = [this] { return clock_s_; };
    return callbacks;
  }

  static CloudLimits makeLimits() {
    CloudLimits limits;
    limits.num_sources = 3;
    return limits;
  }

  double clock_s_ = 50.0;
  std::set<std::string> known_frames_{"lidar"};
  Clouds handled_;
  int num_dropped_ = 0;
  CloudBuffer buffer_{makeLimits(), makeCallbacks()};
};

TEST_F(CloudOrderTest, ACloudGoesOnceEveryOtherSourceHasGoneOn) {
  push(1000.0, 0);
  push(1000.1, 1);
  EXPECT_TRUE(handled_.empty()) << "the third may still send an earlier one";
  push(999.9, 2);
  EXPECT_EQ(handled_, (Clouds{{999.9, 2}}));
  push(1000.2, 2);
  EXPECT_EQ(handled_, (Clouds{{999.9, 2}, {1000.0, 0}}));
  push(1000.2, 0);
  EXPECT_EQ(handled_.back(), (Clouds::value_type{1000.1, 1}));
  EXPECT_EQ(buffer_.size(), 2U) << "both at 1000.2: the second source has not come so far";
  EXPECT_EQ(buffer_.numOutOfOrder(), 0U);
}

TEST_F(CloudOrderTest, SourcesThatHaveNotSpokenAreWaitedForFromTheFirstCloudOn) {
  pass(30.0);  // The node runs before a bag begins.
  push(1000.0, 0);
  pass(0.05);
  push(1000.05, 0);
  push(1000.0, 1);
  push(1000.0, 2);
  EXPECT_EQ(handled_, (Clouds{{1000.0, 0}, {1000.0, 1}, {1000.0, 2}}));
  EXPECT_EQ(buffer_.numOutOfOrder(), 0U);
}

TEST_F(CloudOrderTest, OfOneStampTheFirstSourceGoesFirst) {
  for (const std::size_t source : {2, 0, 1}) push(1000.0, source);
  EXPECT_EQ(handled_, (Clouds{{1000.0, 0}, {1000.0, 1}, {1000.0, 2}}));
}

TEST_F(CloudOrderTest, ASourceThatIsSilentDelaysTheOthersOnlySoLong) {
  push(1000.0, 0);
  push(1000.1, 1);
  pass(0.1);
  EXPECT_TRUE(handled_.empty());
  pass(0.11);
  EXPECT_EQ(handled_, (Clouds{{1000.0, 0}, {1000.1, 1}}));
  push(999.0, 2);
  pass(0.3);
  EXPECT_EQ(handled_.back(), (Clouds::value_type{999.0, 2})) << "late, but not lost";
  EXPECT_EQ(buffer_.numOutOfOrder(), 1U);
}

TEST_F(CloudOrderTest, ACloudWithoutTransformKeepsLaterOnesWaitingOnlySoLong) {
  push(1000.0, 0, "arm");
  push(1000.1, 1);
  push(1000.2, 2);
  push(1000.3, 0);
  EXPECT_TRUE(handled_.empty());
  pass(0.1);
  known_frames_.insert("arm");
  pass(0.01);
  EXPECT_EQ(handled_, (Clouds{{1000.0, 0}, {1000.1, 1}})) << "in order";
  handled_.clear();
  push(1001.0, 0, "nowhere");
  push(1001.1, 1);
  push(1001.2, 2);
  pass(0.3);
  EXPECT_EQ(handled_.back(), (Clouds::value_type{1001.2, 2}));
  EXPECT_EQ(buffer_.size(), 1U);
  EXPECT_EQ(num_dropped_, 0);
}

TEST_F(CloudOrderTest, BeginsAnewWhenStampsDo) {
  for (const std::size_t source : {0, 1, 2}) push(2000.0, source);
  EXPECT_EQ(handled_.size(), 3U);
  push(1000.0, 0);
  push(1000.1, 1);
  EXPECT_EQ(handled_.size(), 3U) << "what was sent before the jump says nothing";
  push(1000.2, 2);
  EXPECT_EQ(handled_.size(), 4U);
  EXPECT_EQ(buffer_.numOutOfOrder(), 0U);
}

/// Each source is in order; the sources are shifted against each other by less than the wait.
TEST_F(CloudOrderTest, WhateverTheDelaysTheOrderIsThatOfTheStamps) {
  cuboid_mapping::test::Random random;
  struct Arrival {
    double time_s;
    double stamp_s;
    std::size_t source;
  };
  std::vector<Arrival> arrivals;
  for (std::size_t source = 0; source < 3; ++source) {
    double last_s = 0.0;
    for (double stamp_s = 1000.0; stamp_s < 1010.0; stamp_s += random.real(0.02, 0.15)) {
      last_s = std::max(last_s, stamp_s + random.real(0.0, 0.19));
      arrivals.push_back({last_s, stamp_s, source});
    }
  }
  std::stable_sort(arrivals.begin(), arrivals.end(),
                   [](const Arrival& a, const Arrival& b) { return a.time_s < b.time_s; });
  double now_s = 1000.0;
  for (const Arrival& arrival : arrivals) {
    pass(arrival.time_s - now_s);
    now_s = arrival.time_s;
    push(arrival.stamp_s, arrival.source);
  }
  pass(1.0);
  EXPECT_EQ(handled_.size(), arrivals.size());
  EXPECT_TRUE(std::is_sorted(handled_.begin(), handled_.end()));
  EXPECT_EQ(buffer_.numOutOfOrder(), 0U);
}

}  // namespace
}  // namespace cuboid_mapping_ros
