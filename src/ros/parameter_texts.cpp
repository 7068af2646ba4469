// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters.h"

#include "parameter_table.h"

#include <sstream>

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

std::string inUnit(const ParameterDeclaration& declaration) {
  return declaration.unit.empty() ? "" : " [" + declaration.unit + "]";
}

}  // namespace

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

std::string toMarkdownTable() {
  std::ostringstream out;
  out << "| parameter | default | unit | allowed | meaning |\n| --- | --- | --- | --- | --- |\n";
  for (const ParameterDeclaration& declaration : parameterTable()) {
    out << "| `" << declaration.key << "` | `" << formatValue(declaration, {}) << "` | "
        << declaration.unit << " | " << formatAllowed(declaration) << " | " << declaration.help
        << " |\n";
  }
  for (const LibraryParameter& parameter : libraryParameters()) {
    out << "| `" << parameter.key << "` | `" << parameter.default_text << "` | " << parameter.unit
        << " |  | " << parameter.help << " |\n";
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
    writeComment(out, "Allowed: " + formatAllowed(declaration) + inUnit(declaration) + ".", indent);
    out << indent << declaration.key.substr(is_nested ? slash + 1 : 0) << ": "
        << formatValue(declaration, {}) << '\n';
  }
  return out.str();
}

}  // namespace cuboid_mapping_ros
