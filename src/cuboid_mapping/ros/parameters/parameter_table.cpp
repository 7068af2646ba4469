// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include "cuboid_mapping/fusion/fusion_kind.h"

#include <algorithm>
#include <cmath>
#include <locale>
#include <sstream>
#include <tuple>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::Environment;
using cuboid_mapping::FusionKind;
using cuboid_mapping::FusionTime;
using cuboid_mapping::GrowthStarters;
using cuboid_mapping::GrowthStep;
using P = NodeParameters;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<ParameterDeclaration> declareMap() {
  return {
      {"frame_id", "", FrameKind{[](P& p) -> std::string& { return p.frame_id; }, false},
       "Frame of the map."},
      {"sensor_frame", "", FrameKind{[](P& p) -> std::string& { return p.sensor_frame; }, true},
       "Frame of the sensor, where the beams start. Empty: the frame of the cloud. Set it if the "
       "clouds have been transformed out of their sensor's frame."},
      {"resolution", "m", NumberKind{[](P& p) -> double& { return p.map.resolution_m; }, 1e-3, 1e2},
       "Edge length of a voxel, the smallest cell of the map."},
      {"environment", "",
       oneOf<Environment>({Environment::kDynamic, Environment::kStatic},
                          [](P& p) -> Environment& { return p.map.environment; }),
       "dynamic: every observation counts. static: a cell is no longer updated once it has "
       "reached sensor_model/min or sensor_model/max."},
      {"forget_after", "s", NumberKind{[](P& p) -> double& { return p.forget_after_s; }, 0.0, 1e6},
       "What no cloud has seen for this time is forgotten, by the stamps of the clouds and in "
       "blocks of 8 x 8 x 8 voxels; of several sources, what none remembers that has seen it. "
       "Locked boxes stay, and what comes from files and services alone. 0: never."},
      {"forget_class", "",
       oneOf<ForgetClass>({ForgetClass::kAll, ForgetClass::kOccupied, ForgetClass::kFree},
                          [](P& p) -> ForgetClass& { return p.forget_class; }),
       "Which voxels are forgotten after forget_after. all: both classes. occupied: obstacles "
       "that nobody sees any more; the space that was found free stays. free: space that was free "
       "long ago; obstacles stay."},
      {"forget_to", "",
       oneOf<ForgetTo>({ForgetTo::kUnknown, ForgetTo::kSeenOnce},
                       [](P& p) -> ForgetTo& { return p.forget_to; }),
       "What forgotten voxels become. unknown: unknown. seen_once: they keep their class, as if "
       "seen once; the next cloud can change it."},
      {"moving_points", "",
       oneOf<MovingPoints>({MovingPoints::kIgnore, MovingPoints::kPublish, MovingPoints::kLeaveOut},
                           [](P& p) -> MovingPoints& { return p.moving_points; }),
       "Points where earlier clouds have seen that nothing stands, which are of things that move. "
       "ignore: nobody looks for them. publish: they are published as moving_points. leave_out: "
       "they are published, and do not make voxels occupied."},
      {"fusion", "",
       oneOf<FusionKind>({FusionKind::kClass, FusionKind::kGrowth, FusionKind::kNone},
                         [](P& p) -> FusionKind& { return p.map.fusion; }),
       "How voxels are merged into cuboids. class: large boxes of free or of occupied voxels, in "
       "blocks of 8 x 8 x 8. growth: the method of the paper, see growth/*. none: every voxel is "
       "a cuboid. In any case, every voxel keeps its own probability."},
      {"fuse", "",
       oneOf<FusionTime>({FusionTime::kEveryCloud, FusionTime::kWhenRead},
                         [](P& p) -> FusionTime& { return p.map.fuse; }),
       "When changed blocks are divided into cuboids, with fusion: class. every_cloud: with each "
       "cloud, by all threads. when_read: when somebody reads their cuboids. The cuboids are the "
       "same."},
      {"rtree/max_branches", "",
       IntegerKind{[](P& p) -> int& { return p.map.rtree.max_branches; }, 2,
                   cuboid_mapping::RTreeConfig::kMaxBranchesLimit},
       "Maximum number of branches of an R-tree node (M)."},
      {"rtree/min_branches", "",
       IntegerKind{[](P& p) -> int& { return p.map.rtree.min_branches; }, 1,
                   cuboid_mapping::RTreeConfig::kMaxBranchesLimit / 2},
       "Minimum number of branches of an R-tree node (d), at most half of rtree/max_branches."},
      {"threads", "", IntegerKind{[](P& p) -> int& { return p.threads; }, 0, 256},
       "Number of threads that process a cloud. The map does not depend on it. 0: one per core."},
  };
}

