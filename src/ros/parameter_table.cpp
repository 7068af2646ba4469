// SPDX-License-Identifier: BSD-3-Clause
#include "parameter_table.h"

#include "cuboid_mapping/fusion/fusion_kind.h"

#include <algorithm>
#include <cmath>
#include <locale>
#include <sstream>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::Environment;
using cuboid_mapping::GrowthStarters;
using cuboid_mapping::FusionKind;
using cuboid_mapping::GrowthStep;
using P = NodeParameters;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

const char* toString(ColorBy color_by) {
  return color_by == ColorBy::kProbability ? "probability" : "height";
}

/// One of some values of an enumeration, by the names that toString() gives them.
template <typename Enumeration>
ChoiceKind oneOf(const std::vector<Enumeration>& values, Enumeration& (*field)(P&)) {
  std::vector<std::string> names;
  names.reserve(values.size());
  for (const Enumeration value : values) names.emplace_back(toString(value));
  return {names,
          [values, names, field](P& p, const std::string& name) {
            const auto place = std::find(names.begin(), names.end(), name) - names.begin();
            field(p) = values.at(static_cast<std::size_t>(place));
          },
          [field](P& p) -> std::string { return toString(field(p)); }};
}

std::vector<ParameterDeclaration> declareMap() {
  return {
      {"frame_id", "", FrameKind{[](P& p) -> std::string& { return p.frame_id; }, false},
       "Frame of the map."},
      {"sensor_frame", "", FrameKind{[](P& p) -> std::string& { return p.sensor_frame; }, true},
       "Frame in whose origin the beams start. Empty: the frame of the cloud. To be set where "
       "clouds come in another frame than their sensor's."},
      {"resolution", "m", NumberKind{[](P& p) -> double& { return p.map.resolution_m; }, 1e-3, 1e2},
       "Edge of a voxel, the smallest cell of the map."},
      {"environment", "",
       oneOf<Environment>({Environment::kDynamic, Environment::kStatic},
                          [](P& p) -> Environment& { return p.map.environment; }),
       "dynamic: every observation counts. static: a cell that has reached sensor_model/min or "
       "sensor_model/max is never updated again."},
      {"fusion", "",
       oneOf<FusionKind>({FusionKind::kClass, FusionKind::kGrowth, FusionKind::kNone},
                         [](P& p) -> FusionKind& { return p.map.fusion; }),
       "How cells become bigger cuboids after every cloud. class: large boxes of free and of "
       "occupied voxels in blocks of 8 x 8 x 8. growth: that of the paper, see growth/*. none: "
       "every voxel stays a cuboid. Every voxel keeps its own probability in any case."},
      {"rtree/max_branches", "",
       IntegerKind{[](P& p) -> int& { return p.map.rtree.max_branches; }, 2,
                   cuboid_mapping::RTreeConfig::kMaxBranchesLimit},
       "Most branches of a node of the R-tree (M)."},
      {"rtree/min_branches", "",
       IntegerKind{[](P& p) -> int& { return p.map.rtree.min_branches; }, 1,
                   cuboid_mapping::RTreeConfig::kMaxBranchesLimit / 2},
       "Fewest branches of a node of the R-tree (d), at most half of rtree/max_branches."},
      {"threads", "", IntegerKind{[](P& p) -> int& { return p.threads; }, 0, 256},
       "Threads that work on a cloud. The map does not depend on it. 0: one per core."},
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
       "By how much a cell expands, with fusion: growth. cell: one voxel. own_width: its own "
       "width. neighbour: the width of the next cell, so that fused cuboids can absorb each "
       "other."},
      {"growth/search", "", growthSearchKind(),
       "In which order a cell tries the directions. paper: by decreasing width, first upwards."},
      {"growth/starters", "",
       oneOf<GrowthStarters>(
           {GrowthStarters::kSampled, GrowthStarters::kEndPoints, GrowthStarters::kChanged},
           [](P& p) -> GrowthStarters& { return p.map.growth.starters; }),
       "Which cells expand after a cloud. sampled: those in which a beam ends, and some at random "
       "along the beams. end_points: without these. changed: all that have changed."},
      {"growth/samples", "1/m",
       NumberKind{[](P& p) -> double& { return p.map.growth.sampling.per_m; }, 0.0, 100.0},
       "Cells drawn at random along a beam, with growth/starters: sampled."},
      {"growth/seed", "",
       IntegerKind{[](P& p) -> int& { return p.map.growth.sampling.seed; }, 0, 1000000},
       "Of these cells, and of growth/search: random."},
      {"growth/settle_clouds", "clouds",
       IntegerKind{[](P& p) -> int& { return p.map.growth.settle_clouds; }, 0, 10000},
       "A voxel that was split out of a cuboid fuses again after it has kept its value so long."},
  };
}

