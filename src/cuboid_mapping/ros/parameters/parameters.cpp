// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/parameters.h"

#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/parameters/nearest_key.h"
#include "cuboid_mapping/ros/parameters/parameter_reader.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"
#include "cuboid_mapping/ros/parameters/reconfigure.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::ConfigError;
using XmlRpc::XmlRpcValue;

/// Why a value is not taken, and what to do; nothing when it is taken.
using Refusal = std::optional<std::string>;

/// The content of a value of this type. Takes a copy: older XmlRpcValues do not convert when const.
template <typename T>
T get(XmlRpcValue value) {
  return static_cast<T&>(value);
}

void collectLeaves(const XmlRpcValue& value, const std::string& key, Leaves& leaves) {
  if (value.getType() != XmlRpcValue::TypeStruct) {
    leaves[key] = value;
    return;
  }
  for (const auto& [name, member] : value) {
    std::string member_key = key;
    if (!key.empty()) member_key += '/';
    member_key += name;
    collectLeaves(member, member_key, leaves);
  }
}

/// Checks a value and puts it into its field.
struct ValueReader {
  const XmlRpcValue& value;
  NodeParameters& parameters;

  Refusal operator()(const NumberKind& kind) const {
    double number = 0.0;
    if (value.getType() == XmlRpcValue::TypeInt) {
      number = get<int>(value);
    } else if (value.getType() == XmlRpcValue::TypeDouble) {
      number = get<double>(value);
    } else {
      return "write it without quotes, an exponent as in 1.0e+9";
    }
    if (kind.minus_one && number == -1.0) {
      kind.field(parameters) = *kind.minus_one;
      return std::nullopt;
    }
    if (!std::isfinite(number) || number < kind.min || number > kind.max) return "correct it";
    kind.field(parameters) = number;
    return std::nullopt;
  }

  Refusal operator()(const IntegerKind& kind) const {
    if (value.getType() != XmlRpcValue::TypeInt)
      return "write it without quotes and without a decimal point";
    const int number = get<int>(value);
    if (number < kind.min || number > kind.max) return "correct it";
    kind.field(parameters) = number;
    return std::nullopt;
  }

  Refusal operator()(const BooleanKind& kind) const {
    if (value.getType() != XmlRpcValue::TypeBoolean) return "write true or false, without quotes";
    kind.field(parameters) = get<bool>(value);
    return std::nullopt;
  }

  Refusal operator()(const FrameKind& kind) const {
    if (value.getType() != XmlRpcValue::TypeString) return "write it in quotes";
    const std::string frame = withoutSlash(get<std::string>(value));
    if (frame.empty() && !kind.may_be_empty) return "name a frame";
    kind.field(parameters) = frame;
    return std::nullopt;
  }

  Refusal operator()(const FileKind& kind) const {
    if (value.getType() != XmlRpcValue::TypeString) return "write it in quotes";
    kind.field(parameters) = get<std::string>(value);
    return std::nullopt;
  }

  Refusal operator()(const ChoiceKind& kind) const {
    if (value.getType() != XmlRpcValue::TypeString) return "choose one of the names";
    const auto name = get<std::string>(value);
    if (std::find(kind.names.begin(), kind.names.end(), name) == kind.names.end()) {
      if (name == "brick") return "it was replaced by class: write class";
      return "choose one of the names";
    }
    kind.set(parameters, name);
    return std::nullopt;
  }

  Refusal operator()(const TextKind& kind) const {
    if (value.getType() != XmlRpcValue::TypeString) return "write it in quotes";
    if (!kind.set(parameters, get<std::string>(value))) return "correct it";
    return std::nullopt;
  }

  Refusal operator()(const ListKind& kind) const {
    if (value.getType() == XmlRpcValue::TypeInvalid) return std::nullopt;  // There is none.
    const std::string refusal = kind.set(parameters, value);
    return refusal.empty() ? std::nullopt : Refusal(refusal);
  }
};

/// The value of a key with slashes, taken out of nested structs; nothing when there is none.
std::optional<XmlRpcValue> findValue(const XmlRpcValue& group, const std::string& key) {
  const std::size_t slash = key.find('/');
  const std::string name = key.substr(0, slash);
  if (group.getType() != XmlRpcValue::TypeStruct || !group.hasMember(name)) return std::nullopt;
  if (slash == std::string::npos) return group[name];
  return findValue(group[name], key.substr(slash + 1));
}

/// tf2 knows no frames with a slash at their start, and tf1 made no difference.
void warnOfSlash(const ParameterDeclaration& declaration, const XmlRpcValue& value,
                 LoadedParameters& loaded) {
  if (!std::holds_alternative<FrameKind>(declaration.kind)) return;
  const auto frame = get<std::string>(value);
  if (frame == withoutSlash(frame)) return;
  loaded.warnings.push_back({declaration.key, "is " + describe(value) + " and is read as \"" +
                                                  withoutSlash(frame) +
                                                  "\": tf2 frames have no slash at the start"});
}