TextKind growthSearchKind() {
  return {"paper, largest_gain, random, or the six directions in order as in \"+z -z +x +y -x -y\"",
          [](P& p, const std::string& text) {
            const auto strategy = cuboid_mapping::parseSearchStrategy(text);
            if (strategy) p.map.growth.search = *strategy;
            return strategy.has_value();
          },
          [](const P& p) { return toText(p.map.growth.search); }};
}

std::vector<ParameterDeclaration> declareGrowth() {
  return {
      {"growth/step", "",
       oneOf<GrowthStep>({GrowthStep::kCell, GrowthStep::kOwnWidth, GrowthStep::kNeighbour},
                         [](P& p) -> GrowthStep& { return p.map.growth.step; }),
       "How far a cell expands in one step, with fusion: growth. cell: one voxel. own_width: its "
       "own width. neighbour: the width of the next cell, so that fused cuboids can absorb each "
       "other."},
      {"growth/search", "", growthSearchKind(),
       "The order in which a cell tries the directions. paper: by decreasing width, upwards "
       "first."},
      {"growth/starters", "",
       oneOf<GrowthStarters>(
           {GrowthStarters::kSampled, GrowthStarters::kEndPoints, GrowthStarters::kChanged},
           [](P& p) -> GrowthStarters& { return p.map.growth.starters; }),
       "Which cells expand after a cloud. sampled: those in which a beam ends, and random ones "
       "along the beams. end_points: only those in which a beam ends. changed: all that have "
       "changed."},
      {"growth/samples", "1/m",
       NumberKind{[](P& p) -> double& { return p.map.growth.sampling.per_m; }, 0.0, 100.0},
       "Number of random cells per metre of a beam, with growth/starters: sampled."},
      {"growth/seed", "",
       IntegerKind{[](P& p) -> int& { return p.map.growth.sampling.seed; }, 0, 1000000},
       "Seed for these random cells, and for growth/search: random."},
      {"growth/settle_clouds", "clouds",
       IntegerKind{[](P& p) -> int& { return p.map.growth.settle_clouds; }, 0, 10000},
       "A voxel that was split out of a cuboid can fuse again once it has kept its value for this "
       "many clouds."},
  };
}

// The probabilities keep away from 0, 0.5 and 1, where log-odds are infinite or zero.
std::vector<ParameterDeclaration> declareSensorModel() {
  return {
      {"sensor_model/hit", "probability",
       NumberKind{[](P& p) -> double& { return p.map.sensor_model.hit; }, 0.501, 0.999},
       "Probability that a voxel is occupied if a beam ends in it."},
      {"sensor_model/miss", "probability",
       NumberKind{[](P& p) -> double& { return p.map.sensor_model.miss; }, 0.001, 0.499},
       "Probability that a voxel is occupied if a beam passes through it."},
      {"sensor_model/min", "probability",
       NumberKind{[](P& p) -> double& { return p.map.sensor_model.alpha_min; }, 0.001, 0.499},
       "Lowest probability of a cell (clamping threshold). A free cell that reaches it is stable."},
      {"sensor_model/max", "probability",
       NumberKind{[](P& p) -> double& { return p.map.sensor_model.alpha_max; }, 0.501, 0.999},
       "Highest probability of a cell (clamping threshold). An occupied cell that reaches it is "
       "stable."},
      {"sensor_model/max_range", "m",
       NumberKind{[](P& p) -> double& { return p.max_range_m; }, 0.01, kInfinity, kInfinity},
       "Longer beams are cut off at this range and clear the space up to it. -1: no limit."},
      {"sensor_model/end_margin", "m",
       NumberKind{[](P& p) -> double& { return p.end_margin_m; }, 0.0, 1000.0},
       "In the last metres before a return, a beam clears only what is unknown, so that beams "
       "along the ground or a wall do not clear what others have hit. 0: it clears all up to its "
       "end, as in OctoMap."},
      {"sensor_model/min_range", "m",
       NumberKind{[](P& p) -> double& { return p.min_range_m; }, 0.0, kInfinity, 0.0},
       "Points closer to the sensor than this are ignored. 0 or -1: no limit."},
      {"sensor_model/no_return_range", "m",
       NumberKind{[](P& p) -> double& { return p.no_return_range_m; }, 0.0, 1000.0},
       "Beams without a return, see no_return_points, clear the space up to this range. 0: they "
       "are ignored."},
      {"sensor_model/no_return_points", "",
       TextKind{"rep_117, with_nan, with_zero, all, none, or some of \"plus_inf nan zero minus_inf "
                "range_max\"; and ranges in metres, as in \"rep_117 81.91\"",
                [](P& p, const std::string& text) {
                  const auto points = parseNoReturnPoints(text);
                  if (points) std::tie(p.no_return_points, p.no_return_ranges_m) = *points;
                  return points.has_value();
                },
                [](const P& p) { return toText(p.no_return_points, p.no_return_ranges_m); }},
       "Which readings of a scan, of a depth image or of an organized cloud say that a beam met "
       "nothing; the others that are no return are ignored. plus_inf: +inf, in any coordinate of "
       "a point without -inf and NaN. nan: NaN. zero: 0, or the point (0, 0, 0). minus_inf: -inf, "
       "which REP 117 uses for things that are too close. range_max: range_max of a scan, and all "
       "beyond. rep_117: plus_inf. with_nan: plus_inf and nan. with_zero: plus_inf and zero. A "
       "range: readings of this range or depth, such as a far clip; they are never returns."},
  };
}

