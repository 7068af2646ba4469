// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/parameters.h"

#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <boost/algorithm/string.hpp>

#include <algorithm>
#include <numeric>
#include <sstream>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using XmlRpc::XmlRpcValue;

constexpr char kDefaultsKey[] = "defaults";

/// The text after the last slash.
std::string lastPart(const std::string& key) { return key.substr(key.rfind('/') + 1); }

/// Levenshtein distance: characters to insert, remove or replace.
std::size_t editDistance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row[b.size()];
}

/// The words of a key, in alphabetical order.
std::vector<std::string> partsOf(const std::string& key) {
  std::vector<std::string> words;
  boost::split(words, key, boost::is_any_of("/_"));
  std::sort(words.begin(), words.end());
  return words;
}

/// Distance of two keys, as a whole or after the last slash. A key whose words are
/// all in the other one is near: max_sensor_range is an old name of octomap_server's sensor_model/max_range.
std::size_t distanceBetween(const std::string& key, const std::string& known) {
  const auto words = partsOf(key);
  const auto known_words = partsOf(known);
  const bool is_part =
      std::includes(known_words.begin(), known_words.end(), words.begin(), words.end());
  return std::min({editDistance(key, known), editDistance(lastPart(key), lastPart(known)),
                   is_part ? std::size_t{1} : key.size()});
}

/// The known key most similar to another one; nothing if none is similar.
std::optional<std::string> findNearestKey(const std::string& key,
                                          const std::vector<std::string>& known_keys) {
  std::optional<std::string> nearest;
  const std::size_t length = lastPart(key).size();
  std::size_t limit = std::min(length, std::max<std::size_t>(2, length / 3) + 1);
  for (const std::string& known : known_keys) {
    const std::size_t distance = distanceBetween(key, known);
    if (distance >= limit) continue;
    nearest = known;
    limit = distance;
  }
  return nearest;
}

/// Warns of a slash at the start of a frame: tf2 refuses it, and tf1 ignored it.
void warnOfSlash(const ParameterDeclaration& declaration, const XmlRpcValue& value,
                 LoadedParameters& loaded) {
  const std::string given = textOf(value).value_or("");
  const std::string frame = withoutSlash(given);
  if (!declaration.kind.is_frame || frame == given) return;
  loaded.warnings.push_back({declaration.key, "is " + describe(value) + " and is read as \"" +
                                                  frame +
                                                  "\": tf2 frames have no slash at the start"});
}

/// Sets the value that a parameter has under another name, if the group has one.
/// @pre The value under its own name has been read.
void readOtherName(const XmlRpcValue& group, const OtherName& other, LoadedParameters& loaded) {
  const auto value = findValue(group, other.name);
  if (!value) return;
  const std::string& key = other.of.key;
  const bool is_set =  // Here, or outside of the list of sources.
      findValue(group, key) ||
      formatValue(other.of, loaded.parameters) != formatValue(other.of, {});
  std::string fate = "is used for " + key;
  if (is_set) {
    fate = "is ignored: " + key + " is set";
  } else if (!other.kind.set(loaded.parameters, *value).empty()) {
    if (!other.is_leftover) {
      loaded.errors.push_back({other.name, "is " + describe(*value) + ", but " + key +
                                               ", its new name, must be " + other.kind.allowed});
      return;
    }
    fate = "is ignored: " + key + " must be " + other.kind.allowed;
  }
  loaded.warnings.push_back(
      {other.name, "is " + describe(*value) + " and " + fate + " (" + other.origin + ')'});
}

/// Sets the value of a declaration, if the group has one.
void readValue(const XmlRpcValue& group, const ParameterDeclaration& declaration,
               LoadedParameters& loaded) {
  const auto value = findValue(group, declaration.key);
  if (!value) return;
  const std::string refusal = declaration.kind.set(loaded.parameters, *value);
  if (refusal.empty()) {
    warnOfSlash(declaration, *value, loaded);
    return;
  }
  loaded.errors.push_back({declaration.key, "is " + describe(*value) + ", but must be " +
                                                declaration.kind.allowed + ": " + refusal +
                                                ", or remove it to get the default " +
                                                formatValue(declaration, {})});
}

void readValues(const XmlRpcValue& group, bool is_source, LoadedParameters& loaded) {
  for (const ParameterDeclaration& declaration : parameterTable()) {
    if (!is_source || declaration.kind.is_of_source) readValue(group, declaration, loaded);
  }
  for (const OtherName& other : otherNames()) {
    if (!is_source || other.kind.is_of_source) readOtherName(group, other, loaded);
  }
}

