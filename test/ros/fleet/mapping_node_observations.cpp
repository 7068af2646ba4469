// SPDX-License-Identifier: BSD-3-Clause
// The running node: observations of each cloud, for maps made elsewhere.
#include "cuboid_mapping/Observation.h"
#include "cuboid_mapping/SaveMap.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/io/scan_update_codec.h"
#include "ros/node_probe.h"
#include "support/snapshots.h"
#include "tools/run_program.h"

#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::CuboidMap;
using cuboid_mapping::MapConfig;
using cuboid_mapping::MapFile;
using cuboid_mapping::Observation;
using cuboid_mapping::SaveMap;
using cuboid_mapping::test::TemporaryFolder;
using cuboid_mapping::test::voxelsOf;

class NodeObservationsTest : public NodeTest {
 protected:
  void SetUp() override {
    publishStaticTf(makeTransform("map", "lidar", makeTranslation(0.05, 0.05, 0.05)));
    NodeTest::SetUp();
  }

  void listen() {
    const boost::function<void(const Observation::ConstPtr&)> take =
        [this](const Observation::ConstPtr& message) { observations_.push_back(*message); };
    subscriber_ = nh_.subscribe("/observations", 100, take);
    ASSERT_TRUE(waitFor([this] { return subscriber_.getNumPublishers() > 0; }));
    ros::WallDuration(0.5).sleep();  // Lets the node connect, too.
  }

  std::vector<Observation> observations_;
  ros::Subscriber subscriber_;
};

TEST_F(NodeObservationsTest, GiveTheMapOfTheNodeElsewhere) {
  listen();
  publishTf(makeTransform("map", "mover", makeTranslation(1.05, 0.25, 0.05), ros::Time(100.0)));
  publishRoom("lidar");
  publishRoom("mover");
  publishRoom("lidar", ros::Time(101.0));
  ASSERT_TRUE(waitForInserted(3));
  ASSERT_TRUE(waitFor([this] { return observations_.size() == 3; }));

  MapConfig config;
  config.resolution_m = kResolution_m;
  CuboidMap elsewhere(config);
  for (const Observation& observation : observations_) {
    const std::string bytes(observation.data.begin(), observation.data.end());
    const auto update = cuboid_mapping::scanUpdateOfBytes(bytes);
    ASSERT_TRUE(update);
    elsewhere.apply(*update);
    EXPECT_EQ(observation.header.frame_id, "map");
    EXPECT_EQ(observation.robot, kNode);
    EXPECT_EQ(observation.session, observations_.front().session);
    EXPECT_EQ(observation.resolution, kResolution_m);
    EXPECT_EQ(observation.hit, config.sensor_model.hit);
    EXPECT_EQ(observation.miss, config.sensor_model.miss);
    EXPECT_EQ(observation.min, config.sensor_model.alpha_min);
    EXPECT_EQ(observation.max, config.sensor_model.alpha_max);
  }
  EXPECT_EQ(observations_.back().sequence, observations_.front().sequence + 2);
  EXPECT_EQ(observations_.back().header.stamp, ros::Time(101.0));
  EXPECT_DOUBLE_EQ(observations_.back().origin.x, 0.05);

  const TemporaryFolder folder;
  SaveMap save;
  save.request.filename = folder / "map.cuboids";
  ASSERT_TRUE(callService(std::string(kNode) + "/save_map", save));
  const MapFile file = cuboid_mapping::readMapFile(save.request.filename);
  EXPECT_GT(voxelsOf(elsewhere).size(), 1000U);
  EXPECT_EQ(voxelsOf(elsewhere), voxelsOf(file.snapshot.bricks));
}

TEST_F(NodeObservationsTest, CloudsAreCountedWhileNobodyListens) {
  listen();
  publishRoom("lidar");
  ASSERT_TRUE(waitFor([this] { return observations_.size() == 1; }));
  subscriber_.shutdown();
  ros::WallDuration(0.5).sleep();
  publishRoom("lidar", ros::Time(101.0));
  ASSERT_TRUE(waitForInserted(2));
  listen();
  publishRoom("lidar", ros::Time(102.0));
  ASSERT_TRUE(waitFor([this] { return observations_.size() == 2; }));
  EXPECT_EQ(observations_.back().sequence, observations_.front().sequence + 2) << "one is missing";
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
