// SPDX-License-Identifier: BSD-3-Clause
#include "parameter_pages.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <algorithm>
#include <array>
#include <set>
#include <sstream>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

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

/// Whether octomap_server has a parameter of this name.
bool isOfOctomapServer(const std::string& key) {
  static const std::vector<std::string> kNames = wordsOf(
      "frame_id base_frame_id resolution map_file filter_ground ground_filter/distance "
      "ground_filter/angle ground_filter/plane_distance sensor_model/hit sensor_model/miss "
      "sensor_model/min sensor_model/max sensor_model/min_range sensor_model/max_range "
      "occupancy_min_z occupancy_max_z min_x_size min_y_size filter_speckles");
  static const std::set<std::string> kTheirs(kNames.begin(), kNames.end());
  return kTheirs.count(key) > 0 || key.rfind("pointcloud_", 0) == 0;
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

}  // namespace

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
    const std::string unit = declaration.unit.empty() ? "" : " [" + declaration.unit + "]";
    writeComment(out, "Allowed: " + declaration.kind.allowed + unit + ".", indent);
    out << indent << declaration.key.substr(is_nested ? slash + 1 : 0) << ": "
        << formatValue(declaration, {}) << '\n';
  }
  return out.str();
}

}  // namespace cuboid_mapping_ros
