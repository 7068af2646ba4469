// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/diagnostics/cloud_ledger.h"

#include <gtest/gtest.h>

#include <string>

namespace cuboid_mapping_ros {
namespace {

/// A watch after this number of clouds of a sensor.
SpeedWatch makeWatch(double resolution_m, double duration_s, double rate_hz, double reach_m,
                     std::size_t num_clouds = 20) {
  SpeedWatch watch(resolution_m);
  for (std::size_t i = 0; i < num_clouds; ++i) {
    watch.noteReceived(100.0 + static_cast<double>(i) / rate_hz);
    watch.noteInserted(duration_s, reach_m);
  }
  return watch;
}

/// They enter the map whatever max_rate says, which is of clouds.
TEST(CloudLedger, IgnoresNoObservationOfRobots) {
  ros::Time::init();
  NodeParameters parameters;
  parameters.source.max_rate_hz = 1.0;
  std_msgs::Header header;
  header.stamp = ros::Time(100.0);
  for (const bool has_robots : {false, true}) {
    if (has_robots) parameters.robots = {"/robot1"};
    CloudLedger ledger(parameters);
    EXPECT_TRUE(ledger.noteReceived(0, header));
    EXPECT_EQ(ledger.noteReceived(0, header), has_robots);
  }
}

TEST(SpeedAdvice, SaysWhatWouldKeepUp) {
  EXPECT_EQ(makeWatch(0.05, 4.3, 10.0, 100.0).advice(),
            "4.3 s per cloud at 10 Hz: try resolution 0.2 or sensor_model/max_range 30");
  EXPECT_EQ(makeWatch(0.05, 0.25, 10.0, 6.0).advice(),
            "250 ms per cloud at 10 Hz: try resolution 0.1");
}

TEST(SpeedAdvice, IsSilentWhileTheNodeKeepsUp) {
  EXPECT_FALSE(makeWatch(0.05, 0.09, 10.0, 100.0).advice());
  EXPECT_FALSE(makeWatch(0.05, 4.3, 10.0, 100.0, 2).advice()) << "too early to know the rate";
}

TEST(SpeedAdvice, AlwaysSuggestsLessThanIsInUse) {
  for (const double resolution_m : {0.02, 0.05, 0.1, 0.2, 0.25, 0.5}) {
    for (const double duration_s : {0.101, 0.2, 1.0, 10.0}) {
      for (const double reach_m : {3.0, 5.0, 30.0}) {
        const auto advice = makeWatch(resolution_m, duration_s, 10.0, reach_m).advice();
        ASSERT_TRUE(advice);
        const auto suggested = [&](const std::string& name, double otherwise) {
          const std::size_t at = advice->find(name);
          return at == std::string::npos ? otherwise : std::stod(advice->substr(at + name.size()));
        };
        EXPECT_GT(suggested("resolution ", 10.0), resolution_m) << *advice;
        EXPECT_LT(suggested("max_range ", 0.0), reach_m) << *advice;
      }
    }
  }
}

TEST(SpeedAdvice, TheRateOutlivesLostCloudsAndARecordingThatStartsAgain) {
  SpeedWatch watch(0.1);
  for (const double stamp_s : {5.0, 5.1, 5.2, 6.2, 6.3, 6.4, 6.5}) watch.noteReceived(stamp_s);
  ASSERT_TRUE(watch.rateHz());
  EXPECT_NEAR(*watch.rateHz(), 10.0, 1e-6);
  for (const double stamp_s : {5.0, 5.1, 5.2, 5.3}) watch.noteReceived(stamp_s);
  EXPECT_NEAR(watch.rateHz().value_or(0.0), 10.0, 1e-6);
}

TEST(SpeedAdvice, AWrongStampDoesNotCostTheRate) {
  for (const double wrong_s : {48.0, -48.0, -1.6e9}) {
    for (const int at : {0, 2, 7}) {
      SpeedWatch watch(0.1);
      for (int i = 0; i < 9; ++i) {
        watch.noteReceived(1.6e9 + 0.1 * i + (i == at ? wrong_s : 0.0));
        if (i < 4) continue;
        EXPECT_NEAR(watch.rateHz().value_or(0.0), 10.0, 2.6)
            << wrong_s << " at " << at << ", " << i;
      }
    }
  }
}

TEST(SpeedAdvice, SourcesHaveTheirOwnRatesAndOneLoad) {
  SpeedWatch watch(0.05, 100.0, 2);
  for (int i = 0; i < 30; ++i) {
    for (const std::size_t source : {0, 1}) {
      watch.noteReceived(100.0 + 0.1 * i + 3e-4 * static_cast<double>(source), source);
      watch.noteInserted(0.02, 10.0, source);
    }
  }
  EXPECT_NEAR(watch.rateHz(0).value_or(0.0), 10.0, 1e-6);
  EXPECT_NEAR(watch.rateHz(1).value_or(0.0), 10.0, 1e-6);
  EXPECT_FALSE(watch.advice()) << "20 clouds of 20 ms a second";
  for (int i = 0; i < 30; ++i) watch.noteInserted(0.2, 10.0, 1);
  EXPECT_TRUE(watch.advice());
}

TEST(SpeedAdvice, SensorsOnOneTopicHaveTheRateOfAll) {
  for (const int num_sensors : {2, 3, 4, 5, 6}) {
    SpeedWatch watch(0.05);
    for (int i = 0; i < 30; ++i) {
      for (int sensor = 0; sensor < num_sensors; ++sensor) {
        watch.noteReceived(100.0 + 0.1 * i + 1e-4 * sensor);
        watch.noteInserted(0.01, 10.0);
        EXPECT_FALSE(watch.advice()) << "at most 60 clouds of 10 ms a second";
      }
    }
    EXPECT_NEAR(watch.rateHz().value_or(0.0), 10.0 * num_sensors, 3.0 * num_sensors);
  }
}

TEST(SpeedAdvice, SuggestsParametersForASensorThatReachesFar) {
  EXPECT_EQ(makeWatch(0.05, 0.02, 10.0, 78.0).suggestion(),
            "the clouds reach 78 m; a good start for such a sensor: resolution 0.2 (now 0.05) and "
            "sensor_model/max_range 50 (now without limit)");
  EXPECT_EQ(makeWatch(0.05, 0.02, 10.0, 1234.0)
                .suggestion()
                .value_or("")
                .find("the clouds reach 1234 m; "),
            0U);
  EXPECT_FALSE(makeWatch(0.05, 0.02, 10.0, 78.0, SpeedWatch::kFirstClouds - 1).suggestion());
  EXPECT_FALSE(makeWatch(0.05, 0.005, 10.0, 78.0).suggestion()) << "is cheap as it is";
  EXPECT_FALSE(makeWatch(0.05, 0.02, 10.0, 12.0).suggestion()) << "indoors";
  EXPECT_FALSE(makeWatch(0.2, 0.02, 10.0, 40.0).suggestion()) << "is what it would suggest";
}

TEST(Silence, OfASourceDoesNotGrowWhileABagIsPaused) {
  ros::Time::init();
  CloudLedger ledger{NodeParameters()};
  ros::Time::setNow(ros::Time(1000.0));
  EXPECT_TRUE(ledger.noteReceived(0, {}));
  CloudLedger::Source source = ledger.figures().sources.at(0);
  source.last_received -= std::chrono::seconds(20);
  EXPECT_EQ(silenceOf(source, 1), 0.0);
  EXPECT_GE(silenceOf(source, 0), 20.0) << "the player has ended";
  ros::Time::setNow(ros::Time(1006.0));
  EXPECT_EQ(silenceOf(source, 1), 6.0);
  ros::Time::init();
  EXPECT_GE(silenceOf(source, 1), 20.0) << "a sensor";
}

}  // namespace
}  // namespace cuboid_mapping_ros
