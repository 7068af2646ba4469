// SPDX-License-Identifier: BSD-3-Clause
// Writes a map in another format.
#include "command_line.h"
#include "cuboid_mapping/io/map_files.h"
#include "progress_bar.h"

#include <iostream>

namespace cuboid_mapping {
namespace {

struct Options {
  std::string input;
  std::string output;
  std::string frame_id;
  SensorModelConfig model;
};

int convert(const Options& options) {
  if (!formatOfName(options.output)) {
    throw std::runtime_error(options.output + ": the name must end in one of " + knownEndings());
  }
  MapFile input = readMapFile(options.input, options.model);
  throwIfInterrupted();
  MapSnapshot& map = input.snapshot;
  if (!options.frame_id.empty()) map.frame_id = options.frame_id;
  const std::size_t num_bytes = writeMapFile(options.output, map, showProgress("bricks written"));
  std::cout << options.output << ": " << map.bricks.size() << " bricks, " << num_bytes
            << " bytes; " << options.input << " has " << input.num_bytes << " bytes" << std::endl;
  return 0;
}

int run(int argc, char** argv) {
  Options options;
  CLI::App app("Writes a map in another format; the ending of the output chooses it.",
               "map_convert");
  app.add_option("input", options.input, "native (.cuboids), or OctoMap .ot or .bt")->required();
  app.add_option("output", options.output, "one of " + knownEndings())->required();
  app.add_option("--frame", options.frame_id, "frame to write down in a native file");
  app.add_option("--alpha-min", options.model.alpha_min, "least probability of maps from OctoMap")
      ->check(CLI::Range(0.001, 0.499))
      ->capture_default_str();
  app.add_option("--alpha-max", options.model.alpha_max,
                 "greatest probability of maps from OctoMap")
      ->check(CLI::Range(0.501, 0.999))
      ->capture_default_str();
  if (const auto status = parseCommandLine(app, argc, argv)) return *status;
  return convert(options);
}

}  // namespace
}  // namespace cuboid_mapping

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("map_convert", argc, argv, cuboid_mapping::run);
}