bool isGood(const LoadedParameters& loaded, const std::string& key) {
  return std::none_of(loaded.errors.begin(), loaded.errors.end(),
                      [&](const ParameterError& error) { return error.key == key; });
}

/// Adds an error unless a number is less than the one that it must be below, or one of them has an error already.
void checkOrder(const LoadedParameters& loaded, const ParameterDeclaration& lower,
                std::vector<ParameterError>& errors) {
  const auto& table = parameterTable();
  const auto upper = std::find_if(table.begin(), table.end(), [&](const auto& declaration) {
    return declaration.key == lower.below;
  });
  if (upper == table.end() || !isGood(loaded, lower.key) || !isGood(loaded, upper->key)) return;
  const double least = numberOf(lower.kind.get(loaded.parameters)).value();
  const double most = numberOf(upper->kind.get(loaded.parameters)).value();
  const bool has_no_limit = most == -1.0 && upper->kind.min == -1.0;
  if (least < most || has_no_limit) return;
  errors.push_back({lower.key, "is " + formatNumber(least) + ", but must be less than " +
                                   upper->key + " (" + formatNumber(most) +
                                   "): change one of them"});
}

void checkSets(LoadedParameters& loaded) {
  std::vector<ParameterError> errors;
  for (const ParameterDeclaration& declaration : parameterTable()) {
    checkOrder(loaded, declaration, errors);
  }
  for (const FeatureParameters& feature : featureParameters()) {
    for (ParameterError& error : feature.check(loaded)) errors.push_back(std::move(error));
  }
  for (ParameterError& error : errors) loaded.errors.push_back(std::move(error));
}

/// Keys of this node, and groups of them.
struct KnownKeys {
  std::vector<std::string> parameters;
  std::vector<std::string> groups;

  KnownKeys() {
    for (const ParameterDeclaration& declaration : parameterTable()) {
      parameters.push_back(declaration.key);
      const std::size_t slash = declaration.key.find('/');
      if (slash != std::string::npos) groups.push_back(declaration.key.substr(0, slash));
    }
    for (const auto* names : {&retiredParameters(), &mergedParameters()}) {
      for (const auto& [key, cure] : *names) {
        if (const auto slash = key.find('/'); slash != std::string::npos) {
          groups.push_back(key.substr(0, slash));
        }
      }
    }
  }

  /// Whether it has a key, or a parameter in the place of a group above the key.
  [[nodiscard]] bool has(const std::string& key) const {
    return isOtherName(key, false) ||
           std::any_of(parameters.begin(), parameters.end(), [&key](const std::string& known) {
             return key == known || key.rfind(known + '/', 0) == 0;
           });
  }
};

void judgeUnknownKey(const std::string& key, const XmlRpcValue& value, const KnownKeys& known,
                     LoadedParameters& loaded) {
  if (parametersOfOthers().count(key) > 0) return;
  if (auto error = findRetired(key)) {
    loaded.errors.push_back(std::move(*error));
    return;
  }
  for (const auto* names : {&octomapServerOnly(), &mergedParameters()}) {
    const auto ignored = names->find(key);
    if (ignored == names->end()) continue;
    loaded.warnings.push_back(
        {key, "is " + describe(value) + " and is ignored: " + ignored->second});
    return;
  }
  const std::string text = describeUnknown(key, value, "there is no such", known.parameters);
  if (loaded.parameters.ignores_unknown) {
    loaded.warnings.push_back({key, text + " It is ignored"});
  } else {
    loaded.errors.push_back({key, text + " Correct the key, or remove it"});
  }
}

void judgeUnknownKeys(const XmlRpcValue& group, LoadedParameters& loaded) {
  const KnownKeys known;
  for (const auto& [name, value] : group) {
    const bool is_whole = octomapServerOnly().count(name) > 0;  // Such as the group color.
    const bool is_group = value.getType() == XmlRpcValue::TypeStruct && !is_whole;
    if (is_group && !known.has(name) && !findNearestKey(name, known.groups)) {
      loaded.warnings.push_back({name,
                                 "is a group of keys that this node does not have: taken for "
                                 "another node's, and ignored. This node's keys have no name above "
                                 "them"});
      continue;
    }
    for (const auto& [rest, leaf] :
         is_whole ? std::map<std::string, XmlRpcValue>{{"", value}} : leavesOf(value)) {
      std::string key = name;
      if (is_group) key.append("/").append(rest);
      if (!known.has(key)) judgeUnknownKey(key, leaf, known, loaded);
    }
  }
}

