// SPDX-License-Identifier: BSD-3-Clause
// Internal to parameters.h: the one table for reading, checking and documentation.
#pragma once

#include "cuboid_mapping/ros/parameters/parameter_kinds.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// One parameter of the node. NodeParameters has its default.
struct ParameterDeclaration {
  std::string key;
  std::string unit;  ///< Empty for numbers without one, and for other values.
  ParameterKind kind;
  std::string help;
  std::string below = {};  ///< Number that must be greater than this one; empty: none.
};

/// Part of parameterTable(): has the first parameters of SourceParameters, and the list of
/// sources.
[[nodiscard]] std::vector<ParameterDeclaration> declareSources();

/// Parameters of a feature, or of a step of the sensors.
struct FeatureParameters {
  std::vector<ParameterDeclaration> (*declare)();
  /// Conflicts of its parameters with each other, and with those of others.
  std::vector<ParameterError> (*check)(const LoadedParameters& loaded);
  /// Reads what they name.
  void (*read_references)(NodeParameters& parameters, const FindText& find_text);
};

/// Of all features and steps; see features.cpp.
[[nodiscard]] const std::vector<FeatureParameters>& featureParameters();

/// Keys of earlier versions, with the reason of their removal and the cure.
[[nodiscard]] const std::map<std::string, std::string>& retiredParameters();
/// The error that one of these is; nothing for another key.
[[nodiscard]] std::optional<ParameterError> findRetired(const std::string& key);

/// All parameters; keys with the same part before the slash are neighbours.
[[nodiscard]] const std::vector<ParameterDeclaration>& parameterTable();

/// Another name of a parameter. Its value counts where the parameter is not set, and there is a warning.
struct OtherName {
  std::string name;
  ParameterDeclaration of;
  ParameterKind kind;  ///< Place of the value.
  std::string origin;
  bool is_leftover;  ///< Nobody has written it for this node: a bad value is ignored.
};

/// Names that octomap_server's dynamic_reconfigure leaves on the parameter server, and some of earlier versions.
[[nodiscard]] const std::vector<OtherName>& otherNames();
/// Whether a key is one of them. @param is_source  Only those that a source may have count.
[[nodiscard]] bool isOtherName(const std::string& key, bool is_source);

/// Parameters of earlier versions that have become part of others, which the warning names.
[[nodiscard]] const std::map<std::string, std::string>& mergedParameters();

/// Keys in the node's namespace that nodelet and diagnostic_updater read.
[[nodiscard]] const std::set<std::string>& parametersOfOthers();

/// Names that only octomap_server has, with the reason why this node does not need them.
[[nodiscard]] const std::map<std::string, std::string>& octomapServerOnly();

/// A short decimal number that reads back as `value` and is a floating point number in
/// YAML: "0.05", "1.0", "1.0e+09".
[[nodiscard]] std::string formatNumber(double value);

/// The value of a parameter as YAML; text in quotes.
[[nodiscard]] std::string formatValue(const ParameterDeclaration& declaration,
                                      const NodeParameters& parameters);

/// Values that are no structs, by their keys with slashes.
[[nodiscard]] std::map<std::string, XmlRpc::XmlRpcValue> leavesOf(const XmlRpc::XmlRpcValue& group);

/// The value of a key in a group; each slash may be a part of a key or lead into a group.
[[nodiscard]] std::optional<XmlRpc::XmlRpcValue> findValue(const XmlRpc::XmlRpcValue& group,
                                                           const std::string& key);

/// A value as YAML, shortened to one line.
[[nodiscard]] std::string describe(XmlRpc::XmlRpcValue value);

/// Text such as "is 3, but there is no such parameter: did you mean x?". @param no_such  Such as "there is no
/// such".
[[nodiscard]] std::string describeUnknown(const std::string& key, const XmlRpc::XmlRpcValue& value,
                                          const std::string& no_such,
                                          const std::vector<std::string>& known_keys);

/// Reads all parameters, or those that a source may have, and checks them against each other.
void readGroup(const XmlRpc::XmlRpcValue& group, bool is_source, LoadedParameters& loaded);

/// Reads the list of sources. @pre All other parameters have been read.
void readSources(LoadedParameters& loaded);

}  // namespace cuboid_mapping_ros
