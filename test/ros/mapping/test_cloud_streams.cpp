// SPDX-License-Identifier: BSD-3-Clause
// Streams of clouds and of tf with delays and own clocks, in simulated time: which clouds are mapped.
#include "cuboid_mapping/ros/diagnostics/cloud_ledger.h"
#include "cuboid_mapping/ros/mapping/cloud_queue.h"

#include <gtest/gtest.h>

#include <boost/make_shared.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

/// Messages of one kind that come at a rate.
struct Stream {
  double rate_hz = 10.0;
  double offset_s = 0.0;   ///< Added to the stamp.
  double latency_s = 0.0;  ///< Time from measurement to arrival.
  double begin_s = 0.0;
};

/// Counts of mapped and dropped clouds, as in a node.
class CloudStreams : public ::testing::Test {
 protected:
  /// Lets sources and tf (map to lidar) send for some seconds, and waits some more.
  void run(const std::vector<Stream>& sources, const Stream& tf, double duration_s,
           CloudLimits limits = {}, double work_s = 0.0) {
    limits.num_sources = sources.size();
    num_inserted_.assign(sources.size(), 0);
    num_sent_.assign(sources.size(), 0);
    end_s_ = duration_s;
    clouds_ = std::make_unique<CloudQueue>(limits, makeCallbacks());
    struct Event {
      double time_s;
      std::function<void()> act;
    };
    std::vector<Event> events;
    for (std::size_t i = 0; i < sources.size(); ++i) {
      const Stream& source = sources[i];
      for (double t = source.begin_s; t < duration_s; t += 1.0 / source.rate_hz) {
        events.push_back(
            {t + source.latency_s,
             [this, i, stamp_s = kStart_s + t + source.offset_s] { putCloud(i, stamp_s); }});
      }
    }
    for (double t = -1.0; t < duration_s + 1.0; t += 1.0 / tf.rate_hz) {
      events.push_back(
          {t + tf.latency_s, [this, stamp_s = kStart_s + t + tf.offset_s] { putTf(stamp_s); }});
    }
    std::stable_sort(events.begin(), events.end(),
                     [](const Event& a, const Event& b) { return a.time_s < b.time_s; });
    double free_s = -10.0;
    for (const Event& event : events) {
      for (; time_s_ < event.time_s; time_s_ = std::min(time_s_ + 0.01, event.time_s)) {
        work(free_s, work_s);
      }
      event.act();
    }
    for (int i = 0; i < 2000; ++i, time_s_ += 0.01) work(free_s, work_s);
  }

  /// As a node that starts again.
  void restart() {
    time_s_ = -2.0;
    tf_.clear();
    texts_.clear();
    lags_s_.clear();
  }

  void work(double& free_s, double work_s) {
    while (time_s_ >= free_s) {
      const auto next = clouds_->takeNext();
      if (!next) return;
      ++num_inserted_[next->message.source];
      if (work_s > 0.0) free_s = time_s_ + work_s;
      if (time_s_ < kBurstEnd_s || time_s_ > end_s_) continue;
      const double lag_s = kStart_s + time_s_ + work_s - next->message.header().stamp.toSec();
      lags_s_.push_back(lag_s);
    }
  }

  void putCloud(std::size_t source, double stamp_s) {
    const auto cloud = boost::make_shared<sensor_msgs::PointCloud2>();
    cloud->header.frame_id = "lidar";
    cloud->header.stamp = ros::Time(stamp_s);
    cloud->data.resize(num_bytes_);
    ++num_sent_[source];
    clouds_->put({cloud, source});
  }

  void putTf(double stamp_s, const char* parent = "map", const char* child = "lidar") {
    geometry_msgs::TransformStamped transform;
    transform.header.frame_id = parent;
    transform.header.stamp = ros::Time(stamp_s);
    transform.child_frame_id = child;
    transform.transform.rotation.w = 1.0;
    tf_.setTransform(transform, "test");
  }

  [[nodiscard]] PoseSearch findPosesAt(double stamp_s) const {
    std_msgs::Header header;
    header.frame_id = "lidar";
    header.stamp = ros::Time(stamp_s);
    return findPoses(tf_, PoseFrames(parameters_, parameters_.source), header, {});
  }

  CloudQueue::Callbacks makeCallbacks() {
    CloudQueue::Callbacks callbacks;
    callbacks.find_poses = [this](const SensorMessage& cloud, const Slices& slices) {
      return findPoses(tf_, PoseFrames(parameters_, parameters_.source), cloud.header(), slices);
    };
    callbacks.drop = [this](std::size_t source, DropReason reason, const std::string& text) {
      ++num_dropped_[{source, reason}];
      if (!text.empty()) texts_.push_back(text);
    };
    callbacks.clock_s = [this] { return time_s_; };
    callbacks.now = [this] { return ros::Time(kStart_s + time_s_); };
    return callbacks;
  }

