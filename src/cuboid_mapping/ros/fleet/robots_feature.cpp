// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/fleet/robots_feature.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <ros/names.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using P = NodeParameters;

bool setRobots(P& parameters, const std::string& text) {
  std::vector<std::string> robots = wordsOf(text);
  for (const std::string& robot : robots) {
    std::string reason;
    if (!ros::names::validate(robot, reason) || robot[0] == '~') return false;
  }
  parameters.robots = std::move(robots);
  return true;
}

std::string getRobots(const P& parameters) { return join(parameters.robots, " "); }

}  // namespace

RobotsFeature::RobotsFeature(const MapHost& host)
    : merging_thread_(host.guard, "merging"),
      asking_threads_(host.guard, "asking robots",
                      static_cast<std::uint32_t>(host.parameters.robots.size()) + 1) {
  RobotMerger::Callbacks callbacks;
  callbacks.is_paused = host.is_paused;
  callbacks.note = [&host](const RobotObservation& observation, bool is_in_map) {
    std_msgs::Header header;
    header.frame_id = withoutSlash(host.parameters.frame_id);
    header.stamp = stampOf(observation);
    host.note_received(header);
    const MappedCloud cloud{0,
                            header.stamp,
                            Eigen::Vector3d::Zero(),
                            observation.sensor_model,
                            observation.update,
                            observation.update};
    host.note_mapped(is_in_map ? &cloud : nullptr);
  };
  merger_.emplace(withQueue(host.nh, merging_thread_.queue()),
                  withQueue(host.nh, asking_threads_.queue()), host.parameters, host.map,
                  std::move(callbacks));
}

RobotsFeature::~RobotsFeature() { stop(); }

void RobotsFeature::start() {
  merging_thread_.start();
  asking_threads_.start();
}

void RobotsFeature::stop() noexcept {
  merger_->stopAsking();
  merging_thread_.stop();  // It tells the other features of observations.
  asking_threads_.stop();
}

void RobotsFeature::addStatus(diagnostic_updater::Updater& diagnostics) {
  diagnostics.add("merging", &*merger_, &RobotMerger::fillStatus);
}

std::vector<ParameterDeclaration> RobotsFeature::declare() {
  return {
      {"merge/robots", "",
       parsedText("namespaces with spaces between them, or empty", false, setRobots, getRobots),
       "Namespaces of robots, as in \"/robot1 /robot2\". The node builds the map from the "
       "observations of their nodes, instead of clouds. Empty: from clouds."},
      {"merge/delay", "s", number(&MergeParameters::delay_s, 0.0, 3600.0),
       "Time that an observation waits for earlier ones of other robots. Those that arrive even "
       "later enter the map at once, out of order, and are counted."},
  };
}

}  // namespace cuboid_mapping_ros
