// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/parameters.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <ros/names.h>

#include <utility>

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

std::vector<ParameterDeclaration> declareFleet() {
  return {
      {"observation_rate", "kB/s",
       number({&P::fleet, &FleetParameters::observation_max_kb_s}, 0.0, 1e6),
       "Maximum rate of observations to each listener, answers of ~get_observations included. 0: "
       "no limit."},
      {"observation_excess", "",
       choice<ObservationExcess>(
           {&P::fleet, &FleetParameters::observation_excess},
           {{"later", ObservationExcess::kLater}, {"thin", ObservationExcess::kThin}}),
       "Observations above observation_rate. later: they wait, the last 50 of them; older ones can "
       "be asked for with observation_memory. thin: drops the observation when the rate limit is "
       "reached, and counts it."},
      {"observation_memory", "MB",
       integer({&P::fleet, &FleetParameters::observation_memory_mb}, 0, 100000),
       "Memory for sent observations, so that a node that merges maps can ask for lost ones. 0: "
       "none is kept."},
      {"merge/robots", "",
       parsedText("namespaces with spaces between them, or empty", false, setRobots, getRobots),
       "Namespaces of robots, as in \"/robot1 /robot2\": the map is made of the observations of "
       "their nodes, not of clouds. Empty: of clouds."},
      {"merge/delay", "s", number({&P::fleet, &FleetParameters::merge_delay_s}, 0.0, 3600.0),
       "An observation waits this long for earlier ones of other robots. Observations that arrive "
       "after that enter the map at once, and are counted."},
  };
}

}  // namespace cuboid_mapping_ros