std::vector<ParameterDeclaration> declareCrop() {
  const std::string help =
      "limit. Points outside are ignored. In the frame of the map, or of base_frame_id with "
      "filter_ground.";
  return {
      {"pointcloud_min_x", "m", NumberKind{[](P& p) -> double& { return p.crop.min_m.x(); }},
       "Lower x " + help},
      {"pointcloud_max_x", "m", NumberKind{[](P& p) -> double& { return p.crop.max_m.x(); }},
       "Upper x " + help},
      {"pointcloud_min_y", "m", NumberKind{[](P& p) -> double& { return p.crop.min_m.y(); }},
       "Lower y " + help},
      {"pointcloud_max_y", "m", NumberKind{[](P& p) -> double& { return p.crop.max_m.y(); }},
       "Upper y " + help},
      {"pointcloud_min_z", "m", NumberKind{[](P& p) -> double& { return p.crop.min_m.z(); }},
       "Lower z " + help},
      {"pointcloud_max_z", "m", NumberKind{[](P& p) -> double& { return p.crop.max_m.z(); }},
       "Upper z " + help},
  };
}

std::vector<ParameterDeclaration> declareTopics() {
  return {
      {"queue_size", "clouds", IntegerKind{[](P& p) -> int& { return p.queue_size; }, 1, 1000},
       "Maximum number of clouds of a source that wait for their turn, when the node is too slow; "
       "bursts of a second may be larger."},
      {"queue_memory", "MB", IntegerKind{[](P& p) -> int& { return p.queue_memory_mb; }, 1, 65536},
       "Memory for clouds that wait for their turn or for tf. When it is full, the newest is "
       "dropped; one cloud may always wait."},
      {"tf_wait", "s", NumberKind{[](P& p) -> double& { return p.tf_wait_s; }, 0.01, 3600.0},
       "A cloud is dropped if its transforms have not arrived after this time."},
      {"publish_rate", "Hz",
       NumberKind{[](P& p) -> double& { return p.publish_rate_hz; }, 0.01, 100.0},
       "Maximum rate of the map topics, which are only published after a change."},
      {"latch", "", BooleanKind{[](P& p) -> bool& { return p.latch; }},
       "true: a new subscriber gets the current map at once."},
      {"keyframe_period", "s",
       NumberKind{[](P& p) -> double& { return p.keyframe_period_s; }, 0.0, 86400.0},
       "While they change, topics that carry differences (occupied_cuboids, free_cuboids, the "
       "grids with updates, cuboid_map) are sent as a whole this long apart, and once "
       "afterwards: for listeners that have lost messages, and bags. 0: never."},
      {"publish_values", "", BooleanKind{[](P& p) -> bool& { return p.publish_values; }},
       "true: cuboid_map and cuboid_map_updates carry the log-odds of every voxel. false: only "
       "classes, which is what planners need."},
      {"map_part_size", "MB",
       NumberKind{[](P& p) -> double& { return p.map_part_size_mb; }, 0.001, 500.0},
       "A map above this size is sent in several messages (cuboid_map, ~get_map). The size is "
       "that before compression, which leaves about a third."},
      {"color_by", "",
       oneOf<ColorBy>({ColorBy::kHeight, ColorBy::kProbability},
                      [](P& p) -> ColorBy& { return p.color_by; }),
       "What the colour of occupied cuboids shows."},
      {"color_period", "m",
       NumberKind{[](P& p) -> double& { return p.color_period_m; }, 0.0, kInfinity},
       "Height over which the colours repeat, with color_by: height. 0: they run once, from blue "
       "to red, over the heights of the map without the lowest and the highest 2 %."},
  };
}

