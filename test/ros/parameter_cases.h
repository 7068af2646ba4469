// SPDX-License-Identifier: BSD-3-Clause
// Every parameter of the node, with accepted and refused values.
#pragma once

#include "cuboid_mapping/ros/parameters/parameters.h"

#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

using cuboid_mapping::Environment;
using XmlRpc::XmlRpcValue;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

inline XmlRpcValue makeList() {
  XmlRpcValue list;
  list[0] = 1;
  return list;
}

/// One parameter: an accepted value, its place, and refused values.
struct Case {
  std::string key;
  XmlRpcValue good;
  /// Null for the struct of a feature, at which the test in its folder looks.
  std::function<bool(const NodeParameters&)> arrives;
  std::vector<XmlRpcValue> bad;
};

inline std::vector<Case> mapCases() {
  using P = NodeParameters;
  return {
      {"frame_id", "odom", [](const P& p) { return p.frame_id == "odom"; }, {"", "/", 1, true}},
      {"sensor_frame",
       "lidar",
       [](const P& p) { return p.source.sensor_frame == "lidar"; },
       {true, 1.5}},
      {"resolution",
       0.2,
       [](const P& p) { return p.map.resolution_m == 0.2; },
       {0.0, -0.1, 0, 0.0009, 101.0, kNan, kInfinity, "0.1", true, makeList()}},
      {"environment",
       "static",
       [](const P& p) { return p.map.environment == Environment::kStatic; },
       {"", "Static", "frozen", 1}},
      {"forget_after",
       30.0,
       [](const P& p) { return p.source.forget_after_s == 30.0; },
       {-1.0, 1.1e6, kNan, "1"}},
      {"forget",
       "occupied",
       [](const P& p) { return p.forget == Forget::kOccupied; },
       {"", "both", 1}},
      {"moving_points",
       "leave_out",
       [](const P& p) { return p.moving_points == MovingPoints::kLeaveOut; },
       {"", "remove", 1}},
  };
}

inline std::vector<Case> fusionCases() {
  using P = NodeParameters;
  return {
      {"fusion",
       "none",
       [](const P& p) { return p.map.fusion == cuboid_mapping::FusionKind::kNone; },
       {"", "bricks", "brick", false}},
      {"threads", 3, [](const P& p) { return p.threads == 3; }, {-1, 257, 2.0, true}},
      {"ignore_unknown", true, [](const P& p) { return p.ignores_unknown; }, {1, "true"}},
  };
}

inline std::vector<Case> sensorModelCases() {
  using P = NodeParameters;
  return {
      {"sensor_model/hit",
       0.8,
       [](const P& p) { return p.source.sensor_model.hit == 0.8; },
       {0.5, 1.0, 1, 0.4, kNan, "0.7", true}},
      {"sensor_model/miss",
       0.3,
       [](const P& p) { return p.source.sensor_model.miss == 0.3; },
       {0.5, 0.0, 0, 0.6, kNan}},
      {"sensor_model/min",
       0.2,
       [](const P& p) { return p.source.sensor_model.alpha_min == 0.2; },
       {0.5, 0.0, -0.1, kNan}},
      {"sensor_model/max",
       0.9,
       [](const P& p) { return p.source.sensor_model.alpha_max == 0.9; },
       {0.5, 1.0, 1.1, kNan}},
      {"sensor_model/max_range",
       50.0,
       [](const P& p) { return p.source.max_range_m == 50.0; },
       {0.0, -2.0, -0.5, kNan, kInfinity}},
      {"sensor_model/keep_surfaces", true, [](const P& p) { return p.source.keep_surfaces; }, {}},
      {"sensor_model/min_range",
       1.5,
       [](const P& p) { return p.source.min_range_m == 1.5; },
       {-2.0, -0.5, kNan, kInfinity}},
      {"sensor_model/no_return_range",
       30.0,
       [](const P& p) { return p.source.no_return_range_m == 30.0; },
       {-1.0, 1001.0, kNan}},
      {"sensor_model/no_return_points",
       "with_nan",
       [](const P& p) { return p.source.no_return_points == NoReturnPoints::kWithNan; },
       {"", "infinity", 1}},
  };
}

