// SPDX-License-Identifier: BSD-3-Clause
// A lidar that sees the arm of its robot (arm.urdf), which turns in front of it while the robot drives through a room.
#include "cuboid_mapping/SaveMap.h"
#include "cuboid_mapping/io/map_files.h"
#include "ros/node_probe.h"
#include "simulation/shape.h"
#include "tools/run_program.h"

#include <rosbag/bag.h>
#include <tf2_msgs/TFMessage.h>

#include <cmath>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::MetricBox;
using cuboid_mapping::test::runProgram;
using cuboid_mapping::test::TemporaryFolder;

constexpr double kArmStart_s = 1000.0;
constexpr double kArmDuration_s = 4.0;
constexpr double kRoom_m = 3.0;  ///< Distance from its middle to its walls.

std::string sourceFile(const std::string& name) {
  return std::string(CUBOID_MAPPING_SOURCE_DIR) + "/test/ros/self_filter/" + name;
}

Eigen::Isometry3d turnedAbout(const Eigen::Vector3d& axis, double angle_rad) {
  return Eigen::Isometry3d(Eigen::AngleAxisd(angle_rad, axis));
}

/// Poses of the frames of the robot in arm.urdf.
struct RobotPose {
  explicit RobotPose(double t)
      : T_map_base(Eigen::Translation3d(0.2 * t - 0.4, 0.1 * t, -1.0) *
                   turnedAbout(Eigen::Vector3d::UnitZ(), 0.3 * t)),
        T_base_arm(Eigen::Translation3d(0.6, 0.0, 0.5) *
                   turnedAbout(Eigen::Vector3d::UnitZ(), 2.0 * std::sin(1.5 * t))),
        T_arm_hand(Eigen::Translation3d(0.7, 0.0, 0.5) *
                   turnedAbout(Eigen::Vector3d::UnitX(), 2.5 * t)) {}

  Eigen::Isometry3d T_map_base;
  Eigen::Isometry3d T_base_arm;
  Eigen::Isometry3d T_arm_hand;
};

/// A solid of the robot in the frame of the lidar.
struct PlacedShape {
  cuboid_mapping::Shape shape;
  Eigen::Isometry3d T_lidar_shape;
};

/// Parts of the robot that the lidar can see, from arm.urdf and self_filter.yaml.
std::vector<PlacedShape> visibleParts(const RobotPose& pose) {
  const Eigen::Isometry3d T_lidar_base = makeTranslation(0.0, 0.0, -1.0);
  const Eigen::Isometry3d T_lidar_arm = T_lidar_base * pose.T_base_arm;
  const Eigen::Isometry3d T_lidar_hand = T_lidar_arm * pose.T_arm_hand;
  return {{MetricBox{{-0.5, -0.05, -0.2}, {-0.4, 0.05, 0.6}}, Eigen::Isometry3d::Identity()},
          {MetricBox{{-0.4, -0.3, 0.0}, {0.4, 0.3, 0.5}}, T_lidar_base},
          {cuboid_mapping::Cylinder{{0.0, 0.0}, 0.1, -0.4, 0.4}, T_lidar_arm},
          {MetricBox{{-0.1, -0.06, 0.44}, {0.7, 0.06, 0.56}}, T_lidar_arm},
          {MetricBox{{-0.1, -0.1, -0.15}, {0.1, 0.1, 0.15}},
           T_lidar_hand * makeTranslation(0.2, 0.0, 0.0) *
               turnedAbout(Eigen::Vector3d::UnitZ(), 0.25 * EIGEN_PI)}};
}

double rangeTo(const PlacedShape& placed, const Eigen::Vector3d& direction_lidar) {
  const Eigen::Isometry3d T_shape_lidar = placed.T_lidar_shape.inverse();
  const cuboid_mapping::Beam beam(T_shape_lidar.translation(),
                                  T_shape_lidar.linear() * direction_lidar);
  return cuboid_mapping::computeRange(placed.shape, beam);
}

/// Range to a wall, floor or ceiling of the room.
double rangeOfRoom(const Eigen::Vector3d& origin_map, const Eigen::Vector3d& direction_map) {
  double range_m = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double wall_m = std::copysign(kRoom_m, direction_map[axis]);
    range_m = std::min(range_m, (wall_m - origin_map[axis]) / direction_map[axis]);
  }
  return range_m;
}

/// A drive as a bag; tf is recorded after the clouds.
class ArmDriveWriter {
 public:
  explicit ArmDriveWriter(const std::string& file) : bag_(file, rosbag::bagmode::Write) {
    tf2_msgs::TFMessage frames;
    frames.transforms.push_back(makeTransform("base", "lidar", makeTranslation(0.0, 0.0, 1.0)));
    bag_.write("/tf_static", ros::Time(kArmStart_s - 0.1), frames);
    for (double t = 0.0; t < kArmDuration_s + 0.5; t += 0.02) writePose(t);
    for (double t = 0.0; t < kArmDuration_s; t += 0.1) writeCloud(t);
    bag_.close();
  }

  /// Number of points measured on the robot.
  [[nodiscard]] long numOnRobot() const { return num_on_robot_; }

 private:
  void writePose(double t) {
    const RobotPose pose(t);
    const ros::Time stamp(kArmStart_s + t);
    tf2_msgs::TFMessage frames;
    frames.transforms.push_back(makeTransform("map", "base", pose.T_map_base, stamp));
    frames.transforms.push_back(makeTransform("base", "upper_arm", pose.T_base_arm, stamp));
    frames.transforms.push_back(makeTransform("upper_arm", "hand", pose.T_arm_hand, stamp));
    bag_.write("/tf", stamp + ros::Duration(0.03), frames);
  }