/// What dynamic_reconfigure of octomap_server leaves on the parameter server for a key; empty for
/// keys whose name it does not change.
std::string leftoverNameOf(const std::string& key) {
  const bool is_grouped = key.rfind("sensor_model/", 0) == 0 || key.rfind("ground_filter/", 0) == 0;
  return is_grouped ? toReconfigureName(key) : "";
}

/// The value that counts for a declaration.
std::optional<XmlRpcValue> findValueOrLeftover(const XmlRpcValue& group,
                                               const ParameterDeclaration& declaration,
                                               LoadedParameters& loaded) {
  auto value = findValue(group, declaration.key);
  const std::string name = leftoverNameOf(declaration.key);
  const auto leftover = name.empty() ? std::nullopt : findValue(group, name);
  if (!leftover) return value;
  NodeParameters scratch;
  std::string fate = "is used for " + declaration.key;
  bool is_taken = false;
  if (value) {
    fate = "is ignored: " + declaration.key + " is set";
  } else if (std::visit(ValueReader{*leftover, scratch}, declaration.kind)) {
    fate = "is ignored: " + declaration.key + " must be " + formatAllowed(declaration);
  } else {
    is_taken = true;
  }
  loaded.warnings.push_back({name, "is " + describe(*leftover) + " and " + fate +
                                       " (a leftover of octomap_server's dynamic_reconfigure; "
                                       "`rosparam delete` removes it)"});
  return is_taken ? leftover : value;
}

void readValues(const XmlRpcValue& group, const KeyFilter& is_wanted, LoadedParameters& loaded) {
  for (const ParameterDeclaration& declaration : parameterTable()) {
    if (!is_wanted(declaration.key)) continue;
    const auto value = findValueOrLeftover(group, declaration, loaded);
    if (!value) continue;
    const Refusal refusal = std::visit(ValueReader{*value, loaded.parameters}, declaration.kind);
    if (!refusal) {
      warnOfSlash(declaration, *value, loaded);
      continue;
    }
    loaded.errors.push_back({declaration.key, "is " + describe(*value) + ", but must be " +
                                                  formatAllowed(declaration) + ": " + *refusal +
                                                  ", or remove it to get the default " +
                                                  formatValue(declaration, {})});
  }
}

/// Two parameters of which one must be less than the other.
struct OrderedPair {
  std::string lower_key;
  double lower;
  std::string upper_key;
  double upper;
};

std::vector<OrderedPair> orderedPairs(const NodeParameters& parameters) {
  std::vector<OrderedPair> pairs;
  for (int axis = 0; axis < 3; ++axis) {
    const std::string name(1, "xyz"[axis]);
    pairs.push_back({"pointcloud_min_" + name, parameters.crop.min_m[axis],
                     "pointcloud_max_" + name, parameters.crop.max_m[axis]});
  }
  pairs.push_back({"occupancy_min_z", parameters.octomap_server.occupancy_min_z_m,
                   "occupancy_max_z", parameters.octomap_server.occupancy_max_z_m});
  pairs.push_back({"robot_grid/min_z", parameters.robot_grid.min_z_m, "robot_grid/max_z",
                   parameters.robot_grid.max_z_m});
  pairs.push_back({"sensor_model/min_range", parameters.min_range_m, "sensor_model/max_range",
                   parameters.max_range_m});
  return pairs;
}

void checkSets(LoadedParameters& loaded) {
  std::vector<ParameterError> errors;
  const auto is_good = [&loaded](const std::string& key) {
    return std::none_of(loaded.errors.begin(), loaded.errors.end(),
                        [&](const ParameterError& error) { return error.key == key; });
  };
  // The table is within the library's ranges: what is left is how its parameters go together.
  if (is_good("rtree/min_branches") && is_good("rtree/max_branches")) {
    for (ConfigError& error : checkConfig(loaded.parameters.map)) {
      std::replace(error.field.begin(), error.field.end(), '.', '/');
      errors.push_back({error.field, error.message});
    }
  }
  for (const OrderedPair& pair : orderedPairs(loaded.parameters)) {
    if (pair.lower < pair.upper || !is_good(pair.lower_key) || !is_good(pair.upper_key)) continue;
    errors.push_back({pair.lower_key, "is " + formatNumber(pair.lower) +
                                          ", but must be less than " + pair.upper_key + " (" +
                                          formatNumber(pair.upper) + "): change one of them"});
  }
  const SourceParameters& source = loaded.parameters.source;
  const bool is_depth = source.type == SourceType::kDepthImage;
  if (source.deskew && (is_depth || loaded.parameters.octomap_server.filter_ground)) {
    errors.push_back({"deskew", std::string("is true, but does not go with ") +
                                    (is_depth ? "type: depth_image" : "filter_ground") +
                                    ": switch one of them off"});
  }
  for (ParameterError& error : checkWindow(loaded.parameters)) errors.push_back(std::move(error));
  loaded.errors.insert(loaded.errors.end(), errors.begin(), errors.end());
}

}  // namespace

