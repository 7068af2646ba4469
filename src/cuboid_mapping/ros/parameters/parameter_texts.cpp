// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/parameters.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

/// A value of any depth as YAML, in one line.
std::string toFlow(XmlRpc::XmlRpcValue value) {
  std::string text;
  if (value.getType() == XmlRpc::XmlRpcValue::TypeArray) {
    for (int i = 0; i < value.size(); ++i) text += (i == 0 ? "" : ", ") + toFlow(value[i]);
    return '[' + text + ']';
  }
  if (value.getType() != XmlRpc::XmlRpcValue::TypeStruct) return describe(value);
  for (const auto& [key, member] : value) {
    text += (text.empty() ? "" : ", ") + key + ": " + toFlow(member);
  }
  return '{' + text + '}';
}

std::string inUnit(const ParameterDeclaration& declaration) {
  return declaration.unit.empty() ? "" : " [" + declaration.unit + "]";
}

}  // namespace

std::string formatNumber(double value) {
  if (std::isnan(value)) return ".nan";
  if (std::isinf(value)) return value > 0.0 ? ".inf" : "-.inf";
  std::string text = toExactText(value);
  if (text.find('.') != std::string::npos) return text;
  return text.insert(std::min(text.find('e'), text.size()), ".0");
}

std::string describe(XmlRpc::XmlRpcValue value) {
  using XmlRpc::XmlRpcValue;
  switch (value.getType()) {
    case XmlRpcValue::TypeBoolean: return static_cast<bool&>(value) ? "true" : "false";
    case XmlRpcValue::TypeInt: return std::to_string(static_cast<int&>(value));
    case XmlRpcValue::TypeDouble: return formatNumber(static_cast<double&>(value));
    case XmlRpcValue::TypeString: return '"' + static_cast<std::string&>(value) + '"';
    case XmlRpcValue::TypeArray: return "a list";
    case XmlRpcValue::TypeStruct: return "a group of keys";
    default: return "not a plain value";
  }
}

std::string formatValue(const ParameterDeclaration& declaration, const NodeParameters& parameters) {
  const XmlRpc::XmlRpcValue value = declaration.kind.get(parameters);
  if (declaration.kind.is_name) return *textOf(value);
  return value.valid() ? toFlow(value) : "[]";
}

std::vector<std::string> toLogLines(const NodeParameters& parameters) {
  std::vector<std::string> lines;
  for (const ParameterDeclaration& declaration : parameterTable()) {
    const std::string value = formatValue(declaration, parameters);
    const bool is_default = value == formatValue(declaration, {});
    lines.push_back(declaration.key + ": " + value + inUnit(declaration) +
                    (is_default ? " (default)" : ""));
  }
  return lines;
}

std::vector<std::string> toDifferenceLines(const NodeParameters& parameters,
                                           const NodeParameters& others, const std::string& word) {
  std::vector<std::string> lines;
  for (const ParameterDeclaration& declaration : parameterTable()) {
    const std::string value = formatValue(declaration, parameters);
    const std::string other = formatValue(declaration, others);
    if (value == other) continue;
    std::ostringstream line;
    line << declaration.key << ": " << value << inUnit(declaration) << " (" << word << ": " << other
         << ")";
    lines.push_back(line.str());
  }
  return lines;
}

std::vector<std::string> toSourceLines(const NodeParameters& parameters) {
  NodeParameters outside = parameters;
  outside.sources.clear();
  std::vector<std::string> lines;
  for (const SourceParameters& source : parameters.sources) {
    NodeParameters with = outside;
    with.source = source;
    for (const std::string& line : toDifferenceLines(with, outside, "outside the list")) {
      lines.push_back("source " + nameOf(source) + ": " + line);
    }
  }
  return lines;
}

}  // namespace cuboid_mapping_ros
