// SPDX-License-Identifier: BSD-3-Clause
// No exception leaves a callback: tests of the guard, and a search of the sources for unguarded callbacks.
#include "cuboid_mapping/ros/middleware/callback_guard.h"

#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "ros/logged_lines.h"

#include <gtest/gtest.h>
#include <boost/make_shared.hpp>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

TEST(CallbackGuard, CountsWhatFailsAndSaysWhatItWas) {
  CallbackGuard guard;
  EXPECT_TRUE(guard.run("good", [] {}));
  EXPECT_EQ(guard.numFailures(), 0U);
  EXPECT_EQ(guard.lastFailure(), "");
  EXPECT_FALSE(guard.run("timer", [] { throw std::runtime_error("no memory"); }));
  EXPECT_EQ(guard.numFailures(), 1U);
  EXPECT_EQ(guard.lastFailure(), "timer: no memory");
  EXPECT_FALSE(guard.run("timer", [] { throw 7; }));
  EXPECT_EQ(guard.numFailures(), 2U);
}

TEST(CallbackGuard, LogsWhatFailsAgainAndAgainOnce) {
  CallbackGuard guard;
  (void)LoggedLines::take();
  for (int i = 0; i < 5; ++i) guard.noteFailure("timer", "no memory");
  EXPECT_EQ(LoggedLines::take().size(), 1U);
  guard.noteFailure("timer", "no thread");
  const std::vector<std::string> another = LoggedLines::take();
  ASSERT_EQ(another.size(), 1U);
  EXPECT_NE(another[0].find("timer: no thread (6 so far)"), std::string::npos) << another[0];
}

TEST(CallbackGuard, NoExceptionLeavesACallbackOfAGuardedQueue) {
  CallbackGuard guard;
  ros::CallbackQueue callbacks;
  GuardedQueue queue(callbacks, guard, "queue");
  int num_called = 0;
  const int owner = 0;
  post(queue, &owner, [&] {
    ++num_called;
    throw std::runtime_error("first");
  });
  post(queue, &owner, [&] {
    ++num_called;
    throw 7;
  });
  post(queue, &owner, [&] { ++num_called; });
  EXPECT_NO_THROW(callbacks.callAvailable());
  EXPECT_EQ(num_called, 3);
  EXPECT_EQ(guard.numFailures(), 2U);
}

TEST(CallbackGuard, AGuardedQueueTakesBackWhatAnOwnerHasPosted) {
  CallbackGuard guard;
  ros::CallbackQueue callbacks;
  GuardedQueue queue(callbacks, guard, "queue");
  int num_called = 0;
  const int owners[2] = {};
  for (const int& owner : owners) post(queue, &owner, [&] { ++num_called; });
  removePosted(queue, &owners[0]);
  callbacks.callAvailable();
  EXPECT_EQ(num_called, 1);
}

TEST(CallbackGuard, AGuardedQueueAsksACallbackWhetherItIsReady) {
  class NotReady : public ros::CallbackInterface {
   public:
    CallResult call() override {
      ADD_FAILURE() << "it was not ready";
      return Success;
    }
    bool ready() override { return false; }
  };
  CallbackGuard guard;
  ros::CallbackQueue callbacks;
  GuardedQueue queue(callbacks, guard, "queue");
  queue.addCallback(boost::make_shared<NotReady>(), 1);
  EXPECT_EQ(callbacks.callOne(), ros::CallbackQueue::TryAgain);
}

/// Headers and sources of the ROS layer by file name, without comments.
std::map<std::string, std::string> readSources() {
  namespace fs = std::filesystem;
  std::map<std::string, std::string> sources;
  const fs::path root = CUBOID_MAPPING_SOURCE_DIR;
  for (const fs::path& folder :
       {root / "src/cuboid_mapping/ros", root / "include/cuboid_mapping/ros"}) {
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      std::ifstream file(entry.path());
      std::string& text = sources[entry.path().filename().string()];
      for (std::string line; std::getline(file, line);)
        text += line.substr(0, line.find("//")) + '\n';
    }
  }
  return sources;
}

std::set<std::string> filesWith(const std::string& pattern) {
  const std::regex regex(pattern);
  std::set<std::string> files;
  for (const auto& [file, text] : readSources()) {
    if (std::regex_search(text, regex)) files.insert(file);
  }
  return files;
}

using Files = std::set<std::string>;

TEST(CallbackGuard, AllSourcesAreSearched) {
  EXPECT_GT(readSources().size(), 60U);
  EXPECT_EQ(readSources().count("mapping_node.cpp"), 1U);
}

TEST(CallbackGuard, OnlyGuardedQueuesAreGivenToNodeHandles) {
  EXPECT_EQ(filesWith(R"(setCallbackQueue)"), Files{"callback_guard.cpp"});
  EXPECT_EQ(filesWith(R"(callback_queue *=)"), Files{}) << "in subscribe or advertise options";
  EXPECT_EQ(filesWith(R"(getNodeHandle|getPrivateNodeHandle|getMT)"), Files{"mapping_nodelet.cpp"})
      << "MappingNode gives it a GuardedQueue at once";
}

TEST(CallbackGuard, NodeHandlesAreMadeOfOthersOnly) {
  // A handle made from a name would use roscpp's own queue; the client's default argument gets the queue of
  // its thread.
  EXPECT_EQ(filesWith(R"(ros::NodeHandle(\(\)|\("|\{"|\{\}| \w+\("))"),
            Files{"cuboid_map_client.h"});
}

/// Wall time jumps, for example when a robot without a battery for its clock gets the time of the network.
TEST(CallbackGuard, NoIntervalIsMeasuredInWallTime) {
  Files files = filesWith("WallTime::now");
  for (const char* has_session : {"guarded_map.h", "observation_publisher.cpp"}) {
    files.erase(has_session);
  }
  EXPECT_EQ(files, Files{});
}

TEST(CallbackGuard, ThreadsAreGuarded) {
  EXPECT_EQ(filesWith(R"(AsyncSpinner|MultiThreadedSpinner)"), Files{"callback_guard.h"});
  EXPECT_EQ(
      filesWith(R"(std::thread [a-z]|std::thread\(|std::async|boost::thread)"),
      (Files{"cloud_mapper.cpp", "cloud_mapper.h", "mapping_nodelet.cpp", "mapping_nodelet.h"}))
      << "CloudMapper::mapClouds() guards each cloud";
  EXPECT_EQ(filesWith(R"(ros::spin\b)"), Files{"mapping_node_main.cpp"});
}

}  // namespace
}  // namespace cuboid_mapping_ros
