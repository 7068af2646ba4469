// SPDX-License-Identifier: BSD-3-Clause
// The running node: clouds go in, markers come out.
#include "cuboid_mapping/GetCuboids.h"
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "ros/marker_picture.h"
#include "ros/node_probe.h"

#include <visualization_msgs/MarkerArray.h>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::CuboidMap;
using cuboid_mapping::GetCuboids;
using cuboid_mapping::MapConfig;
using visualization_msgs::MarkerArray;

/// A viewer of a topic of markers.
class Viewer {
 public:
  explicit Viewer(const std::string& topic) {
    const boost::function<void(const MarkerArray::ConstPtr&)> callback =
        [this](const MarkerArray::ConstPtr& array) {
          picture_.apply(*array);
          ++num_messages_;
          if (!array->markers.empty()) header_ = array->markers.back().header;
        };
    subscriber_ = nh_.subscribe(topic, 100, callback);
  }

  [[nodiscard]] const MarkerViewer& picture() const { return picture_; }
  [[nodiscard]] const std_msgs::Header& header() const { return header_; }
  [[nodiscard]] int numMessages() const { return num_messages_; }

  bool waitForCubes(const std::vector<ShownCube>& cubes) {
    // Sorting them all is slow, so it is done only after a message.
    int num_seen = -1;
    return waitFor([&] {
      if (num_seen == num_messages_) return false;
      num_seen = num_messages_;
      return withoutColors(picture_.cubes()) == cubes;
    });
  }

 private:
  ros::NodeHandle nh_;
  MarkerViewer picture_;
  std_msgs::Header header_;
  int num_messages_ = 0;
  ros::Subscriber subscriber_;
};

/// A viewer of a topic of markers in its own process: roscpp has one connection for
/// all subscribers of a process, and only a new connection makes a new subscriber.
class RemoteViewer {
 public:
  /// @param num_messages  Number of messages after which it ends.
  RemoteViewer(const std::string& topic, int num_messages)
      : pipe_(
            popen((programPath() + " --view " + topic + ' ' + std::to_string(num_messages)).c_str(),
                  "r")) {}
  ~RemoteViewer() {
    if (pipe_ != nullptr) pclose(pipe_);
  }
  RemoteViewer(const RemoteViewer&) = delete;
  RemoteViewer& operator=(const RemoteViewer&) = delete;

  /// Picture on its screen after the next message, one line for each cube.
  std::string nextPicture() {
    std::string picture;
    std::array<char, 1024> line;
    while (pipe_ != nullptr && fgets(line.data(), line.size(), pipe_) != nullptr) {
      if (std::string(line.data()) == kEndOfPicture) return picture;
      picture += line.data();
    }
    return "no message";
  }

  /// The lines of these cubes.
  static std::string toText(const std::vector<ShownCube>& cubes) {
    std::ostringstream text;
    for (const ShownCube& cube : cubes) text << cube << '\n';
    return text.str();
  }

  /// The work of the process: prints the picture after each message.
  static int run(const std::string& topic, int num_messages) {
    Viewer viewer(topic);
    for (int count = 1; count <= num_messages; ++count) {
      if (!waitFor([&] { return viewer.numMessages() >= count; })) return EXIT_FAILURE;
      std::cout << toText(withoutColors(viewer.picture().cubes())) << kEndOfPicture << std::flush;
    }
    return EXIT_SUCCESS;
  }

 private:
  static constexpr char kEndOfPicture[] = "end of picture\n";

  static std::string programPath() {
    std::array<char, 4096> path{};
    const ssize_t size = readlink("/proc/self/exe", path.data(), path.size() - 1);
    return {path.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0))};
  }

  FILE* pipe_;
};

/// The expected map of the node.
class ExpectedMap {
 public:
  ExpectedMap() : map_(makeConfig()), updater_(map_.grid()) {}