  static constexpr double kStart_s = 1.7e9;
  static constexpr double kBurstEnd_s = 3.0;
  NodeParameters parameters_;
  double time_s_ = -2.0;
  std::size_t num_bytes_ = 0;
  TfBuffer tf_{ros::Duration(25.0), 1.0};  // tf_wait and 10 s.
  std::vector<int> num_inserted_;
  double end_s_ = 0.0;
  /// Age of each cloud when it is in the map, from kBurstEnd_s on, while clouds arrive.
  std::vector<double> lags_s_;
  std::vector<int> num_sent_;
  std::map<std::pair<std::size_t, DropReason>, int> num_dropped_;
  std::vector<std::string> texts_;
  std::unique_ptr<CloudQueue> clouds_;
};

TEST_F(CloudStreams, ACloudThatIsAheadOfTfSaysByHowMuch) {
  putTf(kStart_s);
  const PoseSearch search = findPosesAt(kStart_s + 0.25);
  EXPECT_FALSE(search.poses);
  ASSERT_TRUE(search.lead_s);
  EXPECT_NEAR(*search.lead_s, 0.25, 1e-6);
}

TEST_F(CloudStreams, TransformsWithoutACommonTimeAreNamed) {
  putTf(kStart_s, "map", "base");
  putTf(kStart_s + 20.0, "base", "lidar");
  const PoseSearch search = findPosesAt(kStart_s + 20.0);
  EXPECT_FALSE(search.poses);
  EXPECT_TRUE(search.names_cure);
  EXPECT_EQ(search.why.rfind("the transforms between 'lidar' and 'map' have no time in common", 0),
            0U)
      << search.why;
}

TEST_F(CloudStreams, LateTfCostsNoCloud) {
  run({{30.0}}, {50.0, 0.0, 0.5}, 20.0);
  EXPECT_EQ(num_inserted_, num_sent_);
}

TEST_F(CloudStreams, VeryLateTfCostsNoCloud) {
  run({{10.0}}, {50.0, 0.0, 6.0}, 20.0);
  EXPECT_EQ(num_inserted_, num_sent_);
}

TEST_F(CloudStreams, VeryLateTfOfThreeFastSourcesCostsNoCloud) {
  run({{60.0}, {30.0}, {20.0}}, {200.0, 0.0, 6.0}, 10.0);
  EXPECT_EQ(num_inserted_, num_sent_);
}

TEST_F(CloudStreams, ASourceWithTheTimeSinceBootCostsTheOtherNothing) {
  run({{20.0, 1868.0 - kStart_s}, {10.0, -0.04}}, {50.0}, 60.0);
  EXPECT_EQ(num_inserted_[1], num_sent_[1]);
  EXPECT_EQ(num_inserted_[0], 0);
  EXPECT_EQ((num_dropped_[{0, DropReason::kTooOldForTf}]), num_sent_[0]);
  ASSERT_EQ(texts_.size(), 1U) << "named once";
  EXPECT_NE(texts_[0].find("years behind tf"), std::string::npos) << texts_[0];
}

TEST_F(CloudStreams, ASourceWhoseClockIsAMinuteSlowCostsTheOtherNothing) {
  run({{10.0, 0.0, 0.08}, {20.0, -60.0}}, {20.0}, 15.0);
  EXPECT_EQ(num_inserted_[0], num_sent_[0]);
  EXPECT_EQ(num_inserted_[1], 0);
}

TEST_F(CloudStreams, ASourceWhoseClockIsAMinuteFastCostsTheOtherNothing) {
  num_bytes_ = 1000000;
  CloudLimits limits;
  limits.max_waiting_bytes = 100000000;
  run({{10.0, 0.0, 0.08}, {20.0, 60.0}}, {20.0}, 15.0, limits);
  EXPECT_EQ(num_inserted_[0], num_sent_[0]);
  EXPECT_EQ(num_inserted_[1], 0);
}

TEST_F(CloudStreams, ASourceThatNeverSpeaksCostsTheOthersNothing) {
  run({{30.0}, {10.0, 0.0, 0.0, 1000.0}}, {50.0, 0.0, 0.3}, 10.0);
  EXPECT_EQ(num_inserted_[0], num_sent_[0]);
}

TEST_F(CloudStreams, ReplayedTenTimesAsFastNoneIsLost) {
  run({{300.0}}, {500.0, 0.0, 0.05}, 5.0, {}, 0.0005);
  EXPECT_EQ(num_inserted_, num_sent_);
}

TEST_F(CloudStreams, ANodeThatIsTooSlowMapsAsManyAsItCan) {
  run({{10.0}}, {50.0}, 20.0, {}, 0.2);
  EXPECT_GT(num_inserted_[0], 90);
  EXPECT_LT(num_inserted_[0], 115);
  EXPECT_EQ(num_inserted_[0] + num_dropped_[std::make_pair(std::size_t{0}, DropReason::kQueueFull)],
            num_sent_[0]);
}

