// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/cloud_buffer.h"

#include <gtest/gtest.h>
#include <boost/make_shared.hpp>

#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using Ids = std::vector<unsigned>;

struct Drop {
  DropReason reason;
  std::string text;
};

/// A buffer for three clouds with poses, 10 s and 100 kB, and a tf that knows some frames; notes the outcome of
/// clouds, by width.
class CloudBufferTest : public ::testing::Test {
 protected:
  void put(unsigned id, const std::string& frame_id = "lidar", std::size_t num_bytes = 0) {
    const auto cloud = boost::make_shared<sensor_msgs::PointCloud2>();
    cloud->width = id;
    cloud->header.frame_id = frame_id;
    cloud->header.stamp = ros::Time(1000.0 + 0.001 * id);
    cloud->data.resize(num_bytes);
    buffer_.put({cloud});
  }

  /// Takes all clouds that may go now.
  Ids takeAll() {
    Ids ids;
    while (const auto next = buffer_.takeNext()) {
      ids.push_back(std::get<sensor_msgs::PointCloud2::ConstPtr>(next->message.content)->width);
    }
    return ids;
  }

  PoseSearch search(const std_msgs::Header& header) {
    ++num_searches_;
    PoseSearch search;
    if (known_frames_.count(header.frame_id) > 0) {
      search.poses = CloudPoses{};
    } else {
      search.why = "map <- " + header.frame_id + " is missing";
      search.lead_s = lead_s_;
      search.is_too_old = too_old_frames_.count(header.frame_id) > 0;
    }
    return search;
  }

  CloudBuffer::Callbacks makeCallbacks() {
    CloudBuffer::Callbacks callbacks;
    callbacks.find_poses = [this](const SensorMessage& cloud, const Slices&) {
      return search(cloud.header());
    };
    callbacks.read_slices = [this](const SensorMessage&) {
      ++num_times_read_;
      return Slices();
    };
    callbacks.drop = [this](std::size_t /*source*/, DropReason reason, const std::string& text) {
      drops_.push_back({reason, text});
    };
    callbacks.say_waiting = [this](std::size_t /*source*/, const std::string& why) {
      said_.push_back(why);
    };
    callbacks.clock_s = [this] { return clock_s_; };
    callbacks.now = [this] { return now_; };
    return callbacks;
  }

  static CloudLimits makeLimits() {
    CloudLimits limits;
    limits.queue_size = 3;
    limits.max_bytes = 100000;
    return limits;
  }

  [[nodiscard]] std::size_t numDrops(DropReason reason) const {
    std::size_t count = 0;
    for (const Drop& drop : drops_) count += drop.reason == reason ? 1 : 0;
    return count;
  }

  std::set<std::string> known_frames_{"lidar"};
  std::set<std::string> too_old_frames_;
  std::optional<double> lead_s_;
  ros::Time now_{1000.0};
  double clock_s_ = 50.0;
  int num_searches_ = 0;
  int num_times_read_ = 0;
  std::vector<Drop> drops_;
  std::vector<std::string> said_;
  CloudBuffer buffer_{makeLimits(), makeCallbacks()};
};

TEST_F(CloudBufferTest, GivesCloudsInTheOrderInWhichTheyCame) {
  for (unsigned id = 1; id <= 3; ++id) put(id);
  EXPECT_TRUE(buffer_.hasNext());
  EXPECT_EQ(takeAll(), (Ids{1, 2, 3}));
  EXPECT_FALSE(buffer_.hasNext());
  EXPECT_TRUE(drops_.empty());
  EXPECT_EQ(buffer_.numBytes(), 0U);
}

TEST_F(CloudBufferTest, ABurstLosesNothing) {
  for (unsigned id = 1; id <= 30; ++id) put(id, "lidar");
  EXPECT_TRUE(buffer_.hasNext());
  clock_s_ += 0.5;
  EXPECT_EQ(takeAll().size(), 30U) << "queue_size is 3, but the node keeps up";
  EXPECT_TRUE(drops_.empty());
}

TEST_F(CloudBufferTest, ANodeThatIsTooSlowLosesTheNewestNotTheNextInTurn) {
  for (unsigned id = 1; id <= 30; ++id) put(id, "lidar");
  EXPECT_TRUE(buffer_.hasNext());
  clock_s_ += 1.5;
  EXPECT_EQ(takeAll(), (Ids{1, 2, 3}));
  EXPECT_EQ(numDrops(DropReason::kQueueFull), 27U);
  EXPECT_NE(drops_.front().text.find("queue_size"), std::string::npos) << drops_.front().text;
}