  void insertRoom(const Eigen::Vector3d& origin_map) {
    std::vector<Eigen::Vector3f> points;
    for (const Eigen::Vector3d& point : makeRoom({2.0, 2.0, 1.0})) {
      points.push_back(point.cast<float>());
    }
    const Eigen::Isometry3d T_map_cloud{Eigen::Translation3d(origin_map)};
    map_.apply(updater_.compute(cuboid_mapping::makeScan(T_map_cloud, origin_map, points)));
  }

  [[nodiscard]] std::vector<ShownCube> occupied() const {
    return withoutColors(expectedCubes(map_, map_.grid(), MarkerStyle()));
  }
  [[nodiscard]] std::vector<ShownCube> free() const {
    return withoutColors(expectedCubes(map_, map_.grid(), {CuboidFilter::kFree}));
  }

 private:
  static MapConfig makeConfig() {
    MapConfig config;
    config.resolution_m = kResolution_m;
    return config;
  }

  CuboidMap map_;
  cuboid_mapping::ScanUpdater updater_;
};

class NodeMarkersTest : public NodeTest {
 protected:
  void SetUp() override {
    publishStaticTf(makeTransform("map", "lidar_a", makeTranslation(0.05, 0.05, 0.05)));
    publishStaticTf(makeTransform("map", "lidar_b", makeTranslation(1.05, -0.45, 0.55)));
    NodeTest::SetUp();
  }
};

TEST_F(NodeMarkersTest, TheyShowTheMapAndFollowItsChanges) {
  Viewer occupied("/occupied_cuboids");
  Viewer free("/free_cuboids");
  ExpectedMap expected;
  EXPECT_TRUE(expected.occupied().empty());

  publishRoom("lidar_a", ros::Time(100.5));
  expected.insertRoom({0.05, 0.05, 0.05});
  EXPECT_GT(expected.occupied().size(), 100U);
  EXPECT_TRUE(occupied.waitForCubes(expected.occupied()));
  EXPECT_TRUE(free.waitForCubes(expected.free()));
  EXPECT_EQ(occupied.header().frame_id, "map");
  EXPECT_EQ(occupied.header().stamp, ros::Time(100.5));

  // The second sensor sees through walls of the first one: sizes come and go.
  for (int i = 0; i < 3; ++i) {
    publishRoom("lidar_b");
    expected.insertRoom({1.05, -0.45, 0.55});
    EXPECT_TRUE(waitForInserted(2 + i));
  }
  EXPECT_TRUE(occupied.waitForCubes(expected.occupied()));
  EXPECT_TRUE(free.waitForCubes(expected.free()));
}

TEST_F(NodeMarkersTest, ALateListenerGetsTheWholePictureAtOnce) {
  Viewer early("/occupied_cuboids");
  ExpectedMap expected;
  for (const bool is_first : {true, false}) {
    publishRoom(is_first ? "lidar_a" : "lidar_b");
    expected.insertRoom(is_first ? Eigen::Vector3d(0.05, 0.05, 0.05)
                                 : Eigen::Vector3d(1.05, -0.45, 0.55));
    ASSERT_TRUE(early.waitForCubes(expected.occupied()));
  }
  // No more clouds come.
  RemoteViewer late("/occupied_cuboids", 2);
  EXPECT_EQ(late.nextPicture(), RemoteViewer::toText(expected.occupied()));
  Viewer first_of_free("/free_cuboids");
  EXPECT_TRUE(first_of_free.waitForCubes(expected.free()));

  // From now on both get the differences: space that lidar_b sees through becomes free.
  for (int i = 0; i < 2; ++i) {
    publishRoom("lidar_b");
    expected.insertRoom({1.05, -0.45, 0.55});
  }
  EXPECT_EQ(late.nextPicture(), RemoteViewer::toText(expected.occupied()));
  EXPECT_TRUE(early.waitForCubes(expected.occupied()));
  EXPECT_TRUE(first_of_free.waitForCubes(expected.free()));
}

