// SPDX-License-Identifier: BSD-3-Clause
#include "read_bag.h"
#include "run_program.h"
#include "terminal.h"

#include <gtest/gtest.h>
#include <octomap/ScanGraph.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <sys/stat.h>
#include <tf2_eigen/tf2_eigen.h>

#include <cmath>
#include <filesystem>
#include <fstream>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::test::limitFileSize;
using cuboid_mapping::test::Program;
using cuboid_mapping::test::ProgramEnd;
using cuboid_mapping::test::readText;
using cuboid_mapping::test::runProgram;
using cuboid_mapping::test::TemporaryFolder;
using cuboid_mapping::test::Terminal;
using cuboid_mapping::test::waitForFile;

constexpr int kNumScans = 3;
constexpr int kNumPoints = 5;

Eigen::Vector3f makePoint(int scan, int point) {
  return {1.0F + static_cast<float>(scan), 0.25F * static_cast<float>(point), -0.5F};
}

/// A pose with a quarter turn to the left for every scan, and a metre to the side.
Eigen::Isometry3d makePose(int scan) {
  return Eigen::Translation3d(0.5, scan, 2.0) *
         Eigen::AngleAxisd(scan * M_PI / 2, Eigen::Vector3d::UnitZ());
}

void writeScanFolder(const std::string& folder) {
  std::filesystem::create_directories(folder + "/scans");
  std::ofstream poses(folder + "/poses.txt");
  poses << "# index tx ty tz qx qy qz qw\n";
  for (int scan = 0; scan < kNumScans; ++scan) {
    const Eigen::Vector3d t = makePose(scan).translation();
    const Eigen::Quaterniond q(makePose(scan).linear());
    poses << scan << ' ' << t.transpose() << ' ' << q.coeffs().transpose() << '\n';
    std::ofstream pcd(folder + "/scans/000" + std::to_string(scan) + ".pcd");
    pcd << "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " << kNumPoints
        << "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " << kNumPoints << "\nDATA ascii\n";
    for (int point = 0; point < kNumPoints; ++point) {
      pcd << makePoint(scan, point).transpose() << '\n';
    }
  }
}

void writeScanGraph(const std::string& file) {
  octomap::ScanGraph graph;
  for (int scan = 0; scan < kNumScans; ++scan) {
    auto* cloud = new octomap::Pointcloud;  // the graph takes ownership
    for (int point = 0; point < kNumPoints; ++point) {
      const Eigen::Vector3f p = makePoint(scan, point);
      cloud->push_back(p.x(), p.y(), p.z());
    }
    const Eigen::Vector3f t = makePose(scan).translation().cast<float>();
    const Eigen::Quaternionf q(makePose(scan).linear().cast<float>());
    graph.addNode(cloud, {octomath::Vector3(t.x(), t.y(), t.z()),
                          octomath::Quaternion(q.w(), q.x(), q.y(), q.z())});
  }
  graph.writeBinary(file);
}

ProgramEnd convert(const std::string& dataset, const std::string& bag,
                   const std::vector<std::string>& options = {},
                   const std::function<void()>& prepare = {}) {
  std::vector<std::string> arguments = {SCANS_TO_BAG_PROGRAM, dataset, bag};
  arguments.insert(arguments.end(), options.begin(), options.end());
  return runProgram(arguments, prepare);
}

void expectScan(const BagContents::Cloud& cloud, int scan) {
  EXPECT_EQ(cloud.message.height, 1U);
  ASSERT_EQ(cloud.message.width, static_cast<std::uint32_t>(kNumPoints));
  EXPECT_EQ(cloud.message.row_step, cloud.message.width * cloud.message.point_step);
  sensor_msgs::PointCloud2ConstIterator<float> xyz(cloud.message, "x");
  for (int point = 0; point < kNumPoints; ++point, ++xyz) {
    EXPECT_EQ(Eigen::Vector3f(xyz[0], xyz[1], xyz[2]), makePoint(scan, point)) << point;
  }
  ASSERT_TRUE(cloud.has_transform);
  const Eigen::Isometry3d pose = tf2::transformToEigen(cloud.T_map_cloud);
  EXPECT_TRUE(pose.isApprox(makePose(scan), 1e-5)) << pose.matrix();
}