// The probabilities keep away from 0, 0.5 and 1, where log-odds are infinite or zero.
std::vector<ParameterDeclaration> declareSensorModel() {
  return {
      {"sensor_model/hit", "probability",
       NumberKind{[](P& p) -> double& { return p.map.sensor_model.hit; }, 0.501, 0.999},
       "Occupancy that a beam's end says of its voxel."},
      {"sensor_model/miss", "probability",
       NumberKind{[](P& p) -> double& { return p.map.sensor_model.miss; }, 0.001, 0.499},
       "Occupancy that a beam says of the voxels that it passes."},
      {"sensor_model/min", "probability",
       NumberKind{[](P& p) -> double& { return p.map.sensor_model.alpha_min; }, 0.001, 0.499},
       "Least occupancy of a cell: clamping threshold, beyond which a free cell is stable."},
      {"sensor_model/max", "probability",
       NumberKind{[](P& p) -> double& { return p.map.sensor_model.alpha_max; }, 0.501, 0.999},
       "Greatest occupancy of a cell: clamping threshold, beyond which an occupied cell is "
       "stable."},
      {"sensor_model/max_range", "m",
       NumberKind{[](P& p) -> double& { return p.max_range_m; }, 0.01, kInfinity, kInfinity},
       "Longer beams are cut there and free the space up to it. -1: no limit."},
      {"sensor_model/min_range", "m",
       NumberKind{[](P& p) -> double& { return p.min_range_m; }, 0.0, kInfinity, 0.0},
       "Points nearer to the sensor are left out wholly. 0 or -1: none."},
      {"sensor_model/no_return_range", "m",
       NumberKind{[](P& p) -> double& { return p.no_return_range_m; }, 0.0, 1000.0},
       "Beams without return (NaN, infinite or zero points of an organized cloud) free the space "
       "up to this range. 0: they are skipped."},
  };
}

std::vector<ParameterDeclaration> declareCrop() {
  const std::string help =
      "limit of the points in the map's frame, with filter_ground in that of base_frame_id; those "
      "outside are left out.";
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
       "Clouds that may wait on cloud_in, and for their transform."},
      {"publish_rate", "Hz",
       NumberKind{[](P& p) -> double& { return p.publish_rate_hz; }, 0.01, 100.0},
       "Greatest rate of the map topics. They are published after a change only."},
      {"latch", "", BooleanKind{[](P& p) -> bool& { return p.latch; }},
       "Whether late subscribers get the last message of the map topics."},
      {"publish_values", "", BooleanKind{[](P& p) -> bool& { return p.publish_values; }},
       "Whether cuboid_map and cuboid_map_updates carry the probability of every voxel, or "
       "classes alone, which is what planners need."},
      {"color_by", "",
       oneOf<ColorBy>({ColorBy::kHeight, ColorBy::kProbability},
                      [](P& p) -> ColorBy& { return p.color_by; }),
       "What the colour of occupied cuboids stands for."},
      {"color_period", "m",
       NumberKind{[](P& p) -> double& { return p.color_period_m; }, 0.01, kInfinity},
       "Height over which the colours repeat, with color_by: height."},
  };
}

std::vector<ParameterDeclaration> declareFiles() {
  return {
      {"map_file", "", FileKind{[](P& p) -> std::string& { return p.map_file; }},
       "Map to start from: .cuboids, .ot or .bt. Its resolution counts, whatever the parameter "
       "says."},
      {"autosave_file", "", FileKind{[](P& p) -> std::string& { return p.autosave_file; }},
       "File to save the map to, after changes and at the end; its ending chooses the format, as "
       "for "
       "~save_map. Empty: none."},
      {"autosave_period", "s",
       NumberKind{[](P& p) -> double& { return p.autosave_period_s; }, 1.0, 86400.0},
       "Time between two saves to autosave_file."},
  };
}

std::string formatFloating(double value, int precision) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(precision);
  out << value;
  return out.str();
}

std::string join(const std::vector<std::string>& words, const std::string& separator) {
  std::string joined;
  for (const std::string& word : words) joined += (joined.empty() ? "" : separator) + word;
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
  std::string operator()(const ChoiceKind& kind) const { return join(kind.names, " or "); }
  std::string operator()(const TextKind& kind) const { return kind.allowed; }
};

}  // namespace

const std::vector<ParameterDeclaration>& parameterTable() {
  static const std::vector<ParameterDeclaration> kTable = [] {
    std::vector<ParameterDeclaration> table = declareMap();
    for (const auto& part : {declareGrowth(), declareSensorModel(), declareCrop(), declareTopics(),
                             declareFiles(), declareOctomapServer()}) {
      table.insert(table.end(), part.begin(), part.end());
    }
    return table;
  }();
  return kTable;
}

const std::vector<RetiredParameter>& retiredParameters() {
  static const std::vector<RetiredParameter> kRetired{
      {"hot_bricks", "nothing has to be bounded any more: remove it"},
      {"published_cuboids", "the marker topics show the cuboids of the map, which are boxes of one "
                            "class: remove it"}};
  return kRetired;
}

const std::vector<LibraryParameter>& libraryParameters() {
  static const std::vector<LibraryParameter> kParameters = {
      {"diagnostic_period", "1.0", "s", "Read by diagnostic_updater: time between diagnostics."},
      {"num_worker_threads", "0", "threads",
       "Read by nodelet, of a node that is its own manager; 0: one for each core."}};
  return kParameters;
}

std::string formatNumber(double value) {
  std::string text;
  for (int precision = 6; precision <= 17; ++precision) {
    text = formatFloating(value, precision);
    std::istringstream in(text);
    in.imbue(std::locale::classic());
    double read_back = 0.0;
    if (in >> read_back && read_back == value) break;
  }
  if (!std::isfinite(value) || text.find('.') != std::string::npos) return text;
  return text.insert(std::min(text.find('e'), text.size()), ".0");
}

std::string formatValue(const ParameterDeclaration& declaration, const NodeParameters& parameters) {
  return std::visit(ValueFormatter{parameters}, declaration.kind);
}

std::string formatAllowed(const ParameterDeclaration& declaration) {
  return std::visit(AllowedFormatter{}, declaration.kind);
}

}  // namespace cuboid_mapping_ros