TEST_F(CloudBufferTest, CloudsThatCameWhileTheMapWasHeldAreWorkedOff) {
  put(1);
  EXPECT_EQ(takeAll(), (Ids{1}));
  for (unsigned id = 2; id <= 40; ++id) put(id);  // A service holds the map for 4 s.
  clock_s_ += 4.0;
  unsigned id = 40;
  std::size_t num_taken = 0;
  for (int step = 0; step < 100; ++step) {  // 20 clouds per second go, 10 come.
    num_taken += buffer_.takeNext() ? 1 : 0;
    if (step % 2 == 0) put(++id);
    clock_s_ += 0.05;
  }
  EXPECT_TRUE(drops_.empty()) << drops_.front().text;
  EXPECT_EQ(num_taken + buffer_.size(), id - 1U);
  EXPECT_LE(buffer_.size(), 3U);
}

TEST_F(CloudBufferTest, CloudsThatComeFasterThanTheyGoAreDropped) {
  unsigned id = 0;
  for (int step = 0; step < 100; ++step) {  // 10 clouds per second go, 20 come.
    if (step % 2 == 0) (void)buffer_.takeNext();
    put(++id);
    clock_s_ += 0.05;
  }
  EXPECT_GT(numDrops(DropReason::kQueueFull), 30U);
  EXPECT_LE(buffer_.size(), 14U) << "queue_size, and what comes within a second";
}

TEST_F(CloudBufferTest, AnyNumberOfCloudsWaitsForTf) {
  for (unsigned id = 1; id <= 200; ++id) put(id, "camera");
  clock_s_ += 9.0;
  now_ += ros::Duration(9.0);
  EXPECT_TRUE(takeAll().empty());
  EXPECT_EQ(buffer_.size(), 200U);
  known_frames_.insert("camera");
  EXPECT_EQ(takeAll().size(), 200U);
  EXPECT_TRUE(drops_.empty());
}

TEST_F(CloudBufferTest, TfIsAskedForTheFirstOfThoseThatWaitOnly) {
  for (unsigned id = 1; id <= 100; ++id) put(id, "camera");
  lead_s_ = 0.5;
  EXPECT_FALSE(buffer_.hasNext());
  num_searches_ = 0;
  EXPECT_FALSE(buffer_.hasNext());
  EXPECT_EQ(num_searches_, 1) << "tf does not reach it, nor what is later";
  lead_s_ = -0.5;
  num_searches_ = 0;
  EXPECT_FALSE(buffer_.hasNext());
  EXPECT_EQ(num_searches_, 100) << "tf begins after the first of them: later ones may have poses";
}

TEST_F(CloudBufferTest, TheTimesOfPointsAreReadOnce) {
  put(1, "camera");
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(buffer_.hasNext());
  EXPECT_EQ(num_times_read_, 1);
  EXPECT_EQ(num_searches_, 10);
}

TEST_F(CloudBufferTest, CloudsThatWaitForTfLetOthersPass) {
  put(1, "camera");
  put(2);
  EXPECT_EQ(takeAll(), (Ids{2}));
  known_frames_.insert("camera");
  EXPECT_EQ(takeAll(), (Ids{1}));
}

TEST_F(CloudBufferTest, KeepsThePosesThatWereFoundWhateverTfForgets) {
  put(1);
  EXPECT_TRUE(buffer_.hasNext());
  known_frames_.clear();
  EXPECT_EQ(takeAll(), (Ids{1}));
}

TEST_F(CloudBufferTest, SearchesAnewWhenOtherFramesAreNeeded) {
  put(1);
  EXPECT_TRUE(buffer_.hasNext());
  buffer_.setSearch([](const SensorMessage&, const Slices&) { return PoseSearch{}; });
  EXPECT_TRUE(takeAll().empty());
}

TEST_F(CloudBufferTest, FullMemoryCostsTheNewestAndSaysWhatCuresIt) {
  lead_s_ = 6.0;
  for (unsigned id = 1; id <= 6; ++id) put(id, "camera", 30000);
  EXPECT_LE(buffer_.numBytes(), 100000U);
  EXPECT_EQ(numDrops(DropReason::kNoTransform), drops_.size());
  ASSERT_FALSE(drops_.empty());
  EXPECT_NE(drops_.back().text.find("queue_memory"), std::string::npos) << drops_.back().text;
  known_frames_.insert("camera");
  const Ids taken = takeAll();
  EXPECT_EQ(taken.front(), 1U);
  EXPECT_EQ(taken.size() + drops_.size(), 6U);
  put(7, "camera", 1000000);
  EXPECT_EQ(takeAll(), (Ids{7})) << "one may come, whatever its size";
}