class ScansToBag : public testing::Test {
 protected:
  ScansToBag() { writeScanFolder(dataset_); }

  TemporaryFolder input_;
  TemporaryFolder output_;
  std::string dataset_ = input_ / "data";
  std::string bag_ = output_ / "out.bag";
};

TEST_F(ScansToBag, convertsAFolder) {
  const ProgramEnd end = convert(dataset_, bag_);
  ASSERT_EQ(end.status, 0) << end.err;
  EXPECT_EQ(end.err, "");  // a progress bar is for terminals
  EXPECT_NE(end.out.find("3 clouds, 15 points"), std::string::npos) << end.out;
  EXPECT_EQ(output_.list(), std::vector<std::string>{"out.bag"});
  const BagContents contents = readBag(bag_);
  ASSERT_EQ(contents.clouds.size(), 3U);
  ASSERT_EQ(contents.transforms.size(), 3U);
  for (int scan = 0; scan < kNumScans; ++scan) {
    const BagContents::Cloud& cloud = contents.clouds[scan];
    EXPECT_EQ(cloud.topic, "/cloud");
    EXPECT_EQ(cloud.message.header.frame_id, "sensor");
    EXPECT_EQ(cloud.message.header.stamp, ros::Time(1000) + ros::Duration(0.1 * scan));
    EXPECT_TRUE(cloud.message.is_dense);
    expectScan(cloud, scan);
  }
}

TEST_F(ScansToBag, convertsAScanGraph) {
  const std::string graph = input_ / "scans.graph";
  writeScanGraph(graph);
  const ProgramEnd end = convert(graph, bag_);
  ASSERT_EQ(end.status, 0) << end.err;
  const BagContents contents = readBag(bag_);
  ASSERT_EQ(contents.clouds.size(), 3U);
  for (int scan = 0; scan < kNumScans; ++scan) expectScan(contents.clouds[scan], scan);
}

TEST_F(ScansToBag, refusesAScanGraphThatWasCutOff) {
  const std::string graph = input_ / "scans.graph";
  writeScanGraph(graph);
  const std::uintmax_t num_bytes = std::filesystem::file_size(graph);
  for (const std::uintmax_t size : {num_bytes - 5, num_bytes / 2, std::uintmax_t{3}}) {
    std::filesystem::resize_file(graph, size);
    const ProgramEnd end = convert(graph, bag_);
    EXPECT_EQ(end.status, 1) << size << end.err;
    EXPECT_NE(end.err.find("as an OctoMap scan graph"), std::string::npos) << end.err;
  }
}

TEST_F(ScansToBag, takesRateNamesAndCount) {
  const ProgramEnd end =
      convert(dataset_, bag_,
              {"--rate", "4", "--topic", "/points", "--sensor-frame", "velodyne", "--clouds", "2"});
  ASSERT_EQ(end.status, 0) << end.err;
  const BagContents contents = readBag(bag_);
  ASSERT_EQ(contents.clouds.size(), 2U);
  EXPECT_EQ(contents.clouds[1].topic, "/points");
  EXPECT_EQ(contents.clouds[1].message.header.frame_id, "velodyne");
  EXPECT_EQ(contents.clouds[1].message.header.stamp, ros::Time(1000.25));
  EXPECT_TRUE(contents.clouds[1].has_transform);
  ASSERT_EQ(convert(dataset_, bag_, {"--map-frame", "odom", "--clouds", "99"}).status, 0);
  const BagContents other = readBag(bag_);
  ASSERT_EQ(other.transforms.size(), 3U);
  EXPECT_EQ(other.transforms[0].transforms.at(0).header.frame_id, "odom");
  EXPECT_EQ(other.transforms[0].transforms.at(0).child_frame_id, "sensor");
}

TEST_F(ScansToBag, keepsPointsThatAreNotFiniteAndSaysSo) {
  std::ofstream(dataset_ + "/scans/0001.pcd")
      << "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
         "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n1 2 3\nnan nan nan\n";
  ASSERT_EQ(convert(dataset_, bag_).status, 0);
  const BagContents contents = readBag(bag_);
  EXPECT_EQ(contents.clouds.at(1).message.width, 2U);
  EXPECT_FALSE(contents.clouds.at(1).message.is_dense);
}

