// SPDX-License-Identifier: BSD-3-Clause
#include "config.h"

#include "cuboid_mapping/map/config_check.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace cuboid_map_python {
namespace {

namespace py = pybind11;
using cuboid_mapping::Environment;
using cuboid_mapping::FusionKind;
using cuboid_mapping::FusionTime;
using cuboid_mapping::MapperConfig;

/// Reads keyword arguments one after the other, and collects errors.
class ConfigReader {
 public:
  explicit ConfigReader(const py::dict& arguments) : arguments_(arguments) {}

  void number(const char* key, double& field) {
    const auto value = take(key);
    if (!value) return;
    const double given = py::isinstance<py::bool_>(value) ? NAN : PyFloat_AsDouble(value.ptr());
    const bool is_number = PyErr_Occurred() == nullptr && !std::isnan(given);
    PyErr_Clear();  // The error for a value that is no number.
    if (!is_number) return refuse(key, value, "a number");
    field = given;
  }

  void boolean(const char* key, bool& field) {
    const auto value = take(key);
    if (!value) return;
    py::detail::make_caster<bool> caster;  // Takes numpy's truth values, too.
    if (!caster.load(value, false)) return refuse(key, value, "True or False");
    field = py::detail::cast_op<bool>(caster);
  }

  void integer(const char* key, int& field) {
    const auto value = take(key);
    if (!value) return;
    const bool is_integer = PyIndex_Check(value.ptr()) && !py::isinstance<py::bool_>(value);
    const long given = is_integer ? PyLong_AsLong(py::int_(value).ptr()) : 0;
    const bool is_good =
        is_integer && PyErr_Occurred() == nullptr && given == static_cast<int>(given);
    PyErr_Clear();  // The error for a number that is no long.
    if (!is_good) return refuse(key, value, "a whole number of at most 32 bits");
    field = static_cast<int>(given);
  }

  /// @param parse  (const std::string&) -> whether it is one of the texts.
  void text(const char* key, const std::string& texts,
            const std::function<bool(const std::string&)>& parse) {
    const auto value = take(key);
    if (!value) return;
    if (!py::isinstance<py::str>(value) || !parse(value.cast<std::string>())) {
      refuse(key, value, texts);
    }
  }

  template <typename EnumerationT>
  void choice(const char* key, EnumerationT& field, const std::vector<EnumerationT>& values) {
    std::string texts;
    for (const EnumerationT each : values) {
      texts += (texts.empty() ? "'" : ", '") + std::string(toString(each)) + "'";
    }
    text(key, "one of " + texts, [&](const std::string& given) {
      for (const EnumerationT each : values) {
        if (given == toString(each)) {
          field = each;
          return true;
        }
      }
      return false;
    });
  }

  void note(const std::string& error) { errors_ += "\n  " + error; }

  /// @throws std::invalid_argument  with all errors, in the arguments and in the configuration.
  void finish(const MapperConfig& config) {
    for (const cuboid_mapping::ConfigError& error : checkConfig(config)) {
      note(keyOf(error.field) + ' ' + error.message);
    }
    std::string known;
    for (const std::string& key : known_) known += (known.empty() ? "" : ", ") + key;
    for (const auto& item : arguments_) {
      const bool is_known = known_.count(item.first.cast<std::string>()) > 0;
      if (!is_known) note(item.first.cast<std::string>() + " is not known; known are: " + known);
    }
    if (!errors_.empty()) throw std::invalid_argument("the configuration is wrong:" + errors_);
  }

 private:
  py::object take(const char* key) {
    known_.insert(key);
    return arguments_.contains(key) ? py::object(arguments_[key]) : py::object();
  }

  /// The keyword of a field: "growth_settle_clouds" of "map.growth.settle_clouds".
  static std::string keyOf(const std::string& field) {
    static const std::map<std::string, std::string> kKeys = {
        {"max_range_m", "max_range"},
        {"end_margin_m", "end_margin"},
        {"map.resolution_m", "resolution"},
        {"map.growth.settle_clouds", "growth_settle_clouds"}};
    const auto key = kKeys.find(field);
    return key != kKeys.end() ? key->second : field.substr(field.rfind('.') + 1);
  }

  void refuse(const char* key, const py::object& value, const std::string& allowed) {
    note(std::string(key) + " is " + py::repr(value).cast<std::string>() + ", but must be " +
         allowed);
  }

  const py::dict& arguments_;
  std::set<std::string> known_;
  std::string errors_;
};

void readMap(ConfigReader& reader, cuboid_mapping::MapConfig& map) {
  reader.number("resolution", map.resolution_m);
  reader.number("hit", map.sensor_model.hit);
  reader.number("miss", map.sensor_model.miss);
  reader.number("alpha_min", map.sensor_model.alpha_min);
  reader.number("alpha_max", map.sensor_model.alpha_max);
  reader.choice("environment", map.environment, {Environment::kDynamic, Environment::kStatic});
  reader.choice("fusion", map.fusion, {FusionKind::kClass, FusionKind::kGrowth, FusionKind::kNone});
  reader.choice("fuse", map.fuse, {FusionTime::kEveryCloud, FusionTime::kWhenRead});
  reader.integer("growth_settle_clouds", map.growth.settle_clouds);
  reader.integer("max_branches", map.rtree.max_branches);
  reader.integer("min_branches", map.rtree.min_branches);
  reader.integer("threads", map.threads);
  if (map.threads == 0) {
    map.threads = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1,
                             cuboid_mapping::MapConfig::kMaxThreads);
  }
}

}  // namespace

MapperConfig parseConfig(const py::dict& arguments, const MapperConfig& base) {
  MapperConfig config = base;
  ConfigReader reader(arguments);
  readMap(reader, config.map);
  reader.number("max_range", config.max_range_m);
  reader.number("end_margin", config.end_margin_m);
  reader.boolean("keep_surfaces", config.keep_surfaces);
  reader.finish(config);
  return config;
}

const char* const kConfigHelp = R"(
Keyword arguments, with their defaults:
  resolution=0.05: edge of a voxel in metres, 0.001 to 100.
  max_range=inf: longer beams are cut there and free the space up to it, in metres.
  end_margin=0: length in metres before its end in which a beam frees unknown voxels only; OctoMap has 0.
  keep_surfaces=False: True: beams do not clear the floors, stairs and tables that they graze.
  hit=0.7, miss=0.4: probability that a voxel is occupied if a beam ends in it, or passes it.
  alpha_min=0.12, alpha_max=0.97: clamping thresholds of the probability of a voxel.
  environment='dynamic': every observation counts; 'static': voxels at a threshold stay as they are.
  fusion='class': large boxes of one class in bricks of 8 x 8 x 8 voxels; 'growth': the fusion of
    the paper; 'none': every voxel is a cuboid.
  fuse='every_cloud': changed bricks are divided with each scan; 'when_read': when their cuboids are read.
  threads=1: for one scan; 0: one for each core. The map does not depend on it.
  max_branches=32, min_branches=12: order of the R-tree.
  growth_settle_clouds=10: for fusion='growth': scans that a voxel split out of a cuboid waits before it may fuse again.
)";

}  // namespace cuboid_map_python
