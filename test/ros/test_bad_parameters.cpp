// SPDX-License-Identifier: BSD-3-Clause
// Node and nodelet with bad parameters: they report the errors, and do not start.
#include "cuboid_mapping/QueryBox.h"
#include "cuboid_mapping/io/map_files.h"
#include "ros/log_probe.h"
#include "tools/run_program.h"

#include <fcntl.h>
#include <nodelet/NodeletList.h>
#include <nodelet/NodeletLoad.h>
#include <ros/service.h>
#include <std_srvs/Empty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

/// Output and end of a program.
struct Ending {
  std::string output;
  int exit_code = -1;
};

Ending run(const std::string& command) {
  Ending ending;
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return ending;
  std::array<char, 4096> buffer;
  std::size_t size = 0;
  while ((size = fread(buffer.data(), 1, buffer.size(), pipe)) > 0) {
    ending.output.append(buffer.data(), size);
  }
  const int status = pclose(pipe);
  if (WIFEXITED(status)) ending.exit_code = WEXITSTATUS(status);
  return ending;
}

TEST(BadParameters, TheNodeNamesThemAllAndEndsWithAnError) {
  // `timeout` returns 124 if the node runs.
  const Ending ending =
      run("timeout --kill-after=5 60 " CUBOID_MAPPING_NODE " __name:=bad_node __log:=/dev/null");
  EXPECT_EQ(ending.exit_code, 1) << ending.output;
  for (const std::string key : {"~resolution", "~publish_rat", "~fusion"}) {
    EXPECT_NE(ending.output.find(key + " is "), std::string::npos) << ending.output;
  }
  EXPECT_NE(ending.output.find("not started: 3 bad parameters"), std::string::npos)
      << ending.output;
}

TEST(BadParameters, AValueInPlaceOfThemAllIsNamedAsOne) {
  const Ending ending =
      run("timeout --kill-after=5 60 " CUBOID_MAPPING_NODE " __name:=bad_group __log:=/dev/null");
  EXPECT_EQ(ending.exit_code, 1) << ending.output;
  EXPECT_NE(ending.output.find(": ~ is 5, but must be a group of keys"), std::string::npos)
      << ending.output;
}

TEST(BadParameters, ASecondNodeOfANameEndsAndTheFirstGoesOn) {
  const std::string reset = "/good_node/reset";
  ASSERT_TRUE(ros::service::waitForService(reset, ros::Duration(60.0)));
  const Ending ending =
      run("timeout --kill-after=5 60 " CUBOID_MAPPING_NODE " __name:=good_node __log:=/dev/null");
  EXPECT_EQ(ending.exit_code, 1) << ending.output;
  EXPECT_NE(ending.output.find("not started: a node /good_node runs already"), std::string::npos)
      << ending.output;
  std_srvs::Empty empty;
  EXPECT_TRUE(ros::service::call(reset, empty));
}

TEST(BadParameters, ANodeStartsWhereOneOfItsNameWasKilled) {
  // The killed one leaves its address with the master. `timeout` returns 124 if the node runs.
  const std::string node = CUBOID_MAPPING_NODE " __name:=killed_node __log:=/dev/null";
  EXPECT_NE(run("timeout --signal=KILL 6 " + node).exit_code, 1) << "it ended by itself";
  EXPECT_EQ(run("timeout --kill-after=5 6 " + node).exit_code, 124);
}

TEST(BadArguments, TheNodeExplainsItselfInPlaceOfLoadingAMap) {
  const std::string node = "timeout --kill-after=5 60 " CUBOID_MAPPING_NODE " __log:=/dev/null ";
  const Ending help = run(node + "--help");
  EXPECT_EQ(help.exit_code, 0) << help.output;
  EXPECT_EQ(help.output.rfind("Usage: cuboid_mapping_node [MAP]", 0), 0U) << help.output;
  for (const std::string arguments : {"--resolution", "first.bt second.bt", "resolution:=0.1"}) {
    const Ending ending = run(node + arguments);
    EXPECT_EQ(ending.exit_code, 1) << ending.output;
    EXPECT_NE(ending.output.find("Usage:"), std::string::npos) << ending.output;
  }
}

/// Whether the manager has loaded the nodelet.
bool loadNodelet(const std::string& name) {
  nodelet::NodeletLoad load;
  load.request.name = name;
  load.request.type = "cuboid_mapping/MappingNodelet";
  return ros::service::call("/manager/load_nodelet", load) && load.response.success != 0;
}

