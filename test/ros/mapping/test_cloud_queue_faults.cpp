// SPDX-License-Identifier: BSD-3-Clause
// Fails each allocation: every cloud is handed on once, or dropped and counted once.
#include "cuboid_mapping/ros/mapping/cloud_queue.h"
#include "support/failing_allocation.h"

#include <gtest/gtest.h>
#include <boost/make_shared.hpp>

#include <string>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::test::FailingAllocation;

SensorMessage makeCloud(const std::string& frame_id) {
  const auto cloud = boost::make_shared<sensor_msgs::PointCloud2>();
  cloud->header.frame_id = frame_id;
  return {cloud};
}

/// Outcomes of clouds.
struct Counts {
  int handled = 0;
  int dropped = 0;
  [[nodiscard]] int total() const { return handled + dropped; }
};

/// Fails the first, the second, the third allocation, until none is left.
/// @param trial  (long number) -> whether an allocation has failed. @return Number of its calls.
template <typename TrialT>
int tryEachAllocation(const TrialT& trial) {
  int num_trials = 1;
  for (long number = 0; trial(number); ++number) ++num_trials;
  return num_trials;
}

/// Clouds in a queue: some have poses, one waits for tf, one came before it, one has no frame.
TEST(CloudFaults, LeaveNoCloudUncountedNorCountedTwice) {
  const int num_cases = tryEachAllocation([](long number) {
    bool has_failed = false;
    Counts counts;
    ros::Time now(1000.0);
    CloudQueue::Callbacks callbacks;
    callbacks.find_poses = [](const SensorMessage& cloud, const Slices&) {
      PoseSearch search;
      const std::string& frame_id = cloud.header().frame_id;
      if (frame_id == "lidar") {
        search.poses = CloudPoses{};
      } else {
        search.why = "a reason that does not fit into a string without an allocation";
        if (frame_id == "old") search.hopeless = DropReason::kBeforeTf;
      }
      return search;
    };
    callbacks.drop = [&](std::size_t, DropReason, const std::string&) { ++counts.dropped; };
    callbacks.now = [&now] { return now; };
    CloudQueue queue({}, callbacks);
    const std::vector<SensorMessage> clouds{makeCloud("lidar"),  makeCloud("old"),
                                            makeCloud("camera"), makeCloud("camera"),
                                            makeCloud("lidar"),  makeCloud("")};
    {
      const FailingAllocation failing(number);
      for (const auto& cloud : clouds) queue.put(cloud);
      while (queue.takeNext()) ++counts.handled;
      has_failed = FailingAllocation::hasFailed();
    }
    while (queue.takeNext()) ++counts.handled;
    now += ros::Duration(20.0);  // The cloud that waits for tf gives up.
    while (queue.takeNext()) ++counts.handled;
    EXPECT_EQ(queue.size(), 0U) << "allocation " << number;
    EXPECT_EQ(counts.total(), 6) << "allocation " << number;
    return has_failed;
  });
  EXPECT_GT(num_cases, 10);
}

}  // namespace
}  // namespace cuboid_mapping_ros
