// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/reconfigure.h"

#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <sstream>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using dynamic_reconfigure::Config;
using XmlRpc::XmlRpcValue;

/// Groups of keys that can be changed; a group is a key, or all that begins with it and a slash.
constexpr std::array<const char*, 18> kRuntimeGroups{
    "sensor_model",    "publish_rate",       "filter_ground", "ground_filter",
    "occupancy_min_z", "occupancy_max_z",    "min_x_size",    "min_y_size",
    "filter_speckles", "publish_free_space", "height_map",    "color_factor",
    "color",           "color_free",         "compress_map",  "incremental_2D_projection",
    "color_by",        "color_period"};

/// Of octomap_server's trees.
constexpr int kMaxDepth = 16;

/// Fixed, and yet in the description.
constexpr std::array<const char*, 2> kExplainedKeys{"frame_id", "resolution"};

bool isRuntimeKey(const std::string& key) {
  if (key.rfind("pointcloud_", 0) == 0) return true;
  const std::string group = key.substr(0, key.find('/'));
  return std::find(kRuntimeGroups.begin(), kRuntimeGroups.end(), group) != kRuntimeGroups.end();
}

bool isDescribed(const std::string& key) {
  return isRuntimeKey(key) ||
         std::find(kExplainedKeys.begin(), kExplainedKeys.end(), key) != kExplainedKeys.end();
}

std::string reasonWhyFixed(const std::string& key) {
  if (key == "resolution") {
    return "cannot be changed while the node runs: the voxels of the map have this size. Restart "
           "the node with the new value";
  }
  if (key == "frame_id") {
    return "cannot be changed while the node runs: the map is fixed to this frame. Restart the "
           "node";
  }
  return "cannot be changed while the node runs: restart it";
}

double toNumber(const NumberKind& kind, NodeParameters parameters) {
  const double value = kind.field(parameters);
  return kind.minus_one && std::isinf(value) ? -1.0 : value;
}

/// Puts the value of a parameter into a message.
struct ConfigWriter {
  std::string name;
  NodeParameters parameters;
  Config& config;

  void operator()(const NumberKind& kind) { addNumber(toNumber(kind, parameters)); }
  void operator()(const IntegerKind& kind) {
    config.ints.emplace_back();
    config.ints.back().name = name;
    config.ints.back().value = kind.field(parameters);
  }
  void operator()(const BooleanKind& kind) {
    config.bools.emplace_back();
    config.bools.back().name = name;
    config.bools.back().value = static_cast<std::uint8_t>(kind.field(parameters));
  }
  void operator()(const FrameKind& kind) { addText(kind.field(parameters)); }
  void operator()(const FileKind& kind) { addText(kind.field(parameters)); }
  void operator()(const ChoiceKind& kind) { addText(kind.get(parameters)); }
  void operator()(const TextKind& kind) { addText(kind.get(parameters)); }
  void operator()(const ListKind& /*kind*/) {}  // Never described.

  void addNumber(double value) {
    config.doubles.emplace_back();
    config.doubles.back().name = name;
    config.doubles.back().value = value;
  }
  void addText(const std::string& value) {
    config.strs.emplace_back();
    config.strs.back().name = name;
    config.strs.back().value = value;
  }
};

/// A parameter as the parameter server would hold it.
struct ValueWriter {
  NodeParameters parameters;

  XmlRpcValue operator()(const NumberKind& kind) { return XmlRpcValue(toNumber(kind, parameters)); }
  XmlRpcValue operator()(const IntegerKind& kind) { return XmlRpcValue(kind.field(parameters)); }
  XmlRpcValue operator()(const BooleanKind& kind) { return XmlRpcValue(kind.field(parameters)); }
  XmlRpcValue operator()(const FrameKind& kind) { return XmlRpcValue(kind.field(parameters)); }
  XmlRpcValue operator()(const FileKind& kind) { return XmlRpcValue(kind.field(parameters)); }
  XmlRpcValue operator()(const ChoiceKind& kind) { return XmlRpcValue(kind.get(parameters)); }
  XmlRpcValue operator()(const TextKind& kind) { return XmlRpcValue(kind.get(parameters)); }
  XmlRpcValue operator()(const ListKind& kind) { return kind.get(parameters); }
};

