// SPDX-License-Identifier: BSD-3-Clause
// A box stands in a room for one cloud: the node publishes its points as moving, and leaves them out of the map; so does
// bag_to_map, which can also free the place if the room was seen without the box only later.
#include "cuboid_mapping/SaveMap.h"
#include "cuboid_mapping/io/map_files.h"
#include "ros/node_probe.h"
#include "tools/run_program.h"

#include <rosbag/bag.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::Occupancy;
using cuboid_mapping::test::runProgram;
using cuboid_mapping::test::TemporaryFolder;

/// Points of the box's near face, 1 m in front of the lidar, two for each edge of a voxel.
std::vector<Eigen::Vector3d> makeBox() {
  std::vector<Eigen::Vector3d> points;
  for (double y = -0.275; y < 0.3; y += 0.05) {
    for (double z = -0.275; z < 0.3; z += 0.05) points.emplace_back(1.05, y, z);
  }
  return points;
}

/// A voxel of its near face.
const Eigen::Vector3d kInBox(1.05, 0.05, 0.05);
const Eigen::Vector3d kInWall(2.05, 0.05, 0.05);

Occupancy classOf(const std::string& map, const Eigen::Vector3d& point) {
  const auto snapshot = cuboid_mapping::readMapFile(map).snapshot;
  const cuboid_mapping::Cell cell = *cuboid_mapping::Grid(snapshot.resolution_m).toCell(point);
  for (const auto& brick : snapshot.bricks) {
    if (brick.brick != cuboid_mapping::brickOf(cell)) continue;
    const int voxel = voxelIndex(cell);
    if (brick.voxels.occupied().test(voxel)) return Occupancy::kOccupied;
    if (brick.voxels.free().test(voxel)) return Occupancy::kFree;
  }
  return Occupancy::kUnknown;
}

class NodeMovingPointsTest : public NodeTest {
 protected:
  /// A bag of clouds, one per second, whose sensor is at the origin of the map.
  std::string writeBag(const std::vector<std::vector<Eigen::Vector3d>>& clouds) {
    const std::string file = folder_ / "clouds.bag";
    rosbag::Bag bag(file, rosbag::bagmode::Write);
    tf2_msgs::TFMessage frames;
    frames.transforms.push_back(makeTransform("map", "lidar", Eigen::Isometry3d::Identity()));
    bag.write("/tf_static", ros::Time(99.0), frames);
    for (std::size_t i = 0; i < clouds.size(); ++i) {
      const ros::Time stamp(100.0 + static_cast<double>(i));
      bag.write("/cloud_in", stamp, makeCloud("lidar", stamp, clouds[i]));
    }
    bag.close();
    return file;
  }

  std::string mapOfBag(const std::string& bag, const std::vector<std::string>& options) {
    std::vector<std::string> command{
        BAG_TO_MAP_PROGRAM,
        bag,
        "-o",
        folder_ / "bag.cuboids",
        "--params",
        std::string(CUBOID_MAPPING_SOURCE_DIR) + "/test/ros/moving_points/moving_points.yaml"};
    command.insert(command.end(), options.begin(), options.end());
    const auto end = runProgram(command);
    EXPECT_EQ(end.status, 0) << end.err;
    output_ = end.out;
    return folder_ / "bag.cuboids";
  }

  TemporaryFolder folder_;
  std::string output_;  ///< Output of bag_to_map.
};

TEST_F(NodeMovingPointsTest, AreSaidAndLeftOutByTheNodeAndByBagToMap) {
  std::vector<sensor_msgs::PointCloud2> received;
  const boost::function<void(const sensor_msgs::PointCloud2::ConstPtr&)> receive =
      [&](const sensor_msgs::PointCloud2::ConstPtr& cloud) { received.push_back(*cloud); };
  const ros::Subscriber subscriber = nh_.subscribe("/moving_points", 10, receive);
  ASSERT_TRUE(waitFor([&] { return subscriber.getNumPublishers() > 0; }));
  publishStaticTf(makeTransform("map", "lidar", Eigen::Isometry3d::Identity()));
  ros::WallDuration(0.5).sleep();  // Lets the other side connect, too.
  publishRoom("lidar", ros::Time(100.0));
  cloud_publisher_.publish(makeCloud("lidar", ros::Time(101.0), makeBox()));
  ASSERT_TRUE(waitForInserted(2));
  ASSERT_TRUE(waitFor([&] { return received.size() == 2; }));
  EXPECT_EQ(received[0].width * received[0].height, 0U) << "of the first cloud nothing is known";
  EXPECT_EQ(received[1].width * received[1].height, makeBox().size());
  EXPECT_EQ(received[1].header.frame_id, "map");
  EXPECT_EQ(received[1].header.stamp, ros::Time(101.0));

  cuboid_mapping::SaveMap save;
  save.request.filename = folder_ / "node.cuboids";
  ASSERT_TRUE(callService(std::string(kNode) + "/save_map", save));
  ASSERT_TRUE(save.response.info.success) << save.response.info.message;
  EXPECT_EQ(classOf(save.request.filename, kInBox), Occupancy::kFree);
  EXPECT_EQ(classOf(save.request.filename, kInWall), Occupancy::kOccupied);
  const std::string map = mapOfBag(writeBag({makeRoom({2.0, 2.0, 1.0}), makeBox()}), {});
  EXPECT_TRUE(cuboid_mapping::test::readText(map) ==
              cuboid_mapping::test::readText(save.request.filename));
}

TEST_F(NodeMovingPointsTest, AreFreedAfterTheDriveWhereThePlaceWasSeenEmptyLater) {
  const std::string bag = writeBag({makeBox(), makeBox(), makeRoom({2.0, 2.0, 1.0})});
  EXPECT_EQ(classOf(mapOfBag(bag, {}), kInBox), Occupancy::kOccupied);
  for (const char* moving_points : {"moving_points=ignore", "moving_points=leave_out"}) {
    const std::string map = mapOfBag(bag, {"--free-passed", "--set", moving_points});
    EXPECT_EQ(classOf(map, kInBox), Occupancy::kFree);
    EXPECT_EQ(classOf(map, kInWall), Occupancy::kOccupied);
    EXPECT_NE(output_.find("36 occupied voxels of passed objects freed"), std::string::npos)
        << output_;
  }
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
