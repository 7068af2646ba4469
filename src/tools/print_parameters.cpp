// SPDX-License-Identifier: BSD-3-Clause
// Prints the parameters of the node for its documents: the table of README.md, config/default.yaml.

#include "cuboid_mapping/ros/parameters.h"

#include <CLI/CLI.hpp>

#include <iostream>

int main(int argc, char** argv) {
  CLI::App app{"Prints the parameters of cuboid_mapping with their defaults and help."};
  bool is_markdown = false;
  bool is_yaml = false;
  auto* format = app.add_option_group("format");
  format->add_flag("--markdown", is_markdown, "The table of README.md");
  format->add_flag("--yaml", is_yaml, "config/default.yaml");
  format->require_option(1);
  CLI11_PARSE(app, argc, argv);
  std::cout << (is_markdown ? cuboid_mapping_ros::toMarkdownTable() : cuboid_mapping_ros::toYaml());
  return 0;
}
