// SPDX-License-Identifier: BSD-3-Clause
// Parameters of parts that are off by default: the window, kept clouds, fleets, the self filter.
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/names.h>

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
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

using F = SelfFilterParameters;
using XmlRpc::XmlRpcValue;

/// Three numbers; nothing for another value.
std::optional<Eigen::Vector3d> readCorner(XmlRpcValue list) {
  if (list.getType() != XmlRpcValue::TypeArray || list.size() != 3) return std::nullopt;
  Eigen::Vector3d corner;
  for (int axis = 0; axis < 3; ++axis) {
    const auto number = numberOf(list[axis]);
    if (!number) return std::nullopt;
    corner[axis] = *number;
  }
  return corner;
}

/// Adds a box. @return Reason of refusal; empty if it is added.
std::string addBox(const XmlRpcValue& group, RobotParts& boxes) {
  if (group.getType() != XmlRpcValue::TypeStruct) return "is no group of keys";
  for (const auto& [key, value] : group) {
    if (key != "frame" && key != "min" && key != "max") return "has an unknown key " + key;
  }
  const std::string frame =
      withoutSlash(textOf(findValue(group, "frame").value_or("")).value_or(""));
  if (frame.empty()) return "needs a frame";
  const auto min_m = readCorner(findValue(group, "min").value_or(XmlRpcValue()));
  if (!min_m) return "needs min: [x, y, z]";
  const auto max_m = readCorner(findValue(group, "max").value_or(XmlRpcValue()));
  if (!max_m) return "needs max: [x, y, z]";
  if (!(min_m->array() < max_m->array()).all() || !min_m->allFinite() || !max_m->allFinite()) {
    return "needs a min that is less than its max along each axis";
  }
  boxes.push_back(makeBoxPart(frame, {*min_m, *max_m}));
  return {};
}

std::string setBoxes(P& p, const XmlRpcValue& list) {
  if (!list.valid()) return {};  // No list is given.
  if (list.getType() != XmlRpcValue::TypeArray) return "begin each box with a dash";
  RobotParts boxes;
  for (int i = 0; i < list.size(); ++i) {
    const std::string refusal = addBox(list[i], boxes);
    if (!refusal.empty()) return "box " + std::to_string(i) + ' ' + refusal;
  }
  p.self_filter.boxes = std::move(boxes);
  p.self_filter.box_list = list;
  return {};
}

ParameterKind boxesKind() {
  ParameterKind kind{"a list of groups {frame: base_link, min: [x, y, z], max: [x, y, z]}"};
  kind.set = setBoxes;
  kind.get = [](const P& p) { return p.self_filter.box_list; };
  return kind;
}

}  // namespace

std::vector<ParameterDeclaration> declareWindow() {
  return {
      {"window/frame", "", frame({&P::window, &WindowParameters::frame_id}, true),
       "Frame of the robot. Only the map around it stays in memory. Its position is taken at the "
       "stamp of each cloud. Empty: the whole map stays."},
      {"window/size", "m",
       number({&P::window, &WindowParameters::config, &WindowConfig::size_m}, 0.1, 1e6),
       "Edge of the window, a cube along the axes of the map."},
      {"window/margin", "m",
       number({&P::window, &WindowParameters::config, &WindowConfig::margin_m}, 0.0, 1e6),
       "A part of the map leaves memory only beyond this distance from the window."},
      {"window/outside", "",
       choice<OutsideWindow>({&P::window, &WindowParameters::config, &WindowConfig::outside},
                             {{"keep", OutsideWindow::kKeep},
                              {"forget", OutsideWindow::kForget},
                              {"refuse", OutsideWindow::kRefuse}}),
       "What happens to the map outside the window. keep: it moves to window/file, and returns "
       "before a beam reaches it. forget: it becomes unknown. refuse: it becomes unknown, and "
       "clouds do not change it."},
      {"window/file", "", file({&P::window, &WindowParameters::file}),
       "SQLite file of the map, with window/outside: keep. The node continues the map in this "
       "file, or creates it. bag_to_map uses its output file instead."},
      {"window/queries", "",
       choice<QueriesOutside>(
           {&P::service_limits, &ServiceLimits::outside},
           {{"refuse", QueriesOutside::kRefuse}, {"load", QueriesOutside::kLoad}}),
       "Service calls about parts of the map that are in window/file only. refuse: the answer says "
       "so, and octomap_full and octomap_binary fail. load: these parts are loaded first."},
  };
}

std::vector<ParameterError> checkWindow(const NodeParameters& parameters) {
  if (!parameters.window.isOn()) return {};
  std::vector<ParameterError> errors;
  if (!parameters.fleet.robots.empty()) {
    errors.push_back({"window/frame",
                      "does not go with merge/robots: their clouds have several places. Remove one "
                      "of them"});
  }
  if (!parameters.window.keeps()) return errors;
  if (parameters.window.file.empty()) {
    errors.push_back({"window/file",
                      "is empty, but window/outside is keep: name a file, or set window/outside to "
                      "forget"});
  }
  if (parameters.source.forget_after_s > 0.0) {
    errors.push_back({"forget_after",
                      "does not go with window/outside: keep, because voxels on disk would not be "
                      "forgotten: change one of them"});
  }
  if (!parameters.map_file.empty()) {
    errors.push_back(
        {"map_file",
         "does not go with window/outside: keep, which starts with window/file: remove "
         "it, and make window/file of it with map_convert"});
  }
  return errors;
}

std::string describePages(std::size_t num_pages) {
  return counted(num_pages, "part") + " of the map, of 64 x 64 x 64 voxels";
}