TEST(BadParameters, TheNodeletFailsToLoadAndLoadsOnceTheyAreRight) {
  LogProbe log;
  ASSERT_TRUE(ros::service::waitForService("/manager/load_nodelet", ros::Duration(kDeadline_s)));
  const ros::NodeHandle nh("/bad_nodelet");
  nh.setParam("resolution", -0.5);
  nh.setParam("publish_rat", 1.0);
  // Repeated, because the first lines of the log may come before the subscriber is connected.
  EXPECT_TRUE(waitFor([&] {
    EXPECT_FALSE(loadNodelet("/bad_nodelet"));
    ros::WallDuration(0.2).sleep();
    ros::spinOnce();
    return log.has("not started: 2 bad parameters: ~resolution is -0.5") && log.has("~publish_rat");
  }));
  EXPECT_FALSE(ros::service::exists("/bad_nodelet/query_box", false));

  // The other nodelet of the manager still works.
  EXPECT_TRUE(ros::service::waitForService("/good_nodelet/query_box", ros::Duration(kDeadline_s)));
  nodelet::NodeletList list;
  EXPECT_TRUE(ros::service::call("/manager/list", list));
  EXPECT_EQ(list.response.nodelets, std::vector<std::string>{"/good_nodelet"});

  nh.setParam("resolution", 0.5);
  nh.deleteParam("publish_rat");
  EXPECT_TRUE(loadNodelet("/bad_nodelet"));
  EXPECT_TRUE(ros::service::waitForService("/bad_nodelet/query_box", ros::Duration(kDeadline_s)));
}

TEST(StartMaps, TheManagerDoesNotWaitForAMapFile) {
  ASSERT_TRUE(ros::service::waitForService("/manager/load_nodelet", ros::Duration(kDeadline_s)));
  const cuboid_mapping::test::TemporaryFolder folder;
  const std::string file = folder / "map.cuboids";
  cuboid_mapping::CuboidMap map(cuboid_mapping::MapConfig{});
  const cuboid_mapping::CellBox box{{0, 0, 0}, {8, 8, 8}};
  (void)map.replace(box, {{box, 1.0F}});
  (void)saveMap(map, file, "map");
  // Who opens a file with a lease waits for its end, 45 s at most.
  const int leased = open(file.c_str(), O_RDONLY);
  (void)std::signal(SIGIO, SIG_IGN);
  if (fcntl(leased, F_SETLEASE, F_WRLCK) != 0) GTEST_SKIP() << "no leases in this file system";
  ros::NodeHandle("/slow_nodelet").setParam("map_file", file);
  const DiagnosticsProbe probe("/slow_nodelet");
  EXPECT_TRUE(loadNodelet("/slow_nodelet"));
  ros::NodeHandle("/lost_nodelet").setParam("map_file", folder / "none.cuboids");
  EXPECT_FALSE(loadNodelet("/lost_nodelet")) << "there is no such file";
  EXPECT_FALSE(ros::service::exists("/slow_nodelet/query_box", false));
  EXPECT_TRUE(waitFor([&] { return probe.numReports() > 0; }));
  EXPECT_EQ(probe.status().message, "reads " + file + ": no cloud is mapped yet");

  (void)fcntl(leased, F_SETLEASE, F_UNLCK);
  (void)close(leased);
  ASSERT_TRUE(ros::service::waitForService("/slow_nodelet/query_box", ros::Duration(kDeadline_s)));
  cuboid_mapping::QueryBox query;
  query.request.max.x = query.request.max.y = query.request.max.z = 0.4;
  ASSERT_TRUE(ros::service::call("/slow_nodelet/query_box", query));
  EXPECT_EQ(query.response.occupancy, cuboid_mapping::QueryBox::Response::OCCUPIED);
}

TEST(StartMaps, ANodeletThatCannotReadItsMapSaysSoInDiagnostics) {
  ASSERT_TRUE(ros::service::waitForService("/manager/load_nodelet", ros::Duration(kDeadline_s)));
  const cuboid_mapping::test::TemporaryFolder folder;
  const std::string file = folder / "map.cuboids";
  std::ofstream(file) << "no map";
  ros::NodeHandle("/damaged_nodelet").setParam("map_file", file);
  const DiagnosticsProbe probe("/damaged_nodelet");
  EXPECT_TRUE(loadNodelet("/damaged_nodelet"));
  EXPECT_TRUE(
      waitFor([&] { return probe.status().level == diagnostic_msgs::DiagnosticStatus::ERROR; }));
  EXPECT_NE(probe.status().message.find("not started: " + file), std::string::npos)
      << probe.status().message;
}

TEST(BadParameters, TheLoaderOfANodeletEnds) {
  ASSERT_TRUE(ros::service::waitForService("/manager/load_nodelet", ros::Duration(kDeadline_s)));
  const Ending ending =
      run("timeout --kill-after=5 60 rosrun nodelet nodelet load cuboid_mapping/MappingNodelet "
          "/manager __name:=bad_node __log:=/dev/null");
  EXPECT_NE(ending.exit_code, 0) << ending.output;
  EXPECT_NE(ending.exit_code, 124) << ending.output;
  EXPECT_NE(ending.output.find("Failed to load nodelet"), std::string::npos) << ending.output;
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