TEST_F(NodeMarkersTest, ListenersThatGoAndComeBackSeeTheMapAsItIs) {
  ExpectedMap expected;
  auto viewer = std::make_unique<Viewer>("/occupied_cuboids");
  publishRoom("lidar_a");
  expected.insertRoom({0.05, 0.05, 0.05});
  ASSERT_TRUE(viewer->waitForCubes(expected.occupied()));
  viewer.reset();
  publishRoom("lidar_b");
  expected.insertRoom({1.05, -0.45, 0.55});
  ASSERT_TRUE(waitForInserted(2));
  viewer = std::make_unique<Viewer>("/occupied_cuboids");
  EXPECT_TRUE(viewer->waitForCubes(expected.occupied()));
}

TEST_F(NodeMarkersTest, ResetTakesThemAllAway) {
  Viewer occupied("/occupied_cuboids");
  Viewer free("/free_cuboids");
  publishRoom("lidar_a");
  ExpectedMap expected;
  expected.insertRoom({0.05, 0.05, 0.05});
  ASSERT_TRUE(occupied.waitForCubes(expected.occupied()));
  ASSERT_TRUE(free.waitForCubes(expected.free()));
  reset();
  EXPECT_TRUE(occupied.waitForCubes({}));
  EXPECT_TRUE(free.waitForCubes({}));
  EXPECT_EQ(occupied.picture().numKept(), 0U);
  EXPECT_GT(occupied.picture().numDeletes(), 0U);

  EXPECT_EQ(RemoteViewer("/occupied_cuboids", 1).nextPicture(), "");
}

TEST(NodeJoinsCuboids, AWallThroughSeveralBricksIsOneBox) {
  const std::string node = "/with_sensor_frame";
  ASSERT_TRUE(ros::service::waitForService(node + "/reset", ros::Duration(kDeadline_s)));
  Viewer occupied(node + "/occupied_cuboids");
  ros::NodeHandle nh;
  auto publisher = nh.advertise<sensor_msgs::PointCloud2>("/transformed_cloud", 10);
  ASSERT_TRUE(waitFor([&] { return publisher.getNumSubscribers() > 0; }));
  publishStaticTf(makeTransform("map", "lidar", makeTranslation(0.05, 0.05, 0.05)));
  std::vector<Eigen::Vector3d> wall;
  for (double x = 20.55; x < 24.5; x += kResolution_m) {
    for (double z = 0.05; z < 1.6; z += kResolution_m) wall.emplace_back(x, 0.05, z);
  }
  publisher.publish(makeCloud("map", ros::Time(100.0), wall));
  EXPECT_TRUE(waitFor([&] { return occupied.picture().cubes().size() > 1; }));

  GetCuboids cuboids;
  cuboids.request.everything = true;
  cuboids.request.classes = GetCuboids::Request::OCCUPIED;
  cuboids.request.joined = true;
  ASSERT_TRUE(callService(node + "/get_cuboids", cuboids));
  ASSERT_EQ(cuboids.response.cuboids.size(), 1U);
  EXPECT_NEAR(cuboids.response.cuboids[0].min.x, 20.5, 1e-9);
  EXPECT_NEAR(cuboids.response.cuboids[0].max.x, 24.5, 1e-9);
  EXPECT_NEAR(cuboids.response.cuboids[0].max.z, 1.6, 1e-9);

  std_srvs::Empty empty;
  ASSERT_TRUE(callService(node + "/reset", empty));
  EXPECT_TRUE(occupied.waitForCubes({}));
}

}  // namespace
}  // namespace cuboid_mapping_ros::test

int main(int argc, char** argv) {
  using cuboid_mapping_ros::test::RemoteViewer;
  const bool is_viewer = argc == 4 && std::string(argv[1]) == "--view";
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_node", is_viewer ? ros::init_options::AnonymousName : 0);
  const ros::NodeHandle keep_alive;
  return is_viewer ? RemoteViewer::run(argv[2], std::stoi(argv[3])) : RUN_ALL_TESTS();
}
