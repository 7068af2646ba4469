// SPDX-License-Identifier: BSD-3-Clause
// The merging part of a node, alone: one message fails, one robot is silent.
#include "cuboid_mapping/GetObservations.h"
#include "cuboid_mapping/Observation.h"
#include "cuboid_mapping/io/scan_update_codec.h"
#include "cuboid_mapping/ros/fleet/observation_publisher.h"
#include "cuboid_mapping/ros/fleet/robot_merger.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/middleware/service_calls.h"
#include "ros/log_probe.h"
#include "ros/node_probe.h"
#include "ros/parameter_groups.h"

#include <ros/callback_queue.h>

#include <atomic>
#include <chrono>
#include <future>
#include <map>
#include <memory>
#include <new>
#include <thread>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::CuboidMap;
using cuboid_mapping::GetObservations;
using cuboid_mapping::Observation;
using cuboid_mapping::RobotObservation;

/// Observation of a cloud that has passed one brick.
Observation makeObservation(const NodeParameters& parameters, int sequence,
                            const std::string& robot = "/alone") {
  Observation message;
  message.header.frame_id = parameters.frame_id;
  message.header.stamp = ros::Time(100.0 + 0.01 * sequence);
  message.robot = robot;
  message.session = 1;
  message.sequence = static_cast<std::uint64_t>(sequence);
  message.resolution = parameters.map.resolution_m;
  message.hit = parameters.source.sensor_model.hit;
  message.miss = parameters.source.sensor_model.miss;
  message.min = parameters.source.sensor_model.alpha_min;
  message.max = parameters.source.sensor_model.alpha_max;
  cuboid_mapping::ScanUpdate update;
  update.bricks.push_back({{8 * sequence, 0, 0}, {}, cuboid_mapping::BrickMask::all()});
  const std::string bytes = toBytes(update);
  message.data.assign(bytes.begin(), bytes.end());
  return message;
}

/// Callbacks of a merger, called by the test, and its parameters.
class RobotMergerTest : public ::testing::Test {
 protected:
  ros::CallbackQueue callbacks_;
  CallbackGuard guard_;
  GuardedQueue queue_{callbacks_, guard_, "merger"};
  const ros::NodeHandle nh_ = withQueue(ros::NodeHandle(), queue_);
  NodeParameters parameters_;
};

TEST_F(RobotMergerTest, GetsTheParametersOfAFleet) {
  EXPECT_EQ(readInto<MergeParameters>({{"merge/delay", 5.0}}).delay_s, 5.0);
  const auto read =
      readInto<ObservationParameters>({{"observation_rate", 250.0}, {"observation_memory", 100}});
  EXPECT_EQ(read.max_kb_s, 250.0);
  EXPECT_EQ(read.memory_mb, 100);
}

TEST_F(RobotMergerTest, PutsTheOthersIntoTheMapWhenOneFails) {
  parameters_.robots = {"/alone"};
  parameters_.of<MergeParameters>().delay_s = 0.5;
  GuardedMap map(parameters_.map);
  int num_noted = 0;
  const RobotMerger merger(nh_, nh_, parameters_, map,
                           {[] { return false; },
                            [&num_noted](const RobotObservation& /*observation*/, bool) {
                              if (++num_noted == 2) throw std::bad_alloc();
                            }});
  const ros::Publisher publisher =
      ros::NodeHandle().advertise<Observation>("/alone/observations", 10);
  ASSERT_TRUE(waitFor([&] { return publisher.getNumSubscribers() > 0; }));
  EXPECT_TRUE(waitFor([&] {  // roscpp may lose the first ones; repeated ones are left out.
    for (int i = 1; i <= 3; ++i) publisher.publish(makeObservation(parameters_, i));
    callbacks_.callAvailable();
    return num_noted == 3;
  }));
  EXPECT_EQ(guard_.numFailures(), 1U);
  EXPECT_EQ(
      map.read([](const CuboidMap& content, const ros::Time&) { return content.voxels().size(); }),
      3U);
}

TEST_F(RobotMergerTest, NamesTheTopicOfARobotThatIsNotThere) {
  parameters_.robots = {"/mistyped"};
  GuardedMap map(parameters_.map);
  RobotMerger merger(nh_, nh_, parameters_, map, {[] { return false; }, [](const auto&, bool) {}});
  diagnostic_updater::DiagnosticStatusWrapper status;
  merger.fillStatus(status);
  EXPECT_EQ(status.level, diagnostic_msgs::DiagnosticStatus::WARN);
  EXPECT_EQ(status.message.rfind("nobody publishes /mistyped/observations: ", 0), 0U)
      << status.message;
}

TEST_F(RobotMergerTest, NamesTheRobotWhoseClockIsBehind) {
  parameters_.robots = {"/punctual", "/behind"};
  parameters_.of<MergeParameters>().delay_s = 0.02;
  GuardedMap map(parameters_.map);
  RobotMerger merger(nh_, nh_, parameters_, map, {[] { return false; }, [](const auto&, bool) {}});
  std::map<std::string, ros::Publisher> publishers;
  for (const std::string& robot : parameters_.robots) {
    publishers[robot] = ros::NodeHandle().advertise<Observation>(robot + "/observations", 10);
    ASSERT_TRUE(waitFor([&] { return publishers[robot].getNumSubscribers() > 0; }));
  }
  diagnostic_updater::DiagnosticStatusWrapper status;
  int sequence = 1;
  EXPECT_TRUE(waitFor([&] {
    for (const auto& [robot, publisher] : publishers) {
      Observation message = makeObservation(parameters_, sequence, robot);
      if (robot == "/behind") message.header.stamp -= ros::Duration(60.0);
      publisher.publish(message);
    }
    ++sequence;
    callbacks_.callAvailable();
    merger.fillStatus(status);
    return status.message.find("late") != std::string::npos ||
           status.message.find("older") != std::string::npos;
  }));
  EXPECT_EQ(status.message.rfind("observations of /behind are 60 s older than the newest: ", 0), 0U)
      << status.message;
}

