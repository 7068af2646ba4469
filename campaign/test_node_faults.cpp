// SPDX-License-Identifier: BSD-3-Clause
// The node's parts without memory: a cloud is in the map or counted as dropped, the map equals that of a plain
// replay, and followers have all of it after the next publish.
#include "fault_campaign.h"
#include "ros/cloud_messages.h"
#include "ros/simulated_node.h"
#include "support/random.h"
#include "support/snapshots.h"

#include <boost/make_shared.hpp>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::Cell;
using cuboid_mapping::FollowResult;
using cuboid_mapping::campaign::Act;
using cuboid_mapping::campaign::expectNothingWrong;
using cuboid_mapping::campaign::FaultKind;
using cuboid_mapping::campaign::Trial;
using cuboid_mapping::test::Random;
using cuboid_mapping::test::voxelsOf;

NodeParameters makeParameters() {
  NodeParameters parameters;
  parameters.map.resolution_m = 0.25;
  parameters.threads = 1;
  return parameters;
}

SensorMessage someCloud(Random& random) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 20; ++i) {
    points.emplace_back(random.real(-6, 6), random.real(-6, 6), random.real(-2, 2));
  }
  CloudSpec spec;
  spec.width = static_cast<std::uint32_t>(points.size());
  auto cloud = boost::make_shared<sensor_msgs::PointCloud2>(makeMessage(spec, points));
  cloud->header.frame_id = "fixed";
  cloud->header.stamp = ros::Time(1000.0);
  return {cloud};
}

/// A node with some clouds in it, and a follower.
struct Scene {
  Scene() : node(makeParameters()) {
    geometry_msgs::TransformStamped transform;
    transform.header.frame_id = "map";
    transform.child_frame_id = "fixed";
    transform.transform.rotation.w = 1.0;
    node.setTransform(transform, true);
    for (int i = 0; i < 3; ++i) insert(someCloud(random));
    (void)node.publish();
    (void)follower.take(node.makeImage());
  }

  void insert(const SensorMessage& cloud) {
    node.receive(cloud);
    work();
  }
  void work() {
    while (node.mapOne()) {
    }
  }
  /// Follows the map as a subscriber does.
  void follow() {
    if (follower.take(node.publish()) == FollowResult::kGap) (void)follower.take(node.makeImage());
  }

  /// Error at the end; empty: none.
  std::string check() {
    const NodeStatistics& statistics = node.statistics();
    if (statistics.numWaiting() != node.numWaiting()) return "a cloud is neither in nor counted";
    return node.map().read([&](const CuboidMap& map, const ros::Time&) -> std::string {
      if (voxelsOf(map) != voxelsOf(node.replay().map())) return "another map than the replay";
      if (follower.map() == nullptr) return "no copy";
      return voxelsOf(*follower.map()) == voxelsOf(map) ? "" : "the follower is apart";
    });
  }

  Random random{21};
  SimulatedNode node;
  MapFollower follower;
};

TEST(NodeFaults, aCloudIsInOrCounted) {
  const Trial trial = [](const Act& act) -> std::string {
    Scene scene;
    const auto cloud = someCloud(scene.random);
    const auto next = someCloud(scene.random);
    act([&] { scene.insert(cloud); });
    scene.work();
    scene.insert(next);
    scene.follow();
    scene.follow();
    return scene.check();
  };
  EXPECT_GT(expectNothingWrong("cloud", FaultKind::kMemory, trial), 0U);
}

TEST(NodeFaults, aPublishThatFailsIsMadeUpFor) {
  const Trial trial = [](const Act& act) -> std::string {
    Scene scene;
    scene.insert(someCloud(scene.random));
    act([&] {
      const MapDelta delta = scene.node.publish();
      (void)scene.follower.take(delta);
    });
    scene.insert(someCloud(scene.random));
    scene.follow();
    scene.follow();
    return scene.check();
  };
  EXPECT_GT(expectNothingWrong("publish", FaultKind::kMemory, trial), 0U);
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
