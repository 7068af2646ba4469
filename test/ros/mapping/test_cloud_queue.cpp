// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/mapping/cloud_queue.h"

#include <gtest/gtest.h>
#include <boost/make_shared.hpp>

#include <algorithm>
#include <atomic>
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

/// A queue for three clouds with poses, 10 s and 100 kB of two sources, and a tf that knows some frames; notes
/// the outcome of clouds, by width.
class CloudQueueTest : public ::testing::Test {
 protected:
  void put(unsigned id, const std::string& frame_id = "lidar", std::size_t num_bytes = 0,
           std::size_t source = 0) {
    const auto cloud = boost::make_shared<sensor_msgs::PointCloud2>();
    cloud->width = id;
    cloud->header.frame_id = frame_id;
    cloud->header.stamp = ros::Time(1000.0 + 0.001 * id);
    cloud->data.resize(num_bytes);
    clouds_.put({cloud, source});
  }

  /// Takes all clouds that are ready, or some of them.
  Ids takeAll(std::size_t count = 1000) {
    Ids ids;
    while (ids.size() < count) {
      const auto next = clouds_.takeNext();
      if (!next) break;
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
      search.cache_s = 20.0;
      if (lead_s_ && *lead_s_ < 0.0) search.hopeless = DropReason::kBeforeTf;
    }
    return search;
  }