std::vector<ParameterDeclaration> declareFiles() {
  return {
      {"map_file", "", FileKind{[](P& p) -> std::string& { return p.map_file; }},
       "Map to start with: .cuboids, .sqlite, .ot or .bt, whose resolution replaces the parameter "
       "resolution; or .pcd, points in the frame of the map, whose voxels become occupied."},
      {"autosave_file", "", FileKind{[](P& p) -> std::string& { return p.autosave_file; }},
       "The map is saved to this file after changes and when the node stops. A file that is there "
       "at the start and is not read then, see resume, is not replaced: saves go to a new file "
       "beside it. The extension selects the format, as with ~save_map. Empty: the map is not "
       "saved."},
      {"resume", "", BooleanKind{[](P& p) -> bool& { return p.resume; }},
       "true: the node goes on with the map of autosave_file and its locked boxes, where the file "
       "is there and map_file is empty. It does not start if the file cannot be read, or has "
       "another resolution."},
      {"autosave_period", "s",
       NumberKind{[](P& p) -> double& { return p.autosave_period_s; }, 1.0, 86400.0},
       "Time between two saves to autosave_file."},
      {"file_memory", "MB",
       IntegerKind{[](P& p) -> int& { return p.file_memory_mb; }, 100, 1000000},
       "Memory that reading a map may take: a file that would need more is refused."},
  };
}

std::vector<ParameterDeclaration> declareQueries() {
  return {
      {"query/max_time", "s",
       NumberKind{[](P& p) -> double& { return p.service_limits.max_time_s; }, 1e-3, 3600.0},
       "Maximum time spent on one service call. Clouds and other calls come in between. What is "
       "not answered by then is left out, and the answer says so."},
      {"query/max_bricks", "",
       IntegerKind{[](P& p) -> int& { return p.service_limits.max_bricks; }, 1000, 2000000000},
       "Maximum number of blocks of 8 x 8 x 8 voxels and of cuboids that a call may visit. Those "
       "that it keeps in memory count eight times: the default allows about 400 MB."},
      {"query/max_entries", "",
       IntegerKind{[](P& p) -> int& { return p.service_limits.max_entries; }, 1, 100000000},
       "Maximum number of points, boxes, rays or paths in a request, and of cuboids in an answer."},
      {"query/max_answer", "MB",
       IntegerKind{[](P& p) -> int& { return p.service_limits.max_answer_mb; }, 1, 900},
       "Maximum size of an answer. roscpp drops messages of 1000 MB."},
  };
}

std::vector<ParameterDeclaration> declareRobotGrid() {
  return {
      {"robot_grid/frame", "",
       FrameKind{[](P& p) -> std::string& { return p.robot_grid.frame_id; }, true},
       "Frame of the robot that robot_grid moves along with. Empty: there is no such grid."},
      {"robot_grid/size", "m",
       NumberKind{[](P& p) -> double& { return p.robot_grid.size_m; }, 0.1, 1000.0},
       "Minimum extent of robot_grid along x and y; a multiple of 16 voxels."},
      {"robot_grid/min_z", "m", NumberKind{[](P& p) -> double& { return p.robot_grid.min_z_m; }},
       "Cells below this height over the origin of the robot's frame are left out of robot_grid."},
      {"robot_grid/max_z", "m", NumberKind{[](P& p) -> double& { return p.robot_grid.max_z_m; }},
       "Cells above this height over the origin of the robot's frame are left out of robot_grid."},
  };
}

std::string formatFloating(double value, int precision) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(precision);
  out << value;
  return out.str();
}

/// "a or b", "a, b or c".
std::string joinAlternatives(const std::vector<std::string>& words) {
  std::string joined;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) joined += i + 1 == words.size() ? " or " : ", ";
    joined += words[i];
  }
  return joined;
}

struct ValueFormatter {
  NodeParameters parameters;