TEST_F(ScansToBag, saysWhatIsMissing) {
  const ProgramEnd no_folder = convert(input_ / "nowhere", bag_);
  EXPECT_EQ(no_folder.status, 1);
  EXPECT_NE(no_folder.err.find("nowhere"), std::string::npos) << no_folder.err;

  std::filesystem::remove(dataset_ + "/scans/0002.pcd");
  const ProgramEnd no_scan = convert(dataset_, bag_);
  EXPECT_EQ(no_scan.status, 1);
  EXPECT_NE(no_scan.err.find("0002.pcd"), std::string::npos) << no_scan.err;

  std::filesystem::remove(dataset_ + "/poses.txt");
  const ProgramEnd no_poses = convert(dataset_, bag_);
  EXPECT_EQ(no_poses.status, 1);
  EXPECT_NE(no_poses.err.find("poses.txt"), std::string::npos) << no_poses.err;

  const ProgramEnd no_graph = convert(input_ / "no.graph", bag_);
  EXPECT_EQ(no_graph.status, 1);
  EXPECT_NE(no_graph.err.find("no.graph"), std::string::npos) << no_graph.err;

  EXPECT_TRUE(output_.list().empty());
}

TEST_F(ScansToBag, refusesBadOptions) {
  const std::pair<std::vector<std::string>, std::string> cases[] = {
      {{"--rate", "0"}, "--rate 0"},
      {{"--rate", "-3"}, "--rate -3"},
      {{"--rate", "nan"}, "--rate nan"},
      {{"--rate", "fast"}, "fast"},
      {{"--clouds", "0"}, "--clouds 0"},
      {{"--clouds", "-2"}, "--clouds -2"},
      {{"--topic", "a b"}, "--topic 'a b'"},
      {{"--topic", ""}, "--topic ''"},
      {{"--map-frame", "/map"}, "--map-frame '/map'"},
      {{"--sensor-frame", ""}, "--sensor-frame ''"},
      {{"--sensor-frame", "map"}, "must differ"},
      {{"--speed", "1"}, "--speed"},
  };
  for (const auto& [options, message] : cases) {
    const ProgramEnd end = convert(dataset_, bag_, options);
    EXPECT_EQ(end.status, 1) << message;
    EXPECT_NE(end.err.find(message), std::string::npos) << end.err;
    EXPECT_TRUE(output_.list().empty()) << message;
  }
  EXPECT_EQ(runProgram({SCANS_TO_BAG_PROGRAM, dataset_}).status, 1);
}

ProgramEnd mapInputs(const std::vector<std::string>& inputs, const std::string& map,
                     const std::vector<std::string>& options = {}) {
  std::vector<std::string> arguments = {BAG_TO_MAP_PROGRAM};
  arguments.insert(arguments.end(), inputs.begin(), inputs.end());
  arguments.insert(arguments.end(), {"-o", map});
  arguments.insert(arguments.end(), options.begin(), options.end());
  return runProgram(arguments);
}

TEST_F(ScansToBag, isNotNeededToMapScans) {
  const std::string graph = input_ / "scans.graph";
  writeScanGraph(graph);
  for (const std::string& dataset : {dataset_, graph}) {
    ASSERT_EQ(convert(dataset, bag_, {"--map-frame", "odom"}).status, 0);
    const std::string of_bag = output_ / "bag.cuboids";
    const std::string of_scans = output_ / "scans.cuboids";
    ASSERT_EQ(mapInputs({bag_}, of_bag, {"--set", "frame_id=odom"}).status, 0);
    const ProgramEnd end = mapInputs({dataset}, of_scans, {"--set", "frame_id=odom"});
    EXPECT_EQ(end.status, 0) << end.err;
    EXPECT_NE(end.out.find("3 of 3 clouds, 15 points"), std::string::npos) << end.out;
    EXPECT_GT(readText(of_bag).size(), 500U);
    EXPECT_TRUE(readText(of_bag) == readText(of_scans)) << dataset;
  }
  const ProgramEnd both = mapInputs({dataset_, graph}, output_ / "both.cuboids");
  EXPECT_NE(both.out.find("6 of 6 clouds, 30 points"), std::string::npos) << both.out << both.err;
}