struct TypeName {
  std::string operator()(const NumberKind&) const { return "double"; }
  std::string operator()(const IntegerKind&) const { return "int"; }
  std::string operator()(const BooleanKind&) const { return "bool"; }
  template <typename TextLikeT>
  std::string operator()(const TextLikeT&) const {
    return "str";
  }
};

/// A range where a parameter has none: sliders of graphical clients need one that can be dragged. Values
/// beyond are taken.
constexpr double kWidest = 1000.0;

/// Least, or greatest value of a number; other kinds have their default in both.
double limitOf(const NumberKind& kind, bool is_least) {
  if (!is_least) return std::min(kind.max, kWidest);
  return kind.minus_one ? -1.0 : std::max(kind.min, -kWidest);
}

void addLimit(const ParameterDeclaration& declaration, bool is_least, Config& limits) {
  ConfigWriter writer{toReconfigureName(declaration.key), {}, limits};
  if (const auto* number = std::get_if<NumberKind>(&declaration.kind)) {
    return writer.addNumber(limitOf(*number, is_least));
  }
  std::visit(writer, declaration.kind);
}

/// What graphical clients need to offer the names of a choice: a Python dictionary, as generated from
/// .cfg files. Empty for other kinds.
std::string editMethodOf(const ParameterDeclaration& declaration) {
  const auto* choice = std::get_if<ChoiceKind>(&declaration.kind);
  if (choice == nullptr) return {};
  std::ostringstream out;
  out << "{'enum': [";
  for (const std::string& name : choice->names) {
    out << (&name == &choice->names.front() ? "" : ", ") << "{'name': '" << name
        << "', 'type': 'str', 'value': '" << name
        << "', 'description': '', 'srcline': 0, 'srcfile': '', 'ctype': 'std::string', "
           "'cconsttype': 'const char * const'}";
  }
  out << "], 'enum_description': '" << declaration.key << "'}";
  return out.str();
}

void addTopGroup(Config& config) {
  config.groups.emplace_back();
  config.groups.back().name = "Default";
  config.groups.back().state = 1;
}

/// Clients ask for a name only if the description has it.
void addMaxDepth(int value, Config& config) {
  config.ints.emplace_back();
  config.ints.back().name = kMaxDepthName;
  config.ints.back().value = value;
}

/// Values of a request by name.
using Values = std::vector<std::pair<std::string, XmlRpcValue>>;

Values valuesOf(const Config& request) {
  Values values;
  for (const auto& p : request.doubles) values.emplace_back(p.name, XmlRpcValue(p.value));
  for (const auto& p : request.ints) values.emplace_back(p.name, XmlRpcValue(p.value));
  for (const auto& p : request.bools) values.emplace_back(p.name, XmlRpcValue(p.value != 0));
  for (const auto& p : request.strs) values.emplace_back(p.name, XmlRpcValue(p.value));
  return values;
}

const ParameterDeclaration* findDeclaration(const std::string& name) {
  const auto& table = parameterTable();
  const auto found =
      std::find_if(table.begin(), table.end(), [&name](const ParameterDeclaration& declaration) {
        return toReconfigureName(declaration.key) == name || declaration.key == name;
      });
  return found == table.end() ? nullptr : &*found;
}

void setValue(XmlRpcValue& group, const std::string& key, const XmlRpcValue& value) {
  const std::size_t slash = key.find('/');
  if (slash == std::string::npos) {
    group[key] = value;
  } else {
    setValue(group[key.substr(0, slash)], key.substr(slash + 1), value);
  }
}

