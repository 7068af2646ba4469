// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Inside of parameters.h: the one table that drives reading, checking and documentation.

#include "cuboid_mapping/ros/parameters/parameters.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace cuboid_mapping_ros {

/// A number in a closed interval, never NaN or infinite.
struct NumberKind {
  double& (*field)(NodeParameters&);
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  /// What -1 stands for, where it is allowed besides the interval.
  std::optional<double> minus_one = std::nullopt;
};

/// A whole number in a closed interval.
struct IntegerKind {
  int& (*field)(NodeParameters&);
  int min;
  int max;
};

struct BooleanKind {
  bool& (*field)(NodeParameters&);
};

/// A tf2 frame.
struct FrameKind {
  std::string& (*field)(NodeParameters&);
  bool may_be_empty;
};

/// A path of the file system.
struct FileKind {
  std::string& (*field)(NodeParameters&);
};

/// One name of a list.
struct ChoiceKind {
  std::vector<std::string> names;
  std::function<void(NodeParameters&, const std::string& name)> set;
  std::function<std::string(NodeParameters&)> get;
};

/// A text of some form.
struct TextKind {
  std::string allowed;                                    ///< In words.
  bool (*set)(NodeParameters&, const std::string& text);  ///< Refuses with false.
  std::string (*get)(const NodeParameters&);
};

/// A list, whose elements have a form of their own.
struct ListKind {
  std::string allowed;  ///< In words.
  /// Says why a value is refused; nothing where it is taken.
  std::string (*set)(NodeParameters&, const XmlRpc::XmlRpcValue& list);
  XmlRpc::XmlRpcValue (*get)(const NodeParameters&);  ///< As it was given.
  std::string (*describe)(const NodeParameters&);     ///< As YAML.
};

/// The kind of one of some values of an enumeration, by the names that toString() gives them.
template <typename Enumeration>
ChoiceKind oneOf(const std::vector<Enumeration>& values, Enumeration& (*field)(NodeParameters&)) {
  std::vector<std::string> names;
  names.reserve(values.size());
  for (const Enumeration value : values) names.emplace_back(toString(value));
  return {names,
          [values, names, field](NodeParameters& p, const std::string& name) {
            const auto place = std::find(names.begin(), names.end(), name) - names.begin();
            field(p) = values.at(static_cast<std::size_t>(place));
          },
          [field](NodeParameters& p) -> std::string { return toString(field(p)); }};
}

/// One parameter of the node. Its default is that of NodeParameters.
struct ParameterDeclaration {
  std::string key;
  std::string unit;  ///< Empty for numbers without one, and for what is no number.
  std::variant<NumberKind, IntegerKind, BooleanKind, FrameKind, FileKind, ChoiceKind, TextKind,
               ListKind>
      kind;
  std::string help;
};

/// A parameter that a library reads from the node's private namespace.
struct LibraryParameter {
  std::string key;
  std::string default_text;
  std::string unit;
  std::string help;
};

/// A parameter that earlier versions had.
struct RetiredParameter {
  std::string key;
  std::string advice;  ///< Why it has gone, and what to do.
};

[[nodiscard]] const std::vector<RetiredParameter>& retiredParameters();

/// Those of OctomapServerParameters, for parameterTable().
[[nodiscard]] std::vector<ParameterDeclaration> declareOctomapServer();

/// Those of SourceParameters, and the list of sources, for parameterTable().
[[nodiscard]] std::vector<ParameterDeclaration> declareSources();

/// Those of SelfFilterParameters, for parameterTable().
[[nodiscard]] std::vector<ParameterDeclaration> declareSelfFilter();

/// Whether an element of the list of sources may have a parameter of its own for this key.
[[nodiscard]] bool isOfSource(const std::string& key);

/// Those of FleetParameters, for parameterTable().
[[nodiscard]] std::vector<ParameterDeclaration> declareFleet();

/// Those of WindowParameters, for parameterTable().
[[nodiscard]] std::vector<ParameterDeclaration> declareWindow();

/// What of the window does not go with other parameters, or is missing.
[[nodiscard]] std::vector<ParameterError> checkWindow(const NodeParameters& parameters);

/// All parameters; keys with the same part before the slash are neighbours.
[[nodiscard]] const std::vector<ParameterDeclaration>& parameterTable();

[[nodiscard]] const std::vector<LibraryParameter>& libraryParameters();

/// Whether octomap_server has a parameter of this name.
[[nodiscard]] bool isOfOctomapServer(const std::string& key);

/// Names that octomap_server has and this node has not, and why that does no harm.
[[nodiscard]] const std::map<std::string, std::string>& octomapServerOnly();

/// A short decimal number that reads back as `value` and that YAML takes for a floating point
/// number: "0.05", "1.0", "1.0e+09".
[[nodiscard]] std::string formatNumber(double value);

/// The value of a parameter as YAML; text in quotes.
[[nodiscard]] std::string formatValue(const ParameterDeclaration& declaration,
                                      const NodeParameters& parameters);

/// The allowed values in words, as "a number from 0.501 to 0.999".
[[nodiscard]] std::string formatAllowed(const ParameterDeclaration& declaration);

}  // namespace cuboid_mapping_ros