std::string describe(const XmlRpcValue& value) {
  switch (value.getType()) {
    case XmlRpcValue::TypeBoolean: return get<bool>(value) ? "true" : "false";
    case XmlRpcValue::TypeInt: return std::to_string(get<int>(value));
    case XmlRpcValue::TypeDouble: return formatNumber(get<double>(value));
    case XmlRpcValue::TypeString: return '"' + get<std::string>(value) + '"';
    case XmlRpcValue::TypeArray: return "a list";
    case XmlRpcValue::TypeStruct: return "a group of keys";
    default: return "not a plain value";
  }
}

Leaves leavesOf(const XmlRpcValue& group) {
  Leaves leaves;
  collectLeaves(group, "", leaves);
  return leaves;
}

void readGroup(const XmlRpcValue& group, const KeyFilter& is_wanted, LoadedParameters& loaded) {
  readValues(group, is_wanted, loaded);
  checkSets(loaded);
}

namespace {

/// Whether a key is in a table, or below one that is.
template <typename TableT>
bool isIn(const TableT& table, const std::string& key) {
  return std::any_of(table.begin(), table.end(), [&](const auto& entry) {
    return key == entry.key || key.rfind(entry.key + '/', 0) == 0;
  });
}

bool isLeftover(const std::string& key) {
  const auto& table = parameterTable();
  return std::any_of(table.begin(), table.end(),
                     [&key](const auto& entry) { return leftoverNameOf(entry.key) == key; });
}

void judgeUnknownKeys(const XmlRpcValue& group, UnknownKeys unknown_keys,
                      LoadedParameters& loaded) {
  std::vector<std::string> known_keys;
  for (const ParameterDeclaration& declaration : parameterTable()) {
    known_keys.push_back(declaration.key);
  }
  for (const auto& [key, value] : leavesOf(group)) {
    if (isIn(parameterTable(), key) || isIn(libraryParameters(), key) || isLeftover(key)) continue;
    const auto& retired = retiredParameters();
    const auto old_name = std::find_if(retired.begin(), retired.end(),
                                       [&key = key](const auto& old) { return old.key == key; });
    if (old_name != retired.end()) {
      loaded.errors.push_back({key, "belongs to an earlier version: " + old_name->advice});
      continue;
    }
    const auto& foreign = octomapServerOnly();
    const auto found = foreign.find(key);
    if (found != foreign.end()) {
      loaded.warnings.push_back(
          {key, "is " + describe(value) + " and is ignored: " + found->second});
      continue;
    }
    const auto nearest = findNearestKey(key, known_keys);
    const std::string text = "is " + describe(value) + ", but there is no such parameter" +
                             (nearest ? ": did you mean " + *nearest + '?' : ".");
    if (unknown_keys == UnknownKeys::kRefuse) {
      loaded.errors.push_back({key, text + " Correct the key, or remove it"});
    } else {
      loaded.warnings.push_back({key, text + " It is ignored, as octomap_server does"});
    }
  }
}

}  // namespace

LoadedParameters readParameters(const XmlRpcValue& private_namespace, UnknownKeys unknown_keys) {
  LoadedParameters loaded;
  const auto type = private_namespace.getType();
  const bool is_empty = type == XmlRpcValue::TypeInvalid ||
                        (type == XmlRpcValue::TypeString && private_namespace.size() == 0);
  if (is_empty) return loaded;
  if (type != XmlRpcValue::TypeStruct) {
    loaded.errors.push_back({"~", "is " + describe(private_namespace) +
                                      ", but must be a group of keys: remove the parameter that "
                                      "has the name of this node"});
    return loaded;
  }
  readGroup(
      private_namespace, [](const std::string&) { return true; }, loaded);
  readSources(loaded);
  judgeUnknownKeys(private_namespace, unknown_keys, loaded);
  return loaded;
}

LoadedParameters loadParameters(const ros::NodeHandle& private_handle) {
  XmlRpcValue value;
  const std::string& name = private_handle.getNamespace();
  private_handle.getParam(name, value);
  const bool is_octomap_server = lastPart(name).find("octomap") != std::string::npos;
  return readParameters(value, is_octomap_server ? UnknownKeys::kIgnore : UnknownKeys::kRefuse);
}

}  // namespace cuboid_mapping_ros
