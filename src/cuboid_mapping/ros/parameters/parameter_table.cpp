// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include "cuboid_mapping/fusion/fusion_kind.h"
#include "cuboid_mapping/ros/parameters/reconfigure.h"

#include <algorithm>

namespace cuboid_mapping_ros {
namespace {

using P = NodeParameters;
using S = SourceParameters;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<ParameterDeclaration> declareMap() {
  return {
      {"frame_id", "", frame(&P::frame_id, false), "Frame of the map."},
      {"sensor_frame", "", frame(&S::sensor_frame, true),
       "Frame of the sensor, where the beams start. Empty: the frame of the cloud. Set it if the "
       "clouds have been transformed out of their sensor's frame."},
      {"resolution", "m", number({&P::map, &MapConfig::resolution_m}, 1e-3, 1e2),
       "Edge length of a voxel, the smallest cell of the map."},
      {"environment", "",
       choice<Environment>({&P::map, &MapConfig::environment},
                           {{"dynamic", Environment::kDynamic}, {"static", Environment::kStatic}}),
       "dynamic: every observation counts. static: a cell is no longer updated once it has "
       "reached sensor_model/min or sensor_model/max."},
  };
}

std::vector<ParameterDeclaration> declareCuboids() {
  return {
      {"fusion", "",
       choice<FusionKind>({&P::map, &MapConfig::fusion}, {{"class", FusionKind::kClass},
                                                          {"growth", FusionKind::kGrowth},
                                                          {"none", FusionKind::kNone}}),
       "How voxels become cuboids. class: boxes of free or of occupied voxels, within blocks of 8 "
       "x 8 x 8. growth: after the paper. none: every voxel is a cuboid. In all of "
       "them every voxel keeps its own probability."},
      {"threads", "", integer(&P::threads, 0, 256),
       "Number of threads that process a cloud. The map does not depend on it. 0: one per core."},
      {"ignore_unknown", "", boolean(&P::ignores_unknown),
       "true: parameters that do not exist are ignored with a warning, as octomap_server ignores "
       "them. false: the node does not start. Keys of earlier versions, and those in sources, "
       "remain errors."},
  };
}

// The probabilities stay away from 0, 0.5 and 1, where log-odds are infinite or zero.
std::vector<ParameterDeclaration> declareSensorModel() {
  return {
      {"sensor_model/hit", "probability",
       adjustable(number({&S::sensor_model, &SensorModelConfig::hit}, 0.501, 0.999)),
       "Probability that a voxel is occupied if a beam ends in it."},
      {"sensor_model/miss", "probability",
       adjustable(number({&S::sensor_model, &SensorModelConfig::miss}, 0.001, 0.499)),
       "Probability that a voxel is occupied if a beam passes through it."},
      {"sensor_model/min", "probability",
       adjustable(
           number({&P::source, &S::sensor_model, &SensorModelConfig::alpha_min}, 0.001, 0.499)),
       "Lowest probability of a cell (clamping threshold). A free cell that reaches it is stable."},
      {"sensor_model/max", "probability",
       adjustable(
           number({&P::source, &S::sensor_model, &SensorModelConfig::alpha_max}, 0.501, 0.999)),
       "Highest probability of a cell (clamping threshold). An occupied cell that reaches it is "
       "stable."},
      {"sensor_model/max_range", "m",
       adjustable(number(&S::max_range_m, 0.01, kInfinity, kInfinity)),
       "Longer beams are cut off at this range and clear the space up to it. -1: no limit."},
      {"sensor_model/keep_surfaces", "", adjustable(boolean(&S::keep_surfaces)),
       "true: a beam does not clear floors, stairs and tables that it grazes and that neighbouring "
       "beams hit, only what it passes. false: a beam clears all voxels up to its end, as in "
       "OctoMap."},
      {"sensor_model/min_range", "m", adjustable(number(&S::min_range_m, 0.0, kInfinity, 0.0)),
       "Points closer to the sensor than this are ignored. 0 or -1: no limit.",
       "sensor_model/max_range"},
  };
}

std::vector<ParameterDeclaration> declareCrop() {
  std::vector<ParameterDeclaration> table;
  for (const int axis : {0, 1, 2}) {
    const std::string name(1, "xyz"[axis]);
    const std::string help =
        ' ' + name +
        " limit. Points outside are ignored. In the frame of the map, or of base_frame_id with "
        "filter_ground.";
    const Field<double> least([axis](P& p) -> double& { return p.source.crop.min_m[axis]; }, true);
    const Field<double> most([axis](P& p) -> double& { return p.source.crop.max_m[axis]; }, true);
    table.push_back({"pointcloud_min_" + name, "m", adjustable(number(least)), "Lower" + help,
                     "pointcloud_max_" + name});
    table.push_back({"pointcloud_max_" + name, "m", adjustable(number(most)), "Upper" + help});
  }
  return table;
}

std::vector<ParameterDeclaration> declareTopics() {
  return {
      {"queue_size", "clouds", integer(&P::queue_size, 1, 1000),
       "Clouds of a source that may wait while the node maps others. If more wait, and the node "
       "has "
       "been busy for a second, the oldest is dropped: the map stays up to date."},
      {"tf_wait", "s", number(&P::tf_wait_s, 0.01, 3600.0),
       "A cloud is dropped if its transforms do not arrive within this time."},
      {"tf_gap", "s", number(&P::tf_gap_s, 0.001, 86400.0),
       "A cloud is dropped if it lies between two transforms of a frame that are farther apart: "
       "its pose would be a guess."},
      {"publish_rate", "Hz", adjustable(number(&P::publish_rate_hz, 0.01, 100.0)),
       "Maximum rate of the map topics. They are published after a change (cuboid_map_updates "
       "always, robot_grid also when the robot moves); occupied_cuboids and free_cuboids of a "
       "large map less often."},
      {"keyframe_period", "s", number(&P::keyframe_period_s, 0.0, 86400.0),
       "Time between two keyframes on topics that carry changes: occupied_cuboids, free_cuboids, "
       "cuboid_map, and the grids with updates. A keyframe has the whole content, for listeners "
       "that lost messages and for bags. The last change is followed by one more. 0: never."},
  };
}

std::vector<ParameterDeclaration> declareFiles() {
  return {
      {"map_file", "", file(&P::map_file),
       "Map to start with: .cuboids, .sqlite, .ot or .bt, whose resolution replaces the parameter "
       "resolution; or .pcd, points in the frame of the map, whose voxels become occupied. Not "
       "read if autosave_file exists."},
  };
}

std::vector<ParameterDeclaration> declareQueries() {
  return {
      {"query/max_time", "s",
       number({&P::service_limits, &ServiceLimits::max_time_s}, 1e-3, 3600.0),
       "Time after which a query is cut short; its answer says so. Clouds and other calls run in "
       "between."},
  };
}

/// Adds declarations, those of a group behind its others.
void addTo(std::vector<ParameterDeclaration>& table,
           const std::vector<ParameterDeclaration>& declarations) {
  for (const ParameterDeclaration& declaration : declarations) {
    const std::string group = declaration.key.substr(0, declaration.key.find('/') + 1);
    const auto last = std::find_if(table.rbegin(), table.rend(), [&](const auto& other) {
      return !group.empty() && other.key.rfind(group, 0) == 0;
    });
    table.insert(last == table.rend() ? table.end() : last.base(), declaration);
  }
}

}  // namespace

const std::vector<ParameterDeclaration>& parameterTable() {
  static const std::vector<ParameterDeclaration> kTable = [] {
    std::vector<ParameterDeclaration> table;
    for (const auto& part : {declareMap(), declareCuboids(), declareSources(), declareSensorModel(),
                             declareCrop(), declareTopics(), declareFiles(), declareQueries()}) {
      addTo(table, part);
    }
    for (const FeatureParameters& feature : featureParameters()) addTo(table, feature.declare());
    return table;
  }();
  return kTable;
}

const std::vector<OtherName>& otherNames() {
  static const std::vector<OtherName> kNames = [] {
    std::vector<OtherName> names;
    for (const ParameterDeclaration& of : parameterTable()) {
      const std::string group = of.key.substr(0, of.key.find('/') + 1);
      if (group == "sensor_model/" || group == "ground_filter/") {
        names.push_back({toReconfigureName(of.key), of, of.kind,
                         "a leftover of octomap_server's dynamic_reconfigure; `rosparam delete` "
                         "removes it",
                         true});
      }
      if (of.key != "length_unit") continue;
      const std::string origin = "a name of earlier versions, for ";
      names.push_back({"depth_unit", of, number(&S::old_depth_unit_m, of.kind.min, of.kind.max),
                       origin + "depth images", false});
      names.push_back({"point_unit", of, number(&S::old_point_unit_m, of.kind.min, of.kind.max),
                       origin + "clouds and scans", false});
    }
    return names;
  }();
  return kNames;
}

bool isOtherName(const std::string& key, bool is_source) {
  const std::vector<OtherName>& names = otherNames();
  return std::any_of(names.begin(), names.end(), [&](const OtherName& other) {
    return other.name == key && (!is_source || other.kind.is_of_source);
  });
}

const std::map<std::string, std::string>& mergedParameters() {
  static const std::map<std::string, std::string> kMerged{
      {"queue_memory", "queue_size limits the clouds that wait"},
      {"order_wait", "clouds of several sources do not wait for each other; see queue_size"},
      {"color_by", "markers have the colours of heights; the rviz display shows probabilities"},
      {"color_period", "the colours of heights fit the map"},
      {"map_part_size", "a message of cuboid_map has at most 250 MB, before it is compressed"},
      {"markers/joined", "the rviz display shows joined cuboids"}};
  return kMerged;
}

const std::map<std::string, std::string>& retiredParameters() {
  static const std::string kConstant = "it has one value for everybody now: remove it";
  static const std::string kAutosave =
      "the node starts with autosave_file if that exists, else with map_file: remove it. To begin "
      "anew, remove the file of autosave_file";
  static const std::map<std::string, std::string> kRetired{
      {"autosave_keep",
       "earlier saves are for tools such as logrotate, or a copy before the start: remove it"},
      {"map_file_optional", kAutosave},
      {"resume", kAutosave},
      {"forget_class", "write forget: all, occupied or free"},
      {"forget_to", "write forget: seen_once for seen_once, and remove it for unknown"},
      {"observation_excess",
       "with observation_memory, observations above observation_rate wait; without, they are "
       "dropped and counted: remove it"},
      {"self_filter/urdf_file", "write self_filter/robot_description: /path/robot.urdf"},
      {"fuse", kConstant + " (every_cloud)"},
      {"rtree/max_branches", kConstant},
      {"rtree/min_branches", kConstant},
      {"growth/settle_clouds", kConstant},
      {"query/max_bricks", kConstant + "; query/max_time limits calls"},
      {"query/max_entries", kConstant},
      {"query/max_answer", kConstant},
      {"sensor_model/end_margin",
       "write sensor_model/keep_surfaces: true, which clears less of surfaces"},
      {"file_memory", "maps may take the memory of the machine: remove it"},
      {"projected_map_memory", kConstant + " (100 MB)"},
      {"window/margin", "it is a tenth of window/size: remove it"},
      {"keep_clouds/max_age", "keep_clouds/memory limits the kept clouds: remove it"},
      {"keep_clouds/tolerance", "it is half a voxel: remove it"},
      {"hot_bricks", "there is nothing to limit any more: remove it"},
      {"marker_period", "keyframe_period takes its place, for all topics that carry differences"},
      {"published_cuboids",
       "the marker topics show the cuboids of the map, which are boxes of one class: remove it"}};
  return kRetired;
}

std::optional<ParameterError> findRetired(const std::string& key) {
  const auto retired = retiredParameters().find(key);
  if (retired == retiredParameters().end()) return std::nullopt;
  return ParameterError{key, "belongs to an earlier version: " + retired->second};
}

const std::map<std::string, std::string>& octomapServerOnly() {
  static const std::string kChanges = "changes are published on cuboid_map_updates";
  static const std::string kColors =
      "occupied_cells_vis_array is coloured by height, and free_cells_vis_array is green";
  static const std::map<std::string, std::string> kNames = {
      {"track_changes", kChanges},
      {"listen_changes", kChanges},
      {"topic_changes", kChanges},
      {"change_id_frame", kChanges},
      {"min_change_pub", kChanges},
      {"incremental_2D_projection", "projected_map is always updated incrementally"},
      {"max_depth", "cells of all sizes are shown"},
      {"compress_map", "octrees are always pruned"},
      {"colored_map", "cells have no colours in this map"},
      {"height_map", kColors},
      {"color_factor", kColors},
      {"color", kColors},
      {"color_free", kColors},
      {"publish_free_space", "free_cells_vis_array is published for whoever subscribes to it"},
      {"latch", "a new subscriber always gets the current map at once"},
  };
  return kNames;
}

const std::set<std::string>& parametersOfOthers() {
  static const std::set<std::string> kKeys{"num_worker_threads", "diagnostic_period"};
  return kKeys;
}

}  // namespace cuboid_mapping_ros