XmlRpcValue toXmlRpc(const NodeParameters& parameters) {
  XmlRpcValue all;
  for (const ParameterDeclaration& declaration : parameterTable()) {
    setValue(all, declaration.key, std::visit(ValueWriter{parameters}, declaration.kind));
  }
  return all;
}

}  // namespace

std::string toReconfigureName(const std::string& key) {
  std::string name = key;
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

std::vector<std::string> runtimeKeys() {
  std::vector<std::string> keys;
  for (const ParameterDeclaration& declaration : parameterTable()) {
    if (isRuntimeKey(declaration.key)) keys.push_back(declaration.key);
  }
  return keys;
}

std::vector<std::pair<std::string, XmlRpcValue>> runtimeValues(const NodeParameters& parameters) {
  std::vector<std::pair<std::string, XmlRpcValue>> values;
  for (const ParameterDeclaration& declaration : parameterTable()) {
    if (!isRuntimeKey(declaration.key)) continue;
    values.emplace_back(declaration.key, std::visit(ValueWriter{parameters}, declaration.kind));
  }
  return values;
}

dynamic_reconfigure::ConfigDescription describeConfig() {
  dynamic_reconfigure::ConfigDescription description;
  description.groups.emplace_back();
  dynamic_reconfigure::Group& group = description.groups.back();
  group.name = "Default";
  for (const ParameterDeclaration& declaration : parameterTable()) {
    if (!isDescribed(declaration.key)) continue;
    group.parameters.emplace_back();
    dynamic_reconfigure::ParamDescription& parameter = group.parameters.back();
    parameter.name = toReconfigureName(declaration.key);
    parameter.type = std::visit(TypeName{}, declaration.kind);
    parameter.description = declaration.help;
    parameter.edit_method = editMethodOf(declaration);
    addLimit(declaration, true, description.min);
    addLimit(declaration, false, description.max);
  }
  group.parameters.emplace_back();
  group.parameters.back().name = kMaxDepthName;
  group.parameters.back().type = "int";
  group.parameters.back().description = "Has no effect here: cells of all sizes are shown.";
  addMaxDepth(1, description.min);
  addMaxDepth(kMaxDepth, description.max);
  description.dflt = toConfig({});
  addTopGroup(description.min);
  addTopGroup(description.max);
  return description;
}

Config toConfig(const NodeParameters& parameters) {
  Config config;
  for (const ParameterDeclaration& declaration : parameterTable()) {
    if (!isDescribed(declaration.key)) continue;
    std::visit(ConfigWriter{toReconfigureName(declaration.key), parameters, config},
               declaration.kind);
  }
  addMaxDepth(kMaxDepth, config);
  addTopGroup(config);
  return config;
}

LoadedParameters applyConfig(const NodeParameters& parameters, const Config& request) {
  XmlRpcValue values = toXmlRpc(parameters);
  std::vector<ParameterError> errors;
  for (const auto& [name, value] : valuesOf(request)) {
    if (name == kMaxDepthName) continue;
    const ParameterDeclaration* declaration = findDeclaration(name);
    if (declaration == nullptr) {
      errors.push_back({name, "is not a parameter: see ~parameter_descriptions"});
      continue;
    }
    const XmlRpcValue in_force = std::visit(ValueWriter{parameters}, declaration->kind);
    if (!isRuntimeKey(declaration->key) && XmlRpcValue(value) != in_force) {
      errors.push_back({declaration->key, reasonWhyFixed(declaration->key)});
      continue;
    }
    setValue(values, declaration->key, value);
  }
  LoadedParameters loaded = readParameters(values);
  loaded.parameters.self_filter.parts = parameters.self_filter.parts;  // Read at the start.
  errors.insert(errors.end(), loaded.errors.begin(), loaded.errors.end());
  if (!errors.empty()) loaded.parameters = parameters;
  loaded.errors = std::move(errors);
  return loaded;
}

}  // namespace cuboid_mapping_ros
