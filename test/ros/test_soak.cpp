// SPDX-License-Identifier: BSD-3-Clause
// The node under load for a while: clouds at 10 Hz, subscribers to everything, saves, edits, queries and
// changes of parameters. Every lost cloud has a counted reason, no call fails, memory does not grow.
// Needs the feature octomap_server.
#include "cuboid_mapping/SaveMap.h"
#include "ros/node_probe.h"
#include "tools/run_program.h"

#include <dynamic_reconfigure/Reconfigure.h>
#include <nav_msgs/OccupancyGrid.h>
#include <octomap_msgs/BoundingBoxQuery.h>
#include <octomap_msgs/GetOctomap.h>
#include <ros/network.h>
#include <visualization_msgs/MarkerArray.h>
#include <xmlrpcpp/XmlRpcClient.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include <fstream>
#include <iostream>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

/// Process id of the node, from the node itself.
int findPid() {
  XmlRpc::XmlRpcValue request;
  XmlRpc::XmlRpcValue response;
  XmlRpc::XmlRpcValue payload;
  request[0] = ros::this_node::getName();
  request[1] = std::string(kNode);
  if (!ros::master::execute("lookupNode", request, response, payload, true)) return -1;
  std::string host;
  std::uint32_t port = 0;
  if (!ros::network::splitURI(std::string(payload), host, port)) return -1;
  XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
  XmlRpc::XmlRpcValue caller;
  caller[0] = ros::this_node::getName();
  if (!client.execute("getPid", caller, response)) return -1;
  return static_cast<int>(response[2]);
}

/// Memory of a process in MB.
double residentMb(int pid) {
  std::ifstream statm("/proc/" + std::to_string(pid) + "/statm");
  double total = 0.0;
  double resident = 0.0;
  statm >> total >> resident;
  return resident * 4096e-6;
}

/// Counts the messages of a topic.
template <typename MessageT>
class Listener {
 public:
  explicit Listener(const std::string& topic) {
    const boost::function<void(const boost::shared_ptr<const MessageT>&)> callback =
        [this](const boost::shared_ptr<const MessageT>&) { ++count_; };
    subscriber_ = nh_.subscribe(topic, 1, callback);
  }
  [[nodiscard]] int count() const { return count_; }

 private:
  ros::NodeHandle nh_;
  int count_ = 0;
  ros::Subscriber subscriber_;
};

/// Work that is repeated.
struct Task {
  const char* name;
  double period_s;
  std::function<bool()> run;
  int num_done = 0;
  int num_failed = 0;
  ros::WallTime due = ros::WallTime::now();
};

bool saveTo(const std::string& file) {
  cuboid_mapping::SaveMap save;
  save.request.filename = file;
  return callService(std::string(kNode) + "/save_map", save) && save.response.info.success != 0;
}

bool getOctree() {
  octomap_msgs::GetOctomap get;
  return callService("/octomap_full", get) && !get.response.map.data.empty();
}

bool clearSomeBox() {
  octomap_msgs::BoundingBoxQuery clear;
  clear.request.min = tf2::toMsg(Eigen::Vector3d(-1, -1, 0));
  clear.request.max = tf2::toMsg(Eigen::Vector3d(1, 1, 2));
  return callService(std::string(kNode) + "/clear_bbx", clear);
}

bool changeParameters(bool is_odd) {
  dynamic_reconfigure::Reconfigure change;
  change.request.config.doubles.resize(2);
  change.request.config.doubles[0].name = "sensor_model_max_range";
  change.request.config.doubles[0].value = is_odd ? 20.0 : 15.0;
  change.request.config.doubles[1].name = "occupancy_max_z";
  change.request.config.doubles[1].value = is_odd ? 2.0 : 100.0;
  return callService(std::string(kNode) + "/set_parameters", change);
}

long sumOfReasons(const NodeStatus& status) {
  long sum = 0;
  for (const auto& [key, value] : status.values) {
    if (key.rfind("clouds dropped, ", 0) == 0) sum += std::stol(value);
  }
  return sum;
}

TEST(Soak, NothingIsLostUncountedAndMemoryStays) {
  double duration_s = 60.0;
  ros::param::param("~duration", duration_s, duration_s);
  DiagnosticsProbe diagnostics;
  ASSERT_TRUE(waitFor([&] { return diagnostics.status().number("clouds inserted") > 5; }));
  const int pid = findPid();
  ASSERT_GT(pid, 0);
  const Listener<octomap_msgs::Octomap> full("/octomap_full");
  const Listener<visualization_msgs::MarkerArray> cells("/occupied_cells_vis_array");
  const Listener<visualization_msgs::MarkerArray> cuboids("/occupied_cuboids");
  const Listener<nav_msgs::OccupancyGrid> grid("/projected_map");
  const cuboid_mapping::test::TemporaryFolder folder;
  bool is_odd = false;
  std::vector<Task> tasks{{"save", 5.0, [&] { return saveTo(folder / "map.cuboids"); }},
                          {"octree", 2.0, getOctree},
                          {"clear", 7.0, clearSomeBox},
                          {"change", 3.0, [&] { return changeParameters(is_odd = !is_odd); }}};
  std::vector<double> resident_mb;
  const ros::WallTime start = ros::WallTime::now();
  ros::WallTime next_sample = start;
  while (ros::ok() && (ros::WallTime::now() - start).toSec() < duration_s) {
    ros::spinOnce();
    for (Task& task : tasks) {
      if (ros::WallTime::now() < task.due) continue;
      task.due = ros::WallTime::now() + ros::WallDuration(task.period_s);
      ++task.num_done;
      task.num_failed += task.run() ? 0 : 1;
    }
    if (ros::WallTime::now() >= next_sample) {
      next_sample += ros::WallDuration(1.0);
      resident_mb.push_back(residentMb(pid));
    }
    ros::WallDuration(0.01).sleep();
  }
  for (const Task& task : tasks) {
    EXPECT_EQ(task.num_failed, 0) << task.name << " of " << task.num_done;
    EXPECT_GT(task.num_done, 3) << task.name;
  }
  ASSERT_TRUE(diagnostics.waitForNextReport());
  const NodeStatus& status = diagnostics.status();
  const long num_dropped = status.number("clouds dropped");
  EXPECT_EQ(status.number("clouds received"),
            status.number("clouds inserted") + num_dropped + status.number("clouds waiting"));
  EXPECT_EQ(sumOfReasons(status), num_dropped) << "each has a reason";
  EXPECT_GT(status.number("clouds inserted"), 50);
  EXPECT_GT(full.count(), 3);
  EXPECT_GT(cells.count(), 3);
  EXPECT_GT(cuboids.count(), 3);
  EXPECT_GT(grid.count(), 3);
  std::cout << "clouds received " << status.number("clouds received") << ", inserted "
            << status.number("clouds inserted") << ", dropped " << num_dropped << "; memory in MB";
  for (std::size_t i = 0; i <= 8; ++i) {
    std::cout << ' ' << resident_mb[i * (resident_mb.size() - 1) / 8];
  }
  std::cout << std::endl;
  // One loop takes about three minutes: afterwards nothing new is seen.
  if (duration_s >= 900.0) {
    EXPECT_LT(resident_mb.back(), 1.1 * resident_mb[resident_mb.size() / 2]);
  }
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