/// Cases for parameters of a source, and the list of sources.
inline std::vector<Case> sourceCases() {
  using P = NodeParameters;
  XmlRpcValue list;
  list[0]["topic"] = "front";
  return {
      {"topic", "/scan", [](const P& p) { return p.source.topic == "/scan"; }, {"", "a b", 1}},
      {"type",
       "laser_scan",
       [](const P& p) { return p.source.type == SourceType::kLaserScan; },
       {"", "lidar", 1}},
      {"camera_info",
       "/info",
       [](const P& p) { return p.source.camera_info == "/info"; },
       {"a b", 1}},
      {"use", "mark", [](const P& p) { return p.source.use == SourceUse::kMark; }, {"", "none", 1}},
      {"max_rate",
       5.0,
       [](const P& p) { return p.source.max_rate_hz == 5.0; },
       {-1.0, 1001.0, kNan, "1"}},
      {"deskew", true, nullptr, {1, "true"}},
      {"length_unit",
       0.001,
       [](const P& p) { return p.source.length_unit_m == 0.001; },
       {-0.1, 1.5, kNan, "1"}},
      {"time_unit", 1e-6, nullptr, {-0.1, 1.5, kNan, "1"}},
      {"sources", list, [](const P& p) { return p.sources.size() == 1; }, {"front", 1, true}},
  };
}

inline XmlRpcValue makeBoxes(const std::string& frame_id, double min_z_m) {
  XmlRpcValue box;
  box["frame"] = frame_id;
  for (int axis = 0; axis < 3; ++axis) {
    box["min"][axis] = axis == 2 ? XmlRpcValue(min_z_m) : XmlRpcValue(-1);
    box["max"][axis] = 0.5;
  }
  XmlRpcValue list;
  list[0] = box;
  return list;
}

inline std::vector<Case> selfFilterCases() {
  XmlRpcValue no_corner = makeBoxes("base", 0.0);
  no_corner[0]["max"] = 1.0;
  XmlRpcValue text_corner = makeBoxes("base", 0.0);
  text_corner[0]["max"][1] = "1";
  XmlRpcValue unknown_key = makeBoxes("base", 0.0);
  unknown_key[0]["size"] = 1.0;
  return {
      {"self_filter/boxes",
       makeBoxes("/base", 0.25),
       nullptr,
       {"base", 1, makeList(), makeBoxes("", 0.0), makeBoxes("/", 0.0), makeBoxes("base", 0.5),
        makeBoxes("base", kNan), makeBoxes("base", -kInfinity), no_corner, text_corner,
        unknown_key}},
      {"self_filter/robot_description", "robot_description", nullptr, {1, true}},
      {"self_filter/padding", 0.1, nullptr, {-0.1, 1.1, kNan, "1"}},
      {"self_filter/ignored_links", "left_wheel right_wheel", nullptr, {1, makeList()}},
      {"self_filter/keep_free", false, nullptr, {1, "true"}},
  };
}

inline std::vector<Case> fleetCases() {
  using P = NodeParameters;
  return {
      {"observation_rate", 250.0, nullptr, {-1.0, 1.1e6, kNan, "1"}},
      {"observation_memory", 100, nullptr, {-1, 100001, 0.5, "1"}},
      {"merge/robots",
       "/robot1 robot2",
       [](const P& p) {
         return p.robots == std::vector<std::string>{"/robot1", "robot2"};
       },
       {"/robot 1", "~robot", "/a, /b", 1, true}},
      {"merge/delay", 5.0, nullptr, {-0.1, 3601.0, kNan, "1"}},
  };
}

