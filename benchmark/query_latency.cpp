// SPDX-License-Identifier: BSD-3-Clause
// How long a planner waits for ~query_box of a running node: boxes at random places around a frame.
#include "timing.h"

#include "command_line.h"

#include "cuboid_mapping/QueryBox.h"
#include "cuboid_mapping/ros/conversions/points.h"

#include <ros/ros.h>

#include <Eigen/Core>

#include <iostream>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace cuboid_mapping::bench {
namespace {

struct LatencyOptions {
  std::string service = "/cuboid_mapping/query_box";
  std::string frame_id = "velodyne";
  double edge_m = 2.0;
  double radius_m = 20.0;
  double pause_ms = 2.0;
  double duration_s = 10.0;
};

std::optional<int> parseOptions(int argc, char** argv, LatencyOptions& options) {
  CommandLine line("query_latency",
                   "Measures the latency of ~query_box of a running node, at a client.");
  line.addText("service", options.service, "~query_box of the node");
  line.addText("frame", options.frame_id, "frame of the boxes, which lie around its origin");
  line.addNumber("edge", options.edge_m, "edge of a box [m]");
  line.addNumber("radius", options.radius_m,
                 "largest distance of a box from the origin on each axis [m]");
  line.addNumber("pause", options.pause_ms, "pause between an answer and the next request [ms]");
  line.addNumber("duration", options.duration_s, "duration of the measurement [s]");
  return line.parse(argc, argv);
}

int run(int argc, char** argv) {
  ros::init(argc, argv, "query_latency", ros::init_options::AnonymousName);
  LatencyOptions options;
  if (const auto status = parseOptions(argc, argv, options)) return *status;
  ros::NodeHandle nh;
  auto client = nh.serviceClient<QueryBox>(options.service, true);
  if (!client.waitForExistence(ros::Duration(10.0))) {
    throw std::runtime_error("there is no " + options.service + ": start the node first");
  }
  std::mt19937 random(1);
  std::uniform_real_distribution<> offset(-options.radius_m, options.radius_m);
  std::vector<double> latencies_ms;
  std::size_t num_refused = 0;
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(options.duration_s);
  while (ros::ok() && ros::WallTime::now() < end) {
    QueryBox query;
    query.request.header.frame_id = options.frame_id;
    const Eigen::Vector3d center(offset(random), offset(random), 0.1 * offset(random));
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * options.edge_m);
    query.request.min = cuboid_mapping_ros::toPoint(center - half);
    query.request.max = cuboid_mapping_ros::toPoint(center + half);
    bool is_answered = false;
    const Timing timing = timeOf([&] { is_answered = client.call(query); });
    if (!is_answered) throw std::runtime_error(options.service + " is gone");
    // Before the first transform has come there is no answer to measure.
    if (query.response.success != 0) {
      latencies_ms.push_back(1e3 * timing.wall_s);
    } else {
      ++num_refused;
    }
    ros::WallDuration(1e-3 * options.pause_ms).sleep();
  }
  std::cout << latencies_ms.size() << " answers: p50 " << quantile(latencies_ms, 0.5) << " ms, p99 "
            << quantile(latencies_ms, 0.99) << " ms, max " << quantile(latencies_ms, 1.0) << " ms; "
            << num_refused << " refused" << std::endl;
  return latencies_ms.empty() ? 1 : 0;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runProgram("query_latency",
                                    [&] { return cuboid_mapping::bench::run(argc, argv); });
}
