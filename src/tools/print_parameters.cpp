// SPDX-License-Identifier: BSD-3-Clause
// Prints the parameters of the node for scripts/reference.
#include "command_line.h"
#include "parameter_pages.h"

#include <iostream>
#include <stdexcept>

namespace cuboid_mapping_ros {
namespace {

int run(int argc, char** argv) {
  bool is_markdown = false;
  bool is_yaml = false;
  cuboid_mapping::CommandLine line(
      "print_parameters", "Prints the parameters of cuboid_mapping with their defaults and help.");
  line.addFlag("markdown", is_markdown, "print a table for each group, as in doc/parameters.md");
  line.addFlag("yaml", is_yaml, "print a file for rosparam, such as config/default.yaml");
  if (const auto status = line.parse(argc, argv)) return *status;
  if (is_markdown == is_yaml) throw std::runtime_error("give either --markdown or --yaml");
  std::cout << (is_markdown ? toMarkdownTable() : toYaml());
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping_ros

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("print_parameters", argc, argv, cuboid_mapping_ros::run);
}