TEST_F(RobotMergerTest, NamesEachRobotWhoseObservationsAreRefused) {
  parameters_.robots = {"/coarse", "/elsewhere"};
  GuardedMap map(parameters_.map);
  RobotMerger merger(nh_, nh_, parameters_, map, {[] { return false; }, [](const auto&, bool) {}});
  std::vector<ros::Publisher> publishers;
  LogProbe log;
  for (const std::string& robot : parameters_.robots) {
    publishers.push_back(ros::NodeHandle().advertise<Observation>(robot + "/observations", 10));
    ASSERT_TRUE(waitFor([&] { return publishers.back().getNumSubscribers() > 0; }));
  }
  Observation coarse = makeObservation(parameters_, 1, "/coarse");
  coarse.resolution *= 2.0;
  Observation elsewhere = makeObservation(parameters_, 1, "/elsewhere");
  elsewhere.header.frame_id = "odom";
  diagnostic_updater::DiagnosticStatusWrapper status;
  EXPECT_TRUE(waitFor([&] {
    publishers.front().publish(coarse);
    publishers.back().publish(elsewhere);
    callbacks_.callAvailable();
    merger.fillStatus(status);
    return log.has("of /coarse has a resolution") && log.has("of /elsewhere is in frame") &&
           status.message.find("; observation 1 of /elsewhere") != std::string::npos;
  })) << status.message;
}

/// Robots whose services have taken a request and do not answer.
class SilentRobots {
 public:
  ~SilentRobots() { speak_.set_value(); }

  void add(const std::string& robot) {
    ros::NodeHandle nh = withQueue(ros::NodeHandle(), threads_.queue());
    services_.push_back(nh.advertiseService<GetObservations::Request, GetObservations::Response>(
        robot + "/get_observations", [this, speaks = speak_.get_future().share()](
                                         GetObservations::Request&, GetObservations::Response&) {
          ++num_asked_;
          speaks.wait();
          return true;
        }));
    threads_.start();
  }

  [[nodiscard]] int numAsked() const { return num_asked_; }

 private:
  std::atomic<int> num_asked_{0};
  CallbackGuard guard_;
  GuardedThread threads_{guard_, "silent robots"};
  std::promise<void> speak_;
  std::vector<ros::ServiceServer> services_;
};

TEST(ServiceCallsTest, ACallOfASilentServiceCanBeEnded) {
  SilentRobots silent;
  silent.add("/silent");
  ros::NodeHandle nh;
  ServiceCalls calls;
  std::atomic<bool> has_answer{true};
  std::thread caller([&] {
    GetObservations service;
    has_answer = calls.call(nh, "/silent/get_observations", service);
  });
  ASSERT_TRUE(waitFor([&] { return silent.numAsked() > 0; }));
  calls.stop();
  caller.join();
  EXPECT_FALSE(has_answer);
  GetObservations service;
  EXPECT_FALSE(calls.call(nh, "/silent/get_observations", service)) << "none is made any more";
  EXPECT_EQ(silent.numAsked(), 1);
}

TEST_F(RobotMergerTest, ASilentRobotKeepsNobodyFromAskingTheOthers) {
  auto silent = std::make_unique<SilentRobots>();
  silent->add("/silent");
  CallbackGuard guard;
  GuardedThread thread(guard, "merger");
  GuardedThread asking_threads(guard, "asking", 3);
  ros::NodeHandle nh = withQueue(ros::NodeHandle(), thread.queue());
  NodeParameters parameters;
  parameters.robots = {"/silent", "/talking"};
  std::atomic<int> num_asked{0};
  const auto server = nh.advertiseService<GetObservations::Request, GetObservations::Response>(
      "/talking/get_observations",
      [&](GetObservations::Request& request, GetObservations::Response& response) {
        ++num_asked;
        response.session = request.session;
        return true;
      });
  GuardedMap map(parameters.map);
  RobotMerger merger(nh, withQueue(nh, asking_threads.queue()), parameters, map,
                     {[] { return false; }, [](const RobotObservation&, bool) {}});
  thread.start();
  asking_threads.start();
  std::vector<ros::Publisher> publishers;
  for (const std::string& robot : parameters.robots) {
    publishers.push_back(ros::NodeHandle().advertise<Observation>(robot + "/observations", 10));
  }
  EXPECT_TRUE(waitFor([&] {  // The first observation of each robot is missing.
    for (std::size_t i = 0; i < publishers.size(); ++i) {
      publishers[i].publish(makeObservation(parameters, 2, parameters.robots[i]));
    }
    return num_asked >= 3;
  })) << num_asked;
  merger.stopAsking();  // Otherwise the threads wait for the silent robot.
  thread.stop();
  asking_threads.stop();
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
