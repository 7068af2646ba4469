// SPDX-License-Identifier: BSD-3-Clause
#include "../tools/run_program.h"
#include "room_scans.h"

#include "cuboid_mapping/ros/conversions/points.h"

#include <Eigen/Geometry>

#include <geometry_msgs/TransformStamped.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_msgs/TFMessage.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>

namespace cuboid_mapping::bench::test {
namespace {

using cuboid_mapping::test::ProgramEnd;
using cuboid_mapping::test::readText;
using cuboid_mapping::test::runProgram;
using cuboid_mapping::test::TemporaryFolder;
using Json = nlohmann::json;

tf2_msgs::TFMessage makeTransform(const Eigen::Isometry3d& T_parent_child, ros::Time stamp,
                                  const std::string& parent, const std::string& child) {
  tf2_msgs::TFMessage message;
  message.transforms.push_back(tf2::eigenToTransform(T_parent_child));
  message.transforms.front().header.stamp = stamp;
  message.transforms.front().header.frame_id = parent;
  message.transforms.front().child_frame_id = child;
  return message;
}

sensor_msgs::PointCloud2 makeCloud(int scan, ros::Time stamp) {
  return cuboid_mapping_ros::toCloud(makePoints(scan),
                                     cuboid_mapping_ros::makeHeader("lidar", stamp));
}

/// Writes map -> base on /tf, after the clouds; base -> lidar on /tf_static. One cloud comes before all
/// transforms.
void writeBag(const std::string& file) {
  const Eigen::Isometry3d T_base_lidar(Eigen::Translation3d(0.1, 0.0, 0.4) *
                                       Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY()));
  rosbag::Bag bag(file, rosbag::bagmode::Write);
  bag.write("/tf_static", ros::Time(90), makeTransform(T_base_lidar, {}, "base", "lidar"));
  bag.write("/points", ros::Time(99), makeCloud(0, ros::Time(99)));
  for (int scan = 0; scan < kNumScans; ++scan) {
    const ros::Time stamp(100 + scan);
    bag.write("/points", stamp, makeCloud(scan, stamp));
    bag.write("/tf", stamp + ros::Duration(0.1),
              makeTransform(makePose(scan) * T_base_lidar.inverse(), stamp, "/map", "base"));
  }
}

/// Whether all values of an object of that name exist and are numbers.
void expectNumbers(const Json& object, const std::vector<std::string>& keys) {
  for (const std::string& key : keys) {
    ASSERT_TRUE(object.contains(key)) << key;
    EXPECT_TRUE(object[key].is_number()) << key;
    EXPECT_GE(object[key].get<double>(), 0.0) << key;
  }
}

void expectBothPlaces(const Json& object, const std::vector<std::string>& keys) {
  for (const std::string& key : keys) {
    ASSERT_TRUE(object.contains(key)) << key;
    expectNumbers(object[key], {"uniform", "near_surface"});
  }
}

/// Known, class and log-odds agree in every voxel, and so do all answers.
/// @param offers_rays  Else there are no answers of rays.
void expectExact(const Json& agreement, bool offers_rays = true) {
  EXPECT_GT(agreement["voxels"].get<double>(), 500.0);
  EXPECT_EQ(agreement["known_mismatch"], 0.0);
  EXPECT_EQ(agreement["class_mismatch"], 0.0);
  EXPECT_LE(agreement["max_log_odds_difference"].get<double>(), 1e-3);
  for (const char* kind : {"point_queries", "box_queries", "ray_queries"}) {
    for (const char* place : {"uniform", "near_surface"}) {
      const Json& answers = agreement[kind][place];
      const bool is_offered = offers_rays || kind != std::string("ray_queries");
      EXPECT_EQ(answers["compared"] > 0, is_offered) << kind << ' ' << place;
      EXPECT_EQ(answers["different"], 0) << kind << ' ' << place;
    }
  }
}

class CompareMaps : public testing::Test {
 protected:
  static constexpr bool kHasOpenvdb = CUBOID_MAPPING_HAS_OPENVDB != 0;

