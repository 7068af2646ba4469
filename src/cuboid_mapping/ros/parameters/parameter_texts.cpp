// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/parameters.h"

#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <locale>
#include <sstream>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

std::string formatFloating(double value, int precision) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(precision);
  out << value;
  return out.str();
}

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

/// Breaks a text into comment lines of at most 100 characters.
void writeComment(std::ostream& out, const std::string& text, const std::string& indent) {
  constexpr std::size_t kMaxWidth = 100;
  std::istringstream words(text);
  std::string line = indent + "#";
  for (std::string word; words >> word;) {
    if (line.size() + 1 + word.size() > kMaxWidth) {
      out << line << '\n';
      line = indent + "#";
    }
    line += ' ' + word;
  }
  out << line << '\n';
}

/// Groups of the document, in its order.
enum class Group : unsigned char { kFirst, kSensor, kMap, kOutput, kAdvanced };

constexpr std::array<std::pair<Group, const char*>, 5> kGroupHeads = {{
    {Group::kFirst, "The first ten"},
    {Group::kSensor, "Sensor"},
    {Group::kMap, "Map"},
    {Group::kOutput, "Output"},
    {Group::kAdvanced, "Advanced"},
}};

/// Keys, or their starts, of the groups that do not follow from the declaration.
const std::vector<std::pair<Group, std::vector<std::string>>> kGroupKeys = {
    {Group::kFirst,
     {"frame_id", "resolution", "sensor_frame", "sources", "sensor_model/max_range",
      "sensor_model/min_range", "deskew", "self_filter/robot_description", "forget_after",
      "autosave_file"}},
    {Group::kSensor, {"self_filter/", "moving_points", "base_frame_id", "tf_wait", "queue_size"}},
    {Group::kMap,
     {"environment", "fusion", "sensor_model/", "map_file", "autosave_period", "window/",
      "keep_clouds/", "forget", "start_free", "merge/"}},
    {Group::kOutput,
     {"publish_", "keyframe_period", "robot_grid/", "occupancy_", "min_x_size", "min_y_size",
      "filter_speckles", "observation"}},
};

Group groupOf(const ParameterDeclaration& declaration) {
  for (const auto& group_keys : kGroupKeys) {
    const Group group = group_keys.first;
    const auto& keys = group_keys.second;
    if (group == Group::kSensor && declaration.kind.is_of_source) return group;
    const auto matches = [&](const std::string& key) {
      const bool is_start = group != Group::kFirst;
      return is_start ? declaration.key.rfind(key, 0) == 0 : declaration.key == key;
    };
    if (std::any_of(keys.begin(), keys.end(), matches)) return group;
  }
  return Group::kAdvanced;
}

/// Writes the table of a group.
void writeRows(std::ostream& out, Group group) {
  out << "| parameter | default | allowed | meaning |\n|---|---|---|---|\n";
  for (const ParameterDeclaration& declaration : parameterTable()) {
    if (groupOf(declaration) != group) continue;
    const char* mark = isOfOctomapServer(declaration.key) ? "**" : "";
    out << "| " << mark << '`' << declaration.key << '`' << mark << " | `"
        << formatValue(declaration, {}) << '`'
        << (declaration.unit.empty() ? "" : " " + declaration.unit) << " | "
        << declaration.kind.allowed << " | " << declaration.help << " |\n";
  }
}

std::string inUnit(const ParameterDeclaration& declaration) {
  return declaration.unit.empty() ? "" : " [" + declaration.unit + "]";
}

}  // namespace

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

std::string toMarkdownTable() {
  std::ostringstream out;
  out << "# Parameters\n\n"
         "<!-- Written by scripts/reference. -->\n\n"
         "All are private parameters of the node. Names in bold are those of octomap_server, with "
         "the same meaning. With a\nbad value or an unknown name the node does not start, and "
         "lists "
         "everything that is wrong; with `ignore_unknown`,\nunknown names are only warnings. "
         "[config/default.yaml](../config/default.yaml) holds all defaults.\n";
  for (const auto& [group, head] : kGroupHeads) {
    out << "\n## " << head << "\n\n";
    if (group == Group::kSensor) {
      out << "Except `self_filter`, `moving_points`, `base_frame_id`, `tf_wait` and `queue_size`, "
             "each of `sources` may\nhave its own.\n\n";
    }
    writeRows(out, group);
  }
  return out.str();
}

std::string toYaml() {
  std::ostringstream out;
  out << "# Parameters of cuboid_mapping with their defaults. Written by\n"
         "#   rosrun cuboid_mapping print_parameters --yaml\n";
  std::string group;
  for (const ParameterDeclaration& declaration : parameterTable()) {
    const std::size_t slash = declaration.key.find('/');
    const bool is_nested = slash != std::string::npos;
    const std::string own_group = is_nested ? declaration.key.substr(0, slash) : "";
    out << '\n';
    if (own_group != group && is_nested) out << own_group << ":\n";
    group = own_group;
    const std::string indent = is_nested ? "  " : "";
    writeComment(out, declaration.help, indent);
    writeComment(out, "Allowed: " + declaration.kind.allowed + inUnit(declaration) + ".", indent);
    out << indent << declaration.key.substr(is_nested ? slash + 1 : 0) << ": "
        << formatValue(declaration, {}) << '\n';
  }
  return out.str();
}

}  // namespace cuboid_mapping_ros