/// Adds the values that a group lacks.
void addMissing(const XmlRpcValue& defaults, XmlRpcValue& group) {
  for (const auto& [name, value] : defaults) {
    if (!group.hasMember(name)) {
      group[name] = value;
    } else if (value.getType() == XmlRpcValue::TypeStruct &&
               group[name].getType() == XmlRpcValue::TypeStruct) {
      addMissing(value, group[name]);
    }
  }
}

/// A group whose member "defaults" has given way to the values in it: launch files set these for what
/// nobody else sets.
XmlRpcValue applyDefaults(const XmlRpcValue& group, LoadedParameters& loaded) {
  if (!group.hasMember(kDefaultsKey)) return group;
  XmlRpcValue applied;
  (void)applied.begin();  // Makes it a group, also without keys.
  for (const auto& [name, value] : group) {
    if (name != kDefaultsKey) applied[name] = value;
  }
  const XmlRpcValue& defaults = group[kDefaultsKey];
  if (defaults.getType() == XmlRpcValue::TypeStruct) {
    addMissing(defaults, applied);
  } else {
    loaded.errors.push_back({kDefaultsKey, "is " + describe(defaults) +
                                               ", but must be a group of keys, or be removed"});
  }
  return applied;
}

}  // namespace

std::map<std::string, XmlRpcValue> leavesOf(const XmlRpcValue& group) {
  if (group.getType() != XmlRpcValue::TypeStruct) return {{"", group}};
  std::map<std::string, XmlRpcValue> leaves;
  for (const auto& [name, member] : group) {
    for (const auto& [rest, leaf] : leavesOf(member)) {
      std::string key = name;
      if (!rest.empty()) key.append("/").append(rest);
      leaves[key] = leaf;
    }
  }
  return leaves;
}

std::optional<XmlRpcValue> findValue(const XmlRpcValue& group, const std::string& key) {
  if (group.getType() != XmlRpcValue::TypeStruct) return std::nullopt;
  if (group.hasMember(key)) return group[key];
  const std::size_t slash = key.find('/');
  const std::string name = key.substr(0, slash);
  if (slash == std::string::npos || !group.hasMember(name)) return std::nullopt;
  return findValue(group[name], key.substr(slash + 1));
}

std::string describeUnknown(const std::string& key, const XmlRpcValue& value,
                            const std::string& no_such,
                            const std::vector<std::string>& known_keys) {
  const auto nearest = findNearestKey(key, known_keys);
  return "is " + describe(value) + ", but " + no_such + " parameter" +
         (nearest ? ": did you mean " + *nearest + '?' : ".");
}

void readGroup(const XmlRpcValue& group, bool is_source, LoadedParameters& loaded) {
  readValues(group, is_source, loaded);
  checkSets(loaded);
}

LoadedParameters readParameters(const XmlRpcValue& private_namespace) {
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
  const XmlRpcValue group = applyDefaults(private_namespace, loaded);
  readGroup(group, false, loaded);
  readSources(loaded);
  judgeUnknownKeys(group, loaded);
  return loaded;
}

LoadedParameters loadParameters(const ros::NodeHandle& private_handle) {
  XmlRpcValue value;
  private_handle.getParam(private_handle.getNamespace(), value);
  return readParameters(value);
}

FindText findTextFrom(const ros::NodeHandle& private_nh) {
  return [private_nh](const std::string& name) -> std::optional<std::string> {
    std::string key;
    std::string text;
    if (!private_nh.searchParam(name, key) || !private_nh.getParam(key, text)) return std::nullopt;
    return text;
  };
}

void readReferences(NodeParameters& parameters, const FindText& find_text) {
  for (const FeatureParameters& feature : featureParameters()) {
    feature.read_references(parameters, find_text);
  }
}

std::size_t maxEntries(const ServiceLimits& limits, std::size_t entry_bytes) {
  const std::size_t max_bytes = static_cast<std::size_t>(limits.max_answer_mb) * 1000000;
  return std::min(static_cast<std::size_t>(limits.max_entries), max_bytes / entry_bytes);
}

std::string explain(BudgetLimit why, const ServiceLimits& limits) {
  std::ostringstream text;
  switch (why) {
    case BudgetLimit::kNone: break;
    case BudgetLimit::kTime:
      text << "ended by its time, at most " << limits.max_time_s << " s (parameter query/max_time)";
      break;
    case BudgetLimit::kBricks: text << "ended after " << limits.max_bricks << " bricks"; break;
    case BudgetLimit::kEntries:
      text << "ended by the size of the answer, at most " << limits.max_entries << " entries and "
           << limits.max_answer_mb << " MB";
      break;
    case BudgetLimit::kStopped: text << "ended because the node stops"; break;
  }
  return text.str();
}

}  // namespace cuboid_mapping_ros