/// Cases for limits of memory and time of requests.
inline std::vector<Case> limitCases() {
  using P = NodeParameters;
  return {
      {"query/max_time",
       2.5,
       [](const P& p) { return p.service_limits.max_time_s == 2.5; },
       {0.0, 1e4, kNan, "1"}},
      {"start_free",
       "-0.6 -0.6 0 0.6 0.6 0.8",
       nullptr,
       {"1 1 1 0 0 0", "a", "1 2 3", "0 0 0 1 1 1 1", 1}},
      {"robot_grid/frame", "base_link", nullptr, {true, 1.5}},
      {"robot_grid/size", 8.0, nullptr, {0.0, -1.0, 1001.0, kNan, "8"}},
      {"robot_grid/min_z", -0.5, nullptr, {kNan, kInfinity, "0", true}},
      {"robot_grid/max_z", 2.5, nullptr, {kNan, kInfinity, "0", true}},
  };
}

inline std::vector<Case> otherCases() {
  using P = NodeParameters;
  std::vector<Case> cases{
      {"publish_values", true, [](const P& p) { return p.publish_values; }, {0, 1, "true"}},
      {"queue_size", 3, [](const P& p) { return p.queue_size == 3; }, {0, -1, 1001, 3.0}},
      {"tf_wait", 0.5, [](const P& p) { return p.tf_wait_s == 0.5; }, {0.0, -1.0, 3601.0, kNan}},
      {"tf_gap", 0.5, [](const P& p) { return p.tf_gap_s == 0.5; }, {0.0, -1.0, 86401.0, kNan}},
      {"publish_rate",
       2.5,
       [](const P& p) { return p.publish_rate_hz == 2.5; },
       {0.0, -1.0, 101.0, kNan, "fast"}},
      {"map_file", "/a.bt", [](const P& p) { return p.map_file == "/a.bt"; }, {1, true}},
      {"autosave_file", "/b", [](const P& p) { return p.autosave_file == "/b"; }, {1.5, false}},
      {"autosave_period",
       5.0,
       [](const P& p) { return p.autosave_period_s == 5.0; },
       {0.5, 1e6, kNan, "1"}},
      {"keyframe_period",
       3.0,
       [](const P& p) { return p.keyframe_period_s == 3.0; },
       {-1.0, 1e6, kNan, "1"}},
  };
  for (int axis = 0; axis < 3; ++axis) {
    const std::string name(1, "xyz"[axis]);
    cases.push_back({"pointcloud_min_" + name,
                     -7.5,
                     [axis](const P& p) { return p.source.crop.min_m[axis] == -7.5; },
                     {kNan, -kInfinity, "-7.5"}});
    cases.push_back({"pointcloud_max_" + name,
                     8.5,
                     [axis](const P& p) { return p.source.crop.max_m[axis] == 8.5; },
                     {kNan, kInfinity, "1e9"}});
  }
  return cases;
}

inline Case groundCase(const std::string& key, double good) {
  return {"ground_filter/" + key, good, nullptr, {0.0, -0.1, 15.5, kNan, "0.1"}};
}

inline std::vector<Case> octomapServerCases() {
  std::vector<Case> cases{
      {"base_frame_id",
       "base_link",
       [](const NodeParameters& p) { return p.base_frame_id == "base_link"; },
       {"", "/", 1}},
      {"filter_ground",
       true,
       [](const NodeParameters& p) { return p.source.filter_ground; },
       {0, 1, "true"}},
      groundCase("distance", 0.1),
      groundCase("angle", 0.2),
      groundCase("plane_distance", 0.3),
      {"occupancy_min_z", -1.5, nullptr, {kNan, -kInfinity, "-1"}},
      {"occupancy_max_z", 2.5, nullptr, {kNan, kInfinity, "2"}},
      {"min_x_size", 10.0, nullptr, {-1.0, kNan, 1e9}},
      {"min_y_size", 20.0, nullptr, {-1.0, kNan, 1e9}},
      {"filter_speckles", true, nullptr, {0, 1, "true"}},
  };
  return cases;
}

}  // namespace cuboid_mapping_ros