TEST_F(ScansToBag, saysWhatOnlyBagsCanHave) {
  ASSERT_EQ(convert(dataset_, bag_).status, 0);
  const std::string map = output_ / "none.cuboids";
  struct Case {
    std::vector<std::string> inputs;
    std::vector<std::string> options;
    std::string text;
  };
  for (const Case& wrong : {Case{{dataset_, bag_}, {}, "do not go together"},
                            Case{{dataset_}, {"--topic", "/cloud"}, "--topic does not go"},
                            Case{{dataset_}, {"--set", "max_rate=2"}, "max_rate"},
                            Case{{dataset_}, {"--set", "type=laser_scan"}, "type"},
                            Case{{dataset_}, {"--set", "frame_id=sensor"}, "frame_id"},
                            Case{{output_ / "."}, {}, "by their names, as in"},
                            Case{{input_ / "nowhere.graph"}, {}, "nowhere.graph"}}) {
    const ProgramEnd end = mapInputs(wrong.inputs, map, wrong.options);
    EXPECT_EQ(end.status, 1) << wrong.text;
    EXPECT_NE(end.err.find(wrong.text), std::string::npos) << end.err;
    EXPECT_FALSE(std::filesystem::exists(map));
  }
}

TEST_F(ScansToBag, leavesNothingBehindWhereItCannotWrite) {
  const ProgramEnd full = convert(dataset_, bag_, {}, [] { limitFileSize(5000); });
  EXPECT_EQ(full.status, 1);
  EXPECT_NE(full.err.find("cannot write " + bag_), std::string::npos) << full.err;
  EXPECT_TRUE(output_.list().empty());
  const ProgramEnd missing = convert(dataset_, output_ / "no/folder.bag");
  EXPECT_EQ(missing.status, 1);
  EXPECT_NE(missing.err.find("No such file or directory"), std::string::npos) << missing.err;
}

TEST_F(ScansToBag, replacesTheTargetOfALinkAndNoDeviceOrPipe) {
  const std::string pipe = output_ / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const ProgramEnd refused = convert(dataset_, pipe);
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("it is a device or a pipe"), std::string::npos) << refused.err;
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
  std::ofstream(output_ / "target.bag") << "old";
  std::filesystem::create_symlink("target.bag", bag_);
  EXPECT_EQ(convert(dataset_, bag_).status, 0);
  EXPECT_TRUE(std::filesystem::is_symlink(bag_));
  EXPECT_GT(std::filesystem::file_size(output_ / "target.bag"), 100U);
}

TEST_F(ScansToBag, leavesNothingBehindOnCtrlC) {
  // Many poses, so that it is still running.
  std::ofstream poses(dataset_ + "/poses.txt", std::ios::app);
  for (int i = 0; i < 300000; ++i) poses << "0 0 0 0 0 0 0 1\n";
  poses.close();
  Program program({SCANS_TO_BAG_PROGRAM, dataset_, bag_});
  ASSERT_TRUE(waitForFile(bag_ + ".partial"));
  program.send(SIGINT);
  const ProgramEnd end = program.finish();
  EXPECT_EQ(end.status, 128 + SIGINT);
  EXPECT_EQ(end.err, "scans_to_bag: interrupted\n");
  EXPECT_TRUE(output_.list().empty());
}

TEST_F(ScansToBag, drawsAProgressBarOnATerminal) {
  Terminal terminal;
  if (!terminal.isThere()) GTEST_SKIP() << "no pseudo-terminals on this machine";
  ASSERT_EQ(convert(dataset_, bag_, {}, [&] { terminal.attach(); }).status, 0);
  const std::string& drawn = terminal.shown();
  EXPECT_NE(drawn.find("\r[....."), std::string::npos) << drawn;
  EXPECT_NE(drawn.find("100 %  3 of 3 clouds in "), std::string::npos) << drawn;
  EXPECT_NE(drawn.find('\n'), std::string::npos);
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
