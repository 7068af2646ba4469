// SPDX-License-Identifier: BSD-3-Clause
// Whichever allocation fails: every cloud is handed on once, or dropped and counted once.
#include "cuboid_mapping/ros/clouds/cloud_inbox.h"
#include "cuboid_mapping/ros/clouds/cloud_queue.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"

#include <gtest/gtest.h>
#include <ros/callback_queue.h>
#include <boost/make_shared.hpp>

#include <cstdlib>
#include <new>
#include <string>
#include <vector>

namespace {

/// Allocations of this thread until one fails; negative: none does.
thread_local long allocations_left = -1;

void* allocate(std::size_t size) {
  if (allocations_left >= 0 && allocations_left-- == 0) throw std::bad_alloc();
  void* memory = std::malloc(size == 0 ? 1 : size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

/// While it lives, the allocation after so many others fails, once.
class FailingAllocation {
 public:
  explicit FailingAllocation(long number) { allocations_left = number; }
  ~FailingAllocation() { allocations_left = -1; }
  FailingAllocation(const FailingAllocation&) = delete;
  FailingAllocation& operator=(const FailingAllocation&) = delete;
  [[nodiscard]] static bool hasFailed() { return allocations_left < 0; }
};

}  // namespace

void* operator new(std::size_t size) { return allocate(size); }
void* operator new[](std::size_t size) { return allocate(size); }
void* operator new(std::size_t size, const std::nothrow_t& /*tag*/) noexcept {
  try {
    return allocate(size);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t /*size*/) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t /*size*/) noexcept { std::free(memory); }

namespace cuboid_mapping_ros {
namespace {

SensorMessage makeCloud(const std::string& frame_id) {
  const auto cloud = boost::make_shared<sensor_msgs::PointCloud2>();
  cloud->header.frame_id = frame_id;
  return {cloud};
}

/// What has become of clouds.
struct Counts {
  int handled = 0;
  int dropped = 0;
  [[nodiscard]] int total() const { return handled + dropped; }
};

/// Lets the first, the second, the third allocation fail, until none does any more.
/// @param trial  (long number) -> whether an allocation has failed. @return How often it was called.
template <typename TrialT>
int tryEachAllocation(const TrialT& trial) {
  int num_trials = 1;
  for (long number = 0; trial(number); ++number) ++num_trials;
  return num_trials;
}

/// Four clouds come to a queue with room for one that waits for tf and one that waits for its turn.
TEST(CloudFaults, LeaveNoCloudOfAQueueUncountedNorCountedTwice) {
  const int num_cases = tryEachAllocation([](long number) {
    bool has_failed = false;
    Counts counts;
    CloudQueue::Callbacks counting;
    counting.find_poses = [](const SensorMessage& cloud) -> PoseSearch {
      const std_msgs::Header& header = cloud.header();
      if (header.frame_id == "lidar") return {CloudPoses{}, {}, false};
      return {std::nullopt, "a reason that does not fit into a string without an allocation",
              header.frame_id == "old"};
    };
    counting.handle = [&](const SensorMessage&, const CloudPoses&) { ++counts.handled; };
    counting.drop = [&](std::size_t, DropReason, const std::string&) { ++counts.dropped; };
    ros::CallbackQueue callbacks;
    CallbackGuard guard;
    GuardedQueue guarded(callbacks, guard, "clouds");
    CloudQueue queue(guarded, {1, 100000, ros::Duration(10.0)}, counting);
    const ros::Time now(1000.0);
    const std::vector<SensorMessage> clouds{makeCloud("lidar"),  makeCloud("old"),
                                            makeCloud("camera"), makeCloud("camera"),
                                            makeCloud("lidar"),  makeCloud("")};
    {
      const FailingAllocation failing(number);
      for (const auto& cloud : clouds) {
        // As MappingNode: what push() throws is counted.
        if (!guard.run("push", [&] { queue.push(cloud, now); })) ++counts.dropped;
      }
      // roscpp itself may fail, and keeps its callbacks then.
      guard.run("calls", [&] { callbacks.callAvailable(); });
      has_failed = FailingAllocation::hasFailed();
    }
    queue.update(now);
    queue.update(now + ros::Duration(20.0));  // The one that waits for tf gives up.
    callbacks.callAvailable();
    EXPECT_EQ(queue.size(), 0U) << "allocation " << number;
    EXPECT_EQ(counts.total(), 6) << "allocation " << number;
    return has_failed;
  });
  EXPECT_GT(num_cases, 10);
}

TEST(CloudFaults, LeaveNoCloudOfAnInboxUncountedNorCountedTwice) {
  const int num_cases = tryEachAllocation([](long number) {
    bool has_failed = false;
    Counts counts;
    ros::CallbackQueue callbacks;
    CallbackGuard guard;
    GuardedQueue guarded(callbacks, guard, "clouds");
    CloudInbox inbox(
        guarded, {2, 100000, ros::Duration(10.0)},
        {[&](const SensorMessage&) { ++counts.handled; },
         [&](std::size_t, std::size_t count) { counts.dropped += static_cast<int>(count); }});
    const auto cloud = makeCloud("lidar");
    {
      const FailingAllocation failing(number);
      for (int i = 0; i < 3; ++i) guard.run("put", [&] { inbox.put(cloud); });
      // roscpp itself may fail, and keeps its callbacks then.
      guard.run("calls", [&] { callbacks.callAvailable(); });
      has_failed = FailingAllocation::hasFailed();
    }
    inbox.put(cloud);
    callbacks.callAvailable();
    EXPECT_EQ(counts.total(), 4) << "allocation " << number;
    return has_failed;
  });
  EXPECT_GT(num_cases, 2);
}

}  // namespace
}  // namespace cuboid_mapping_ros
