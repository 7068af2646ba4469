// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/fleet_parameters.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <ros/names.h>

#include <utility>

namespace cuboid_mapping_ros {
namespace {

using P = NodeParameters;

bool setRobots(P& parameters, const std::string& text) {
  std::vector<std::string> robots = cuboid_mapping::wordsOf(text);
  for (const std::string& robot : robots) {
    std::string reason;
    if (!ros::names::validate(robot, reason) || robot[0] == '~') return false;
  }
  parameters.fleet.robots = std::move(robots);
  return true;
}

std::string getRobots(const P& parameters) {
  return cuboid_mapping::join(parameters.fleet.robots, " ");
}

}  // namespace

std::vector<ParameterDeclaration> declareFleet() {
  return {
      {"observation_rate", "kB/s",
       number({&P::fleet, &FleetParameters::observation_max_kb_s}, 0.0, 1e6),
       "Bytes of observations that a listener gets at most, answers of ~get_observations included. "
       "0: no bound."},
      {"observation_excess", "",
       choice<ObservationExcess>(
           {&P::fleet, &FleetParameters::observation_excess},
           {{"later", ObservationExcess::kLater}, {"thin", ObservationExcess::kThin}}),
       "What becomes of observations beyond observation_rate. later: they wait, the last 50 of "
       "them; "
       "those before can be asked for with observation_memory. thin: a cloud that comes while "
       "others "
       "use up the rate is in no observation, and is counted."},
      {"observation_memory", "MB",
       integer({&P::fleet, &FleetParameters::observation_memory_mb}, 0, 100000),
       "Memory for observations that were sent, so that a node that makes a map of several robots "
       "can ask for those it has missed. 0: none is kept."},
      {"merge/robots", "",
       parsedText("namespaces with spaces between them, or empty", false, setRobots, getRobots),
       "Namespaces of robots, as in \"/robot1 /robot2\": the map is made of what their nodes say "
       "(topic observations), not of clouds. Empty: of clouds."},
      {"merge/delay", "s", number({&P::fleet, &FleetParameters::merge_delay_s}, 0.0, 3600.0),
       "Time that observations have to arrive, before later ones go into the map. One that comes "
       "later goes in at once, and is counted."},
  };
}

}  // namespace cuboid_mapping_ros