  void writeCloud(double t) {
    const RobotPose pose(t);
    const Eigen::Isometry3d T_map_lidar = pose.T_map_base * Eigen::Translation3d(0.0, 0.0, 1.0);
    const std::vector<PlacedShape> robot = visibleParts(pose);
    std::vector<Eigen::Vector3d> points;
    for (double azimuth = -3.14; azimuth < 3.14; azimuth += 0.02) {
      for (double elevation = -1.2; elevation < 0.6; elevation += 0.05) {
        const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                                        std::cos(elevation) * std::sin(azimuth),
                                        std::sin(elevation));
        double range_m = rangeOfRoom(T_map_lidar.translation(), T_map_lidar.linear() * direction);
        bool is_on_robot = false;
        for (const PlacedShape& part : robot) {
          const double to_part_m = rangeTo(part, direction);
          is_on_robot = is_on_robot || to_part_m < range_m;
          range_m = std::min(range_m, to_part_m);
        }
        num_on_robot_ += is_on_robot ? 1 : 0;
        points.emplace_back(range_m * direction);
      }
    }
    const ros::Time stamp(kArmStart_s + t);
    bag_.write("/cloud_in", stamp + ros::Duration(0.01), makeCloud("lidar", stamp, points));
  }

  long num_on_robot_ = 0;
  rosbag::Bag bag_;
};

/// Number of occupied voxels that do not belong to the room's walls.
std::size_t countTraces(const std::string& map) {
  const auto snapshot = cuboid_mapping::readMapFile(map).snapshot;
  const cuboid_mapping::Grid grid(snapshot.resolution_m);
  std::size_t count = 0;
  for (const auto& brick : snapshot.bricks) {
    forEachCell(brick.brick, brick.voxels.occupied(), [&](const cuboid_mapping::Cell& cell) {
      const Eigen::Vector3d center = grid.centerOf({cell, cell + cuboid_mapping::Cell{1, 1, 1}});
      count += center.cwiseAbs().maxCoeff() < kRoom_m - 0.1 ? 1 : 0;
    });
  }
  return count;
}

class NodeSelfFilterTest : public ::testing::Test {
 protected:
  NodeSelfFilterTest() : drive_(folder_ / "drive.bag") {}

  /// Map of bag_to_map with the node's parameters, and others.
  std::string mapOfBag(const std::string& name, const std::vector<std::string>& settings) {
    std::vector<std::string> command{
        BAG_TO_MAP_PROGRAM, folder_ / "drive.bag",         "-o", folder_ / name,
        "--params",         sourceFile("self_filter.yaml")};
    for (const std::string& setting : settings) {
      command.emplace_back("--set");
      command.push_back(setting);
    }
    const auto end = runProgram(command);
    EXPECT_EQ(end.status, 0) << end.err;
    return folder_ / name;
  }
  std::string mapWithUrdf(const std::string& name) {
    return mapOfBag(name, {"self_filter/robot_description=" + sourceFile("arm.urdf")});
  }

  TemporaryFolder folder_;
  ArmDriveWriter drive_;
};

TEST_F(NodeSelfFilterTest, TheArmLeavesNoTraceInTheMap) {
  const std::string without =
      mapOfBag("without.cuboids", {"self_filter/robot_description=\"\"", "self_filter/boxes=[]"});
  EXPECT_GT(countTraces(without), 200U) << "what there would be";
  EXPECT_EQ(countTraces(mapWithUrdf("with.cuboids")), 0U);
}

TEST_F(NodeSelfFilterTest, BagToMapHasNoParameterServer) {
  const auto end = runProgram({BAG_TO_MAP_PROGRAM, folder_ / "drive.bag", "-o",
                               folder_ / "no.cuboids", "--params", sourceFile("self_filter.yaml")});
  EXPECT_NE(end.status, 0);
  EXPECT_NE(end.err.find("self_filter/robot_description: there is no parameter server here; name a "
                         ".urdf file"),
            std::string::npos)
      << end.err;
}

TEST_F(NodeSelfFilterTest, NodeAndBagToMapMakeTheSameMap) {
  DiagnosticsProbe probe(kNode);
  ASSERT_TRUE(waitFor([&] { return probe.numReports() > 0; }));
  ASSERT_EQ(runProgram({"rosbag", "play", "--quiet", "--clock", "--delay=2", folder_ / "drive.bag"})
                .status,
            0);
  EXPECT_TRUE(waitFor([&] { return probe.status().number("clouds inserted") == 40; }))
      << probe.status().number("clouds inserted") << ' ' << probe.status().message;
  EXPECT_EQ(probe.status().number("clouds dropped"), 0);
  EXPECT_GT(drive_.numOnRobot(), 1000);
  EXPECT_EQ(probe.status().number("points on the robot"), drive_.numOnRobot());
  cuboid_mapping::SaveMap save;
  save.request.filename = folder_ / "node.cuboids";
  ASSERT_TRUE(callService(std::string(kNode) + "/save_map", save));
  ASSERT_TRUE(save.response.info.success) << save.response.info.message;
  EXPECT_TRUE(cuboid_mapping::test::readText(mapWithUrdf("offline.cuboids")) ==
              cuboid_mapping::test::readText(save.request.filename));
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