TEST_F(CloudBufferTest, DropsWhatHasWaitedTooLongAndSaysWhyItHad) {
  const auto expireOne = [this](std::optional<double> lead_s) {
    lead_s_ = lead_s;
    drops_.clear();
    put(1, "camera");
    EXPECT_FALSE(buffer_.hasNext());
    now_ += ros::Duration(9.9);
    EXPECT_FALSE(buffer_.hasNext());
    EXPECT_TRUE(drops_.empty());
    now_ += ros::Duration(0.2);
    clock_s_ += 10.1;
    EXPECT_FALSE(buffer_.hasNext());
    EXPECT_EQ(drops_.size(), 1U);
    const std::string text = drops_.empty() ? "" : drops_.front().text;
    EXPECT_NE(text.find("map <- camera is missing"), std::string::npos) << text;
    now_ = ros::Time(1000.0);
    return text;
  };
  EXPECT_NE(expireOne(std::nullopt).find("tf_echo"), std::string::npos);
  EXPECT_NE(expireOne(12.0).find("tf_wait"), std::string::npos) << "tf comes, but late";
  EXPECT_NE(expireOne(-1.0).find("tf begins after"), std::string::npos);
  now_ = ros::Time(900.0);
  put(2, "camera");
  now_ += ros::Duration(11.0);
  lead_s_ = 90.0;
  EXPECT_FALSE(buffer_.hasNext());
  EXPECT_NE(drops_.back().text.find("ahead of this machine's clock"), std::string::npos)
      << drops_.back().text;
}

TEST_F(CloudBufferTest, WaitingBeginsAnewWhenTimeJumpsBackOrBegins) {
  put(1, "camera");
  now_ = ros::Time(100.0);
  EXPECT_FALSE(buffer_.hasNext());
  now_ = ros::Time(109.0);
  EXPECT_FALSE(buffer_.hasNext());
  EXPECT_TRUE(drops_.empty());
  now_ = ros::Time();  // Before the first /clock.
  put(2, "camera");
  EXPECT_FALSE(buffer_.hasNext());
  now_ = ros::Time(2000.0);
  EXPECT_FALSE(buffer_.hasNext());
  EXPECT_TRUE(drops_.empty());
  now_ += ros::Duration(11.0);
  EXPECT_FALSE(buffer_.hasNext());
  EXPECT_EQ(drops_.size(), 2U);
}

TEST_F(CloudBufferTest, WaitingIsSaidAfterASecondOfWallTimeAlsoWhileTheClockStandsStill) {
  put(1, "camera");
  clock_s_ += 0.9;
  EXPECT_FALSE(buffer_.hasNext());
  EXPECT_TRUE(said_.empty());
  clock_s_ += 0.2;
  EXPECT_FALSE(buffer_.hasNext());
  ASSERT_EQ(said_.size(), 1U);
  EXPECT_NE(said_[0].find("map <- camera is missing"), std::string::npos) << said_[0];
  for (int i = 0; i < 50; ++i) {
    clock_s_ += 1.0;
    EXPECT_FALSE(buffer_.hasNext());
  }
  EXPECT_EQ(said_.size(), 1U) << "once a minute";
}

TEST_F(CloudBufferTest, NamesAClockThatIsWrongOnce) {
  too_old_frames_.insert("camera");
  lead_s_ = -1.7e9;
  now_ = ros::Time(1.7e9);
  for (unsigned id = 1; id <= 3; ++id) {
    put(id, "camera");
    EXPECT_FALSE(buffer_.hasNext());
  }
  EXPECT_EQ(numDrops(DropReason::kTooOldForTf), 3U);
  EXPECT_NE(drops_[0].text.find("its clock"), std::string::npos) << drops_[0].text;
  EXPECT_EQ(drops_[1].text + drops_[2].text, "") << "it has been said";
}

TEST_F(CloudBufferTest, ACloudThatTfSeemsToHaveForgottenWaitsWhileTheNodesTimeIsItsOwn) {
  too_old_frames_.insert("camera");  // As after a jump of /clock that tf has not noticed.
  put(1, "camera");
  EXPECT_FALSE(buffer_.hasNext());
  EXPECT_TRUE(drops_.empty());
  known_frames_.insert("camera");
  EXPECT_EQ(takeAll(), (Ids{1}));
}

TEST_F(CloudBufferTest, DropsACloudWithoutFrame) {
  put(1, "");
  ASSERT_EQ(drops_.size(), 1U);
  EXPECT_EQ(drops_[0].reason, DropReason::kEmptyFrame);
}

TEST_F(CloudBufferTest, WaitsForACloudForTfAndForTheEnd) {
  Ids taken;
  std::thread worker([&] {
    while (const auto next = buffer_.waitNext()) {
      taken.push_back(std::get<sensor_msgs::PointCloud2::ConstPtr>(next->message.content)->width);
      if (taken.size() == 2) buffer_.stop();
    }
  });
  put(1);
  put(2, "camera");
  buffer_.setSearch([](const SensorMessage&, const Slices&) {
    PoseSearch found;
    found.poses = CloudPoses{};
    return found;
  });
  worker.join();
  EXPECT_EQ(taken, (Ids{1, 2}));
  EXPECT_FALSE(buffer_.waitNext()) << "it stays stopped";
}

}  // namespace
}  // namespace cuboid_mapping_ros