  std::string operator()(const NumberKind& kind) {
    const double value = kind.field(parameters);
    return formatNumber(kind.minus_one && std::isinf(value) ? -1.0 : value);
  }
  std::string operator()(const IntegerKind& kind) { return std::to_string(kind.field(parameters)); }
  std::string operator()(const BooleanKind& kind) {
    return kind.field(parameters) ? "true" : "false";
  }
  std::string operator()(const FrameKind& kind) { return '"' + kind.field(parameters) + '"'; }
  std::string operator()(const FileKind& kind) { return '"' + kind.field(parameters) + '"'; }
  std::string operator()(const ChoiceKind& kind) { return kind.get(parameters); }
  std::string operator()(const TextKind& kind) { return '"' + kind.get(parameters) + '"'; }
  std::string operator()(const ListKind& kind) { return kind.describe(parameters); }
};

struct AllowedFormatter {
  std::string operator()(const NumberKind& kind) const {
    std::string text = kind.minus_one ? "-1, or a number" : "a number";
    if (std::isfinite(kind.max)) {
      text += " from " + formatNumber(kind.min) + " to " + formatNumber(kind.max);
    } else if (std::isfinite(kind.min)) {
      text += " of at least " + formatNumber(kind.min);
    }
    return text;
  }
  std::string operator()(const IntegerKind& kind) const {
    return "a whole number from " + std::to_string(kind.min) + " to " + std::to_string(kind.max);
  }
  std::string operator()(const BooleanKind& /*kind*/) const { return "true or false"; }
  std::string operator()(const FrameKind& kind) const {
    return kind.may_be_empty ? "a tf2 frame, or empty" : "a tf2 frame";
  }
  std::string operator()(const FileKind& /*kind*/) const { return "a path, or empty"; }
  std::string operator()(const ChoiceKind& kind) const { return joinAlternatives(kind.names); }
  std::string operator()(const TextKind& kind) const { return kind.allowed; }
  std::string operator()(const ListKind& kind) const { return kind.allowed; }
};

}  // namespace

const std::vector<ParameterDeclaration>& parameterTable() {
  static const std::vector<ParameterDeclaration> kTable = [] {
    std::vector<ParameterDeclaration> table = declareMap();
    for (const auto& part :
         {declareSources(), declareSelfFilter(), declareGrowth(), declareSensorModel(),
          declareCrop(), declareTopics(), declareFiles(), declareWindow(), declareQueries(),
          declareRobotGrid(), declareFleet(), declareOctomapServer()}) {
      table.insert(table.end(), part.begin(), part.end());
    }
    return table;
  }();
  return kTable;
}

const std::vector<RetiredParameter>& retiredParameters() {
  static const std::vector<RetiredParameter> kRetired{
      {"hot_bricks", "there is nothing to limit any more: remove it"},
      {"marker_period", "keyframe_period takes its place, for all topics that carry differences"},
      {"published_cuboids",
       "the marker topics show the cuboids of the map, which are boxes of one class: remove it"}};
  return kRetired;
}

const std::vector<LibraryParameter>& libraryParameters() {
  static const std::vector<LibraryParameter> kParameters = {
      {"diagnostic_period", "1.0", "s",
       "Time between two diagnostics messages; read by diagnostic_updater."},
      {"num_worker_threads", "0", "threads",
       "Number of threads of a stand-alone node, which is its own nodelet manager. 0: one per "
       "core."}};
  return kParameters;
}

const char* toString(ColorBy color_by) {
  return color_by == ColorBy::kProbability ? "probability" : "height";
}

std::string formatNumber(double value) {
  if (std::isnan(value)) return ".nan";
  if (std::isinf(value)) return value > 0.0 ? ".inf" : "-.inf";
  std::string text;
  for (int precision = 6; precision <= 17; ++precision) {
    text = formatFloating(value, precision);
    std::istringstream in(text);
    in.imbue(std::locale::classic());
    double read_back = 0.0;
    if (in >> read_back && read_back == value) break;
  }
  if (text.find('.') != std::string::npos) return text;
  return text.insert(std::min(text.find('e'), text.size()), ".0");
}

std::string formatValue(const ParameterDeclaration& declaration, const NodeParameters& parameters) {
  return std::visit(ValueFormatter{parameters}, declaration.kind);
}

std::string formatAllowed(const ParameterDeclaration& declaration) {
  return std::visit(AllowedFormatter{}, declaration.kind);
}

}  // namespace cuboid_mapping_ros
