// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/fleet/observation_publisher.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/fleet/robots_feature.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <ros/names.h>

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
  parameters.fleet.robots = std::move(robots);
  return true;
}

std::string getRobots(const P& parameters) { return join(parameters.fleet.robots, " "); }

}  // namespace

std::vector<ParameterDeclaration> ObservationPublisher::declare() {
  return {
      {"observation_rate", "kB/s",
       number({&P::fleet, &FleetParameters::observation_max_kb_s}, 0.0, 1e6),
       "Maximum rate of observations to each listener. Answers of ~get_observations count. With "
       "observation_memory, the last 50 observations above the rate wait, and listeners can "
       "request older ones; without, they are dropped and counted. 0: no limit."},
      {"observation_memory", "MB",
       integer({&P::fleet, &FleetParameters::observation_memory_mb}, 0, 100000),
       "Memory for sent observations, so that merging nodes can request lost ones. 0: none is "
       "kept."},
  };
}

std::vector<ParameterDeclaration> RobotsFeature::declare() {
  return {
      {"merge/robots", "",
       parsedText("namespaces with spaces between them, or empty", false, setRobots, getRobots),
       "Namespaces of robots, as in \"/robot1 /robot2\". The node builds the map from the "
       "observations of their nodes, instead of clouds. Empty: from clouds."},
      {"merge/delay", "s", number({&P::fleet, &FleetParameters::merge_delay_s}, 0.0, 3600.0),
       "Time that an observation waits for earlier ones of other robots. Those that arrive even "
       "later enter the map at once, out of order, and are counted."},
  };
}

}  // namespace cuboid_mapping_ros