  CloudQueue::Callbacks makeCallbacks() {
    CloudQueue::Callbacks callbacks;
    callbacks.find_poses = [this](const SensorMessage& cloud, const Slices&) {
      if (!knows_all_) return search(cloud.header());
      PoseSearch found;
      found.poses = CloudPoses{};
      return found;
    };
    callbacks.find_slices = [this](const SensorMessage&) {
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
    limits.num_sources = 2;
    limits.max_waiting_bytes = 100000;
    return limits;
  }

  /// Keeps the mapping thread busy for longer than a burst.
  void beBusy() {
    put(1000);
    ASSERT_EQ(takeAll(1), (Ids{1000}));
    clock_s_ += 1.5;
  }

  [[nodiscard]] std::size_t numDrops(DropReason reason) const {
    std::size_t count = 0;
    for (const Drop& drop : drops_) count += drop.reason == reason ? 1 : 0;
    return count;
  }

  std::set<std::string> known_frames_{"lidar"};
  std::atomic<bool> knows_all_{false};  ///< Frames.
  std::optional<double> lead_s_;
  ros::Time now_{1000.0};
  double clock_s_ = 50.0;
  int num_searches_ = 0;
  int num_times_read_ = 0;
  std::vector<Drop> drops_;
  std::vector<std::string> said_;
  CloudQueue clouds_{makeLimits(), makeCallbacks()};
};

TEST_F(CloudQueueTest, GivesCloudsInTheOrderInWhichTheyCame) {
  for (unsigned id = 1; id <= 3; ++id) put(id);
  EXPECT_TRUE(clouds_.hasReady());
  EXPECT_EQ(takeAll(), (Ids{1, 2, 3}));
  EXPECT_FALSE(clouds_.hasReady());
  EXPECT_TRUE(drops_.empty());
}

TEST_F(CloudQueueTest, ABurstLosesNothing) {
  for (unsigned id = 1; id <= 30; ++id) put(id);
  clock_s_ += 0.5;
  EXPECT_EQ(takeAll().size(), 30U) << "queue_size is 3, but the node keeps up";
  EXPECT_TRUE(drops_.empty());
}

TEST_F(CloudQueueTest, ANodeThatIsTooSlowLosesTheOldest) {
  beBusy();
  for (unsigned id = 1; id <= 30; ++id) put(id);
  EXPECT_EQ(takeAll(), (Ids{28, 29, 30}));
  EXPECT_EQ(numDrops(DropReason::kQueueFull), 27U);
  EXPECT_NE(drops_.front().text.find("resolution"), std::string::npos) << drops_.front().text;
}

TEST_F(CloudQueueTest, BurstsAfterAnotherCostNothingWhileTheNodeIsIdleInBetween) {
  for (int burst = 0; burst < 5; ++burst) {  // tf comes once a second, for 10 clouds.
    for (unsigned id = 1; id <= 10; ++id) put(id);
    for (int i = 0; i < 10; ++i, clock_s_ += 0.05) EXPECT_EQ(takeAll(1).size(), 1U);
    EXPECT_TRUE(takeAll().empty());
    clock_s_ += 0.5;
  }
  EXPECT_TRUE(drops_.empty());
}

TEST_F(CloudQueueTest, CloudsThatCameWhileTheMapWasHeldAreLostButTheNewest) {
  put(1);
  EXPECT_EQ(takeAll(1), (Ids{1}));
  for (unsigned id = 2; id <= 40; ++id, clock_s_ += 0.1)
    put(id);  // A service holds the map for 4 s.
  EXPECT_EQ(takeAll(), (Ids{38, 39, 40}));
}

TEST_F(CloudQueueTest, ASourceOfManyCloudsDoesNotKeepTheOtherFromItsTurn) {
  beBusy();
  Ids taken;
  for (unsigned id = 1; id <= 100; ++id, clock_s_ += 0.01) {
    put(id);
    if (id % 10 == 0) put(id + 1000, "lidar", 0, 1);
    if (id % 20 == 0) taken.push_back(takeAll(1).at(0));
  }
  EXPECT_EQ(std::count_if(taken.begin(), taken.end(), [](unsigned id) { return id > 1000; }), 3)
      << "they take turns";
}

TEST_F(CloudQueueTest, SourcesDoNotWaitForEachOther) {
  put(1, "camera", 0, 1);
  put(2);
  EXPECT_EQ(takeAll(), (Ids{2}));
}

TEST_F(CloudQueueTest, AnyNumberOfCloudsWaitsForTf) {
  for (unsigned id = 1; id <= 200; ++id) put(id, "camera");
  clock_s_ += 9.0;
  now_ += ros::Duration(9.0);
  EXPECT_TRUE(takeAll().empty());
  EXPECT_EQ(clouds_.size(), 200U);
  known_frames_.insert("camera");
  EXPECT_EQ(takeAll().size(), 200U);
  EXPECT_TRUE(drops_.empty());
}

TEST_F(CloudQueueTest, TfIsAskedForTheFirstOfThoseThatWaitOnly) {
  for (unsigned id = 1; id <= 100; ++id) put(id, "camera");
  lead_s_ = 0.5;
  num_searches_ = 0;
  EXPECT_TRUE(takeAll().empty());
  EXPECT_EQ(num_searches_, 1) << "tf does not reach it, nor what is later";
}

TEST_F(CloudQueueTest, TheTimesOfPointsAreReadOnce) {
  put(1, "camera");
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(takeAll().empty());
  EXPECT_EQ(num_times_read_, 1);
  EXPECT_EQ(num_searches_, 11);
}

TEST_F(CloudQueueTest, CloudsThatWaitForTfLetOthersPass) {
  put(1, "camera");
  put(2);
  EXPECT_EQ(takeAll(), (Ids{2}));
  known_frames_.insert("camera");
  EXPECT_EQ(takeAll(), (Ids{1}));
}

TEST_F(CloudQueueTest, KeepsThePosesThatWereFoundWhateverTfForgets) {
  put(1);
  known_frames_.clear();
  EXPECT_EQ(takeAll(), (Ids{1}));
}

TEST_F(CloudQueueTest, SearchesAnewAfterAChangeOfParameters) {
  put(1);
  known_frames_.clear();
  clouds_.searchAgain();
  EXPECT_TRUE(takeAll().empty());
  EXPECT_EQ(clouds_.size(), 1U);
  EXPECT_EQ(num_times_read_, 2) << "other points may be mapped, with times in other slices";
}

TEST_F(CloudQueueTest, FullMemoryCostsTheNewestOfThoseThatWaitForTf) {
  lead_s_ = 6.0;
  for (unsigned id = 1; id <= 6; ++id) put(id, "camera", 30000);
  put(7, "camera", 30000, 1);
  EXPECT_EQ(drops_.size(), 3U) << "each source has its memory";
  EXPECT_NE(drops_.front().text.find("of which at most 0 MB may"), std::string::npos)
      << drops_.front().text;
  EXPECT_EQ(numDrops(DropReason::kNoTransform), drops_.size());
  known_frames_.insert("camera");
  EXPECT_EQ(takeAll(), (Ids{1, 7, 2, 3}));
  known_frames_.clear();
  put(8, "camera", 1000000);
  EXPECT_EQ(clouds_.size(), 1U) << "one may come, whatever its size";
}

/// Drivers that publish the same message again and again, with other content.
TEST_F(CloudQueueTest, AMessageThatItsPublisherChangesCostsNoLaterCloud) {
  const auto reused = boost::make_shared<sensor_msgs::PointCloud2>();
  reused->header.frame_id = "camera";
  reused->data.resize(1000);
  clouds_.put({sensor_msgs::PointCloud2::ConstPtr(reused)});
  reused->data.resize(90000);
  known_frames_.insert("camera");
  EXPECT_EQ(takeAll().size(), 1U);
  known_frames_.clear();
  for (unsigned id = 1; id <= 10; ++id) put(id, "camera", 100);
  EXPECT_TRUE(drops_.empty()) << drops_.front().text;
}

TEST_F(CloudQueueTest, DropsWhatHasWaitedTooLongAndSaysWhyItHad) {
  const auto expire_one = [this](std::optional<double> lead_s) {
    lead_s_ = lead_s;
    drops_.clear();
    put(1, "camera");
    now_ += ros::Duration(9.9);
    EXPECT_TRUE(takeAll().empty());
    EXPECT_TRUE(drops_.empty());
    now_ += ros::Duration(0.2);
    clock_s_ += 10.1;
    EXPECT_TRUE(takeAll().empty());
    EXPECT_EQ(drops_.size(), 1U);
    const std::string text = drops_.empty() ? "" : drops_.front().text;
    EXPECT_NE(text.find("map <- camera is missing"), std::string::npos) << text;
    now_ = ros::Time(1000.0);
    return text;
  };
  EXPECT_NE(expire_one(std::nullopt).find("echo.py"), std::string::npos);
  EXPECT_NE(expire_one(12.0).find("tf_wait"), std::string::npos) << "tf comes, but late";
  now_ = ros::Time(900.0);
  put(2, "camera");
  now_ += ros::Duration(11.0);
  lead_s_ = 90.0;
  ros::Time::init();
  EXPECT_TRUE(takeAll().empty());
  EXPECT_NE(drops_.back().text.find("ahead of this machine's clock"), std::string::npos)
      << drops_.back().text;
  ros::Time::setNow(now_);  // As use_sim_time does.
  put(3, "camera");
  now_ += ros::Duration(11.0);
  EXPECT_TRUE(takeAll().empty());
  EXPECT_NE(drops_.back().text.find("ahead of /clock"), std::string::npos) << drops_.back().text;
  ros::Time::init();
}

TEST_F(CloudQueueTest, ACloudOfTheRunBeforeAJumpBackIsNoFaultOfAClock) {
  put(1, "camera");
  now_ = ros::Time(990.0);
  EXPECT_TRUE(takeAll().empty());
  EXPECT_EQ(numDrops(DropReason::kBeforeTf), 1U);
  put(2, "camera");  // Its sensor's clock is ahead.
  now_ = ros::Time(989.5);
  EXPECT_TRUE(takeAll().empty());
  EXPECT_EQ(drops_.size(), 1U) << "the time was corrected";
}

TEST_F(CloudQueueTest, WaitingBeginsAnewWhenTimeJumpsBackOrBegins) {
  now_ = ros::Time(2000.0);
  put(1, "camera");  // Of the new run; its /clock comes later.
  now_ = ros::Time(1000.0);
  EXPECT_TRUE(takeAll().empty());
  now_ = ros::Time(1009.0);
  EXPECT_TRUE(takeAll().empty());
  EXPECT_TRUE(drops_.empty());
  now_ = ros::Time(1011.0);
  EXPECT_TRUE(takeAll().empty());
  EXPECT_EQ(drops_.size(), 1U);
  now_ = ros::Time();  // Before the first /clock.
  put(2, "camera");
  now_ = ros::Time(2000.0);
  EXPECT_TRUE(takeAll().empty());
  EXPECT_EQ(drops_.size(), 1U);
  now_ += ros::Duration(11.0);
  EXPECT_TRUE(takeAll().empty());
  EXPECT_EQ(drops_.size(), 2U);
}

TEST_F(CloudQueueTest, WaitingIsSaidAfterASecondOfWallTimeAlsoWhileTheClockStandsStill) {
  put(1, "camera");
  clock_s_ += 0.9;
  EXPECT_TRUE(takeAll().empty());
  EXPECT_TRUE(said_.empty());
  clock_s_ += 0.2;
  EXPECT_TRUE(takeAll().empty());
  ASSERT_EQ(said_.size(), 1U);
  EXPECT_NE(said_[0].find("map <- camera is missing"), std::string::npos) << said_[0];
  for (int i = 0; i < 50; ++i, clock_s_ += 1.0) EXPECT_TRUE(takeAll().empty());
  EXPECT_EQ(said_.size(), 1U) << "once a minute";
}

TEST_F(CloudQueueTest, NamesAClockThatIsWrongOnce) {
  lead_s_ = -1.7e9;
  now_ = ros::Time(1.7e9);
  for (unsigned id = 1; id <= 3; ++id) put(id, "camera");
  EXPECT_EQ(numDrops(DropReason::kTooOldForTf), 3U);
  EXPECT_NE(drops_[0].text.find("years behind tf: check the sensor's clock"), std::string::npos)
      << drops_[0].text;
  EXPECT_EQ(drops_[1].text + drops_[2].text, "") << "it has been said";
}

TEST_F(CloudQueueTest, ASourceWhoseCloudsHadTransformsIsLateAndItsClockIsNoFault) {
  put(1);
  ASSERT_EQ(takeAll(), (Ids{1}));
  known_frames_.clear();
  lead_s_ = -30.0;  // The node was stopped for 30 s.
  now_ += ros::Duration(30.0);
  put(2);
  ASSERT_EQ(numDrops(DropReason::kTooOldForTf), 1U);
  EXPECT_NE(drops_[0].text.find("30 s behind tf: it came late"), std::string::npos)
      << drops_[0].text;
}

TEST_F(CloudQueueTest, NamesTheFrameOfTheCloudThatHasWaitedLongest) {
  EXPECT_EQ(clouds_.whyWaiting(), "");
  put(1, "camera", 0, 1);
  clock_s_ += 1.0;
  put(2, "laser", 0, 0);
  EXPECT_EQ(clouds_.whyWaiting().find("frame 'camera': map <- camera is missing; check that tf"),
            0U)
      << clouds_.whyWaiting();
}

TEST_F(CloudQueueTest, ACloudThatCameBeforeTheFirstTransformHasARightClock) {
  put(1, "camera");
  now_ += ros::Duration(9.0);  // It has waited; then tf begins, later than it.
  lead_s_ = -9.0;
  EXPECT_TRUE(takeAll().empty());
  EXPECT_EQ(numDrops(DropReason::kBeforeTf), 1U);
}

TEST_F(CloudQueueTest, ACloudThatTfSeemsToHaveForgottenWaitsAfterAJumpOfTheClock) {
  lead_s_ = -300.0;  // /clock has jumped back; tf has not noticed.
  put(1, "camera");
  EXPECT_TRUE(drops_.empty());
  known_frames_.insert("camera");
  EXPECT_EQ(takeAll(), (Ids{1}));
}

TEST_F(CloudQueueTest, DropsACloudWithoutFrame) {
  put(1, "");
  put(2, "/");  // The slash of tf's names, and no name.
  ASSERT_EQ(drops_.size(), 2U);
  for (const auto& drop : drops_) EXPECT_EQ(drop.reason, DropReason::kEmptyFrame);
}

TEST_F(CloudQueueTest, WaitsForACloudForTfAndForTheEnd) {
  Ids taken;
  std::thread worker([&] {
    while (clouds_.waitReady()) {
      const auto next = clouds_.takeNext();
      taken.push_back(std::get<sensor_msgs::PointCloud2::ConstPtr>(next->message.content)->width);
      if (taken.size() == 2) clouds_.stop();
    }
  });
  put(1);
  put(2, "camera");
  knows_all_ = true;
  clouds_.searchAgain();
  worker.join();
  EXPECT_EQ(taken, (Ids{1, 2}));
  EXPECT_FALSE(clouds_.waitReady()) << "it stays stopped";
}

}  // namespace
}  // namespace cuboid_mapping_ros