std::unique_ptr<MapWindow> makeWindow(const NodeParameters& parameters, CuboidMap& map) {
  const WindowParameters& window = parameters.window;
  if (!window.isOn()) return nullptr;
  // Checked again: a map to start with may come from the command line.
  for (const ParameterError& error : checkWindow(parameters)) {
    throw std::runtime_error(error.key + ' ' + error.message);
  }
  std::unique_ptr<MapStore> store;
  if (window.keeps()) {
    store = openStoreOf({map.config().resolution_m,
                         map.config().sensor_model,
                         map.config().environment,
                         withoutSlash(parameters.frame_id),
                         {}},
                        window.file);
  }
  return std::make_unique<MapWindow>(window.config, std::move(store), map);
}

std::vector<ParameterDeclaration> declareKeep() {
  return {
      {"keep_clouds/memory", "MB", integer({&P::keep, &KeepParameters::memory_mb}, 0, 1000000),
       "Memory for kept clouds, from which ~correct_poses and corrected_path rebuild the map. A "
       "point takes 1 to 2 bytes, and is rounded to a sixteenth of a voxel. When the memory is "
       "full, the oldest clouds become a fixed part of the map. A rebuild needs memory for a "
       "second whole map, also with a window. 0: no cloud is kept."},
      {"keep_clouds/max_age", "s", number({&P::keep, &KeepParameters::max_age_s}, 0.1, 1e9),
       "Largest age of a kept cloud, relative to the newest one. Older clouds become a fixed part "
       "of the map."},
      {"keep_clouds/body_frame", "", frame({&P::keep, &KeepParameters::body_frame}, true),
       "Frame whose poses corrected_path and ~correct_poses give, such as base_link. Empty: the "
       "frame of each cloud."},
      {"keep_clouds/tolerance", "m", number({&P::keep, &KeepParameters::tolerance_m}, 0.0, 1000.0),
       "A path on corrected_path moves a cloud only if a point 10 m from the body moves by more "
       "than this. A path that moves no cloud is ignored."},
  };
}

std::vector<ParameterError> checkKeep(const NodeParameters& parameters) {
  if (!parameters.keep.isOn()) return {};
  std::vector<ParameterError> errors;
  const auto refuse = [&](const std::string& key, const std::string& why) {
    errors.push_back(
        {"keep_clouds/memory", "does not go with " + key + ": " + why + ". Change one of them"});
  };
  if (!parameters.fleet.robots.empty()) {
    refuse("merge/robots", "this node does not get the robots' clouds");
  }
  if (parameters.source.forget_after_s > 0.0) {
    refuse("forget_after", "a rebuilt map would have the forgotten voxels again");
  }
  if (parameters.moving_points == MovingPoints::kLeaveOut) {
    refuse("moving_points: leave_out", "which points move depends on the poses");
  }
  if (parameters.window.isOn() && !parameters.window.keeps()) {
    refuse("this window/outside", "voxels outside would come back");
  }
  return errors;
}

std::vector<ParameterDeclaration> declareFleet() {
  return {
      {"observation_rate", "kB/s",
       number({&P::fleet, &FleetParameters::observation_max_kb_s}, 0.0, 1e6),
       "Maximum rate of observations to each listener. Answers of ~get_observations count. 0: no "
       "limit."},
      {"observation_excess", "",
       choice<ObservationExcess>(
           {&P::fleet, &FleetParameters::observation_excess},
           {{"later", ObservationExcess::kLater}, {"thin", ObservationExcess::kThin}}),
       "What happens to observations above observation_rate. later: the last 50 of them wait; with "
       "observation_memory, listeners can request older ones. thin: they are dropped and counted."},
      {"observation_memory", "MB",
       integer({&P::fleet, &FleetParameters::observation_memory_mb}, 0, 100000),
       "Memory for sent observations, so that merging nodes can request lost ones. 0: none is "
       "kept."},
      {"merge/robots", "",
       parsedText("namespaces with spaces between them, or empty", false, setRobots, getRobots),
       "Namespaces of robots, as in \"/robot1 /robot2\". The node builds the map from the "
       "observations of their nodes, instead of clouds. Empty: from clouds."},
      {"merge/delay", "s", number({&P::fleet, &FleetParameters::merge_delay_s}, 0.0, 3600.0),
       "Time that an observation waits for earlier ones of other robots. An earlier one that "
       "arrives after that enters the map out of order, at once, and is counted."},
  };
}

std::vector<ParameterDeclaration> declareSelfFilter() {
  return {
      {"self_filter/boxes", "m", boxesKind(),
       "Boxes on the robot, each fixed in a frame. Points in them are ignored."},
      {"self_filter/robot_description", "",
       text("a parameter, or empty", {&P::self_filter, &F::robot_description}),
       "Name of a parameter with a URDF, such as robot_description. Points in the collision shapes "
       "of its links neither mark nor clear. The node reads it at the start. Empty: none."},
      {"self_filter/urdf_file", "", file({&P::self_filter, &F::urdf_file}),
       "URDF file in place of robot_description: for bag_to_map, which has no parameter server."},
      {"self_filter/padding", "m", number({&P::self_filter, &F::padding_m}, 0.0, 1.0),
       "Enlarges the URDF shapes by this margin. Boxes keep their size."},
      {"self_filter/ignored_links", "",
       text("names of links", {&P::self_filter, &F::ignored_links}),
       "Names of URDF links to ignore, separated by spaces, such as links without a transform."},
      {"self_filter/keep_free", "", boolean({&P::self_filter, &F::keep_free}),
       "true: each cloud also frees the voxels whose centre lies in the robot, as a passing beam "
       "does. Here the shapes have no padding."},
  };
}

}  // namespace cuboid_mapping_ros