  ProgramEnd run(const std::string& dataset, const std::vector<std::string>& options = {}) const {
    std::vector<std::string> arguments{COMPARE_MAPS_PROGRAM, dataset, "--json", json_,
                                       "--query-time",       "0.005"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return runProgram(arguments);
  }

  /// The report of a run that must succeed.
  Json report(const std::string& dataset, const std::vector<std::string>& options = {}) const {
    const ProgramEnd end = run(dataset, options);
    EXPECT_EQ(end.status, 0) << end.err;
    return end.status == 0 ? Json::parse(readText(json_)) : Json::object();
  }

  /// Expects that a run fails with this text, and leaves no report.
  void expectError(const std::string& dataset, const std::vector<std::string>& options,
                   const std::string& message) const {
    const ProgramEnd end = run(dataset, options);
    EXPECT_EQ(end.status, 1) << message;
    EXPECT_NE(end.err.find(message), std::string::npos) << end.err << "\nwanted: " << message;
    EXPECT_FALSE(std::filesystem::exists(json_)) << message;
    EXPECT_FALSE(std::filesystem::exists(json_ + ".partial")) << message;
  }

  std::string folder() const {
    const std::string path = temporary_ / "room";
    if (!std::filesystem::exists(path)) writeScanFolder(path);
    return path;
  }

  std::string bag() const {
    const std::string path = temporary_ / "room.bag";
    if (!std::filesystem::exists(path)) writeBag(path);
    return path;
  }

  TemporaryFolder temporary_;
  std::string json_ = temporary_ / "figures.json";
};

TEST_F(CompareMaps, reportsEveryFigureOfEveryMap) {
  const Json json = report(folder(), {"--repeat", "2"});
  ASSERT_FALSE(json.empty());
  EXPECT_EQ(json["dataset"], "room");
  EXPECT_EQ(json["clouds"], kNumScans);
  EXPECT_EQ(json["points"], kNumScans * kNumPoints);
  EXPECT_EQ(json["resolution_m"], 0.2);
  EXPECT_EQ(json["threads"], 1);
  EXPECT_TRUE(json["max_range_m"].is_null());
  EXPECT_EQ(json["fusion"], "class");
  EXPECT_EQ(json["environment"], "dynamic");
  EXPECT_EQ(json["repeat"], 2);
  for (const char* key : {"branching", "fuse_every_cloud"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  for (const char* key : {"cpu", "cores", "compiler", "build_type", "commit"}) {
    EXPECT_TRUE(json["machine"].contains(key)) << key;
  }
  EXPECT_EQ(json.contains("openvdb"), kHasOpenvdb);
  for (const char* map : {"cuboid_mapping", "octomap", "openvdb"}) {
    if (!json.contains(map)) continue;
    SCOPED_TRACE(map);
    const Json& figures = json[map];
    expectNumbers(figures, {"insert_s", "insert_cpu_s", "cells", "occupied_cells", "free_cells",
                            "leaf_nodes", "inner_nodes", "bytes_own", "bytes_peak", "bytes_heap",
                            "bytes_scratch", "access_occupied_s"});
    expectNumbers(figures["per_cloud_ms"],
                  {"p50", "p99", "max", "mean_of_first_third", "mean_of_last_third"});
    expectBothPlaces(figures, {"point_queries_per_s", "box_queries_per_s", "ray_queries_per_s"});
    EXPECT_TRUE(figures.contains("ray_walk_cpu_s"));
    EXPECT_EQ(figures["clouds_by_columns"].is_number(), std::string(map) == "cuboid_mapping");
    ASSERT_EQ(figures["repetitions"].size(), 2U);
    const double first_s = figures["repetitions"][0]["insert_cpu_s"];
    const double second_s = figures["repetitions"][1]["insert_cpu_s"];
    EXPECT_EQ(figures["insert_cpu_s"], std::max(first_s, second_s)) << "the greater of two";
    EXPECT_GT(figures["occupied_cells"], 0);
    EXPECT_EQ(figures["cells"], figures["occupied_cells"].get<std::size_t>() +
                                    figures["free_cells"].get<std::size_t>());
  }
  EXPECT_EQ(json["agreement"].size(), kHasOpenvdb ? 2U : 1U);
}

/// Those that have other rays, or round more.
bool isExactPeer(const std::string& name) {
  const std::set<std::string> others{"bonxai_map", "dmap",   "mrpt",   "octomap_discrete",
                                     "ohm_rays",   "ufomap", "wavemap"};
  return others.count(name) == 0;
}

TEST_F(CompareMaps, agreesWithEveryPeer) {
  const std::vector<std::vector<std::string>> cases{
      {},
      {"--max-range", "2.5"},
      {"--resolution", "0.1", "--branching", "8", "--fuse-every-cloud"},
      {"--fusion", "none", "--threads", "2"},
  };
  for (const auto& options : cases) {
    SCOPED_TRACE(options.empty() ? "no options" : options.front());
    std::vector<std::string> with_peers = options;
    with_peers.insert(with_peers.end(), {"--peers", "all"});
    const Json json = report(folder(), with_peers);
    ASSERT_TRUE(json["agreement"].contains("octomap"));
    ASSERT_TRUE(json["agreement"].contains("octomap_lazy"));
    for (const auto& [name, agreement] : json["agreement"].items()) {
      SCOPED_TRACE(name);
      if (isExactPeer(name)) {
        expectExact(agreement, name != "bonxai");
      } else {
        EXPECT_LT(agreement["class_mismatch"], 0.1 * agreement["voxels"].get<double>());
        EXPECT_LT(agreement["known_mismatch"], agreement["voxels"]);
      }
    }
    for (const char* count : {"cells", "occupied_cells", "inner_nodes"}) {
      EXPECT_EQ(json["octomap_lazy"][count], json["octomap"][count]) << "pruned alike: " << count;
    }
  }
}

TEST_F(CompareMaps, hasNoRatesOfQueriesThatAPeerDoesNotOffer) {
  const Json json = report(folder(), {"--peers", "all"});
  if (!json.contains("bonxai")) GTEST_SKIP() << "built without Bonxai";
  EXPECT_TRUE(json["bonxai"]["ray_queries_per_s"]["uniform"].is_null());
  EXPECT_TRUE(json["bonxai"]["box_queries_per_s"]["uniform"].is_number());
  EXPECT_EQ(json["agreement"]["bonxai"]["ray_queries"]["uniform"]["compared"], 0);
}

TEST_F(CompareMaps, agreesWithOpenvdbInAStaticEnvironment) {
  if (!kHasOpenvdb) GTEST_SKIP() << "built without OpenVDB";
  const Json json = report(folder(), {"--environment", "static", "--peers", "openvdb"});
  EXPECT_EQ(json["environment"], "static");
  EXPECT_FALSE(json.contains("octomap"));
  expectExact(json["agreement"]["openvdb"]);
  EXPECT_EQ(json["agreement"]["openvdb"]["max_log_odds_difference"], 0.0);
}

TEST_F(CompareMaps, takesPartOfTheCloudsAndNoPeers) {
  const ProgramEnd end = run(folder(), {"--clouds", "2", "--peers", "none"});
  ASSERT_EQ(end.status, 0) << end.err;
  EXPECT_EQ(end.err, "");  // a progress bar is for terminals
  EXPECT_NE(end.out.find("2 clouds, 3000 points"), std::string::npos) << end.out;
  const Json json = Json::parse(readText(json_));
  EXPECT_EQ(json["clouds"], 2);
  EXPECT_FALSE(json.contains("octomap"));
  EXPECT_TRUE(json["agreement"].empty());
}

TEST_F(CompareMaps, takesOneOfSeveralClouds) {
  const Json every_second = report(folder(), {"--every", "2", "--peers", "none"});
  EXPECT_EQ(every_second["clouds"], 2);
  EXPECT_EQ(every_second["points"], 2 * kNumPoints);
  const Json first_two = report(folder(), {"--clouds", "2", "--peers", "none"});
  EXPECT_NE(every_second["cuboid_mapping"]["cells"], first_two["cuboid_mapping"]["cells"])
      << "the first and the third cloud, not the second";
  EXPECT_EQ(report(folder(), {"--clouds", "2", "--every", "2", "--peers", "none"})["clouds"], 1);
  EXPECT_EQ(report(bag(), {"--every", "2", "--peers", "none"})["clouds"], 2);
}

TEST_F(CompareMaps, timesAsManyCloudsAsAskedFor) {
  const Json json = report(folder(), {"--peers", "octomap", "--cloud-samples", "7"});
  for (const char* map : {"cuboid_mapping", "octomap"}) {
    const Json& samples = json[map]["cloud_samples"];
    ASSERT_TRUE(samples.is_object());
    EXPECT_EQ(samples["count"], 3 * kNumScans) << "whole fills";
    for (const char* clock : {"wall_ms", "cpu_ms"}) {
      const Json& times = samples[clock];
      expectNumbers(times, {"p50", "p99", "p99_9", "max"});
      EXPECT_GT(times["p50"], 0.0);
      EXPECT_LE(times["p50"], times["p99"]);
      EXPECT_EQ(times["p99"], times["max"]) << "of nine";
    }
  }
  const Json without = report(folder(), {"--peers", "none"});
  EXPECT_TRUE(without["cuboid_mapping"]["cloud_samples"].is_null());
}

TEST_F(CompareMaps, takesMapsInTurnsOrInARandomOrder) {
  const auto orders = [this](const std::string& option, const std::string& value) {
    return report(folder(),
                  {"--clouds", "1", "--peers", "octomap,octomap_lazy", option, value})["orders"];
  };
  const Json forward{"cuboid_mapping", "octomap", "octomap_lazy"};
  const Json reverse{"octomap_lazy", "octomap", "cuboid_mapping"};
  EXPECT_EQ(orders("--repeat", "2"), Json({forward, reverse}));
  EXPECT_EQ(orders("--shuffle", "1"), Json({reverse}));
  EXPECT_NE(orders("--shuffle", "2"), orders("--shuffle", "1"));
}

TEST_F(CompareMaps, readsABagWithItsTransforms) {
  const Json from_folder = report(folder());
  const ProgramEnd end = run(bag(), {"--cloud-topic", "/points"});
  ASSERT_EQ(end.status, 0) << end.err;
  // The cloud from before all transforms is left out and reported.
  EXPECT_NE(end.err.find("1 cloud skipped"), std::string::npos) << end.err;
  const Json from_bag = Json::parse(readText(json_));
  EXPECT_EQ(from_bag["clouds"], kNumScans);
  EXPECT_EQ(from_bag["points"], kNumScans * kNumPoints);
  expectExact(from_bag["agreement"]["octomap"]);
  // The poses differ only by rounding, and the voxels only in a few.
  const auto voxels = from_folder["agreement"]["octomap"]["voxels"].get<double>();
  EXPECT_NEAR(from_bag["agreement"]["octomap"]["voxels"].get<double>(), voxels, 0.01 * voxels);
  EXPECT_EQ(report(bag(), {"--clouds", "1", "--peers", "none"})["clouds"], 1);  // its only topic
}

TEST_F(CompareMaps, saysWhatIsWrongWithADataset) {
  expectError(temporary_ / "nowhere", {}, "nowhere");
  expectError(temporary_ / "no.graph", {}, "no.graph");
  expectError(temporary_ / "no.bag", {}, "no.bag");
  expectError(bag(), {"--cloud-topic", "/scan"}, "choose --cloud-topic from /points");
  expectError(bag(), {"--map-frame", "odom"}, "none of its clouds can be used");
  std::ofstream(temporary_ / "text.bag") << "no bag at all";
  expectError(temporary_ / "text.bag", {}, "text.bag as a rosbag");
  rosbag::Bag empty(temporary_ / "empty.bag", rosbag::bagmode::Write);
  empty.close();
  expectError(temporary_ / "empty.bag", {}, "has no topic of sensor_msgs/PointCloud2");
  std::filesystem::remove(folder() + "/scans/0001.pcd");
  expectError(folder(), {}, "0001.pcd");
}

TEST_F(CompareMaps, refusesADatasetWithoutPoints) {
  for (int scan = 0; scan < kNumScans; ++scan) {
    std::ofstream(folder() + "/scans/000" + std::to_string(scan) + ".pcd")
        << "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\n"
           "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1\nDATA ascii\nnan nan nan\n";
  }
  expectError(folder(), {}, "no occupied voxel");
}

TEST_F(CompareMaps, refusesBadOptions) {
  const std::pair<std::vector<std::string>, std::string> cases[] = {
      {{"--max-range", "0"}, "--max-range"},
      {{"--fusion", "glue"}, "glue"},
      {{"--environment", "windy"}, "windy"},
      {{"--branching", "1"}, "--branching"},
      {{"--branching", "65"}, "--branching"},
      {{"--threads", "0"}, "--threads"},
      {{"--hot-mb", "1"}, "--hot-mb"},
      {{"--clouds", "0"}, "--clouds"},
      {{"--repeat", "0"}, "--repeat"},
      {{"--every", "0"}, "--every"},
      {{"--peers", "skimap"}, "skimap"},
      {{"--peers", "none,octomap"}, "none and all cannot be combined with others"},
      {{"--peers", "all,octomap"}, "none and all cannot be combined with others"},
      {{"--query-time", "0"}, "--query-time"},
      {{"--speed", "1"}, "--speed"},
  };
  for (const auto& [options, message] : cases) expectError(folder(), options, message);
  EXPECT_EQ(runProgram({COMPARE_MAPS_PROGRAM}).status, 1);
  if (!kHasOpenvdb) expectError(folder(), {"--peers", "openvdb"}, "built without it");
}

TEST_F(CompareMaps, explainsItselfInPlainText) {
  const ProgramEnd help = runProgram({COMPARE_MAPS_PROGRAM, "--help"});
  EXPECT_EQ(help.status, 0);
  EXPECT_EQ(help.out.find('\0'), std::string::npos);
  EXPECT_NE(help.out.find("(class, growth, none; default class)"), std::string::npos) << help.out;
  EXPECT_NE(help.out.find("octomap_lazy"), std::string::npos) << help.out;
  EXPECT_FALSE(runProgram({COMPARE_MAPS_PROGRAM, "--version"}).out.empty());
}

TEST_F(CompareMaps, saysWhenItCannotWriteTheReport) {
  const ProgramEnd end = runProgram({COMPARE_MAPS_PROGRAM, folder(), "--peers", "none", "--json",
                                     temporary_ / "no/figures.json"});
  EXPECT_EQ(end.status, 1);
  EXPECT_NE(end.err.find("No such file or directory"), std::string::npos) << end.err;
}

}  // namespace
}  // namespace cuboid_mapping::bench::test