TEST_F(CloudStreams, AMapUnderLoadIsNeverFartherBehindThanTwoClouds) {
  for (const double load : {0.5, 2.0, 10.0}) {
    for (const std::size_t num_sources : {1, 3}) {
      restart();
      const double work_s = 0.1 * load / static_cast<double>(num_sources);
      run(std::vector<Stream>(num_sources, {10.0}), {50.0}, 30.0, {}, work_s);
      // tf has the pose up to 20 ms after a cloud, and time passes in steps of 10 ms.
      const double bound_s = 2.0 * 0.1 + static_cast<double>(num_sources) * work_s + 0.05;
      EXPECT_LT(*std::max_element(lags_s_.begin(), lags_s_.end()), bound_s)
          << load << " times the load";
      EXPECT_EQ(num_inserted_ == num_sent_, load < 1.0);
    }
  }
}

TEST_F(CloudStreams, AFastScannerBesideALateLidarLosesNothing) {
  run({{100.0}, {10.0, 0.0, 0.15}}, {50.0}, 12.0);
  EXPECT_EQ(num_inserted_, num_sent_);
}

TEST_F(CloudStreams, TransformsOnceASecondCostNoCloud) {
  run({{10.0}}, {1.0, 0.0, 0.5}, 20.0, {}, 0.05);
  EXPECT_EQ(num_inserted_, num_sent_);
}

TEST_F(CloudStreams, CloudsBeforeTheFirstTransformAreNamedSo) {
  run({{10.0, 0.0, 0.0, -1.5}}, {50.0}, 5.0);
  EXPECT_EQ((num_dropped_[{0, DropReason::kBeforeTf}]), 5);
  EXPECT_EQ(num_inserted_[0], num_sent_[0] - 5);
}

/// What the first drop says, and that its advice is the cure.
TEST_F(CloudStreams, RaisingTfWaitIsTheCureOfTransformsThatComeTooLate) {
  const Stream late{50.0, 0.0, 12.0};
  run({{10.0}}, late, 20.0);
  EXPECT_EQ(num_inserted_[0], 0);
  ASSERT_FALSE(texts_.empty());
  EXPECT_NE(texts_.back().find("raise tf_wait (now 10 s)"), std::string::npos) << texts_.back();
  restart();
  run({{10.0}}, late, 20.0, {1, 2, 15.0});
  EXPECT_EQ(num_inserted_, num_sent_);
}

TEST_F(CloudStreams, SynchronizingTheClocksIsTheCureOfStampsThatAreAhead) {
  run({{10.0, 60.0}}, {50.0}, 5.0);
  EXPECT_NE(texts_.at(0).find("synchronize the clocks"), std::string::npos) << texts_[0];
  restart();
  run({{10.0, 0.0}}, {50.0}, 5.0);
  EXPECT_EQ(num_inserted_, num_sent_);
}

TEST_F(CloudStreams, ACorrectedClockIsTheCureOfCloudsThatAreTooOldForTf) {
  run({{10.0, -60.0}}, {50.0}, 5.0);
  EXPECT_NE(texts_.at(0).find("check the sensor's clock"), std::string::npos) << texts_[0];
  restart();
  run({{10.0, 0.0}}, {50.0}, 5.0);
  EXPECT_EQ(num_inserted_, num_sent_);
}

TEST_F(CloudStreams, RaisingTfGapIsTheCureOfTransformsThatComeRarely) {
  const Stream rare{1.0 / 1.75};
  run({{10.0}}, rare, 20.0);
  EXPECT_NE(texts_.at(0).find("raise tf_gap"), std::string::npos) << texts_[0];
  restart();
  tf_.setMaxGap(3.0);
  run({{10.0}}, rare, 20.0);
  EXPECT_EQ(num_inserted_, num_sent_);
}

/// The time of a cloud grows with the cube of the range in voxels, as the advice assumes.
TEST_F(CloudStreams, TheAdvisedResolutionIsTheCureOfANodeThatIsTooSlow) {
  const auto work_s = [](double resolution_m) { return 0.6 * std::pow(0.05 / resolution_m, 3.0); };
  run({{10.0}}, {50.0}, 10.0, {}, work_s(0.05));
  EXPECT_NE(texts_.at(0).find("coarser resolution"), std::string::npos) << texts_[0];
  SpeedWatch watch(0.05);
  for (int i = 0; i < 20; ++i) watch.noteReceived(0.1 * i);
  watch.noteInserted(work_s(0.05), 30.0);
  const std::string advice = watch.advice().value_or("");
  const std::size_t at = advice.find("try resolution ");
  ASSERT_NE(at, std::string::npos) << advice;
  restart();
  run({{10.0}}, {50.0}, 10.0, {}, work_s(std::stod(advice.substr(at + 15))));
  EXPECT_EQ(num_inserted_, num_sent_) << advice;
}

}  // namespace
}  // namespace cuboid_mapping_ros
