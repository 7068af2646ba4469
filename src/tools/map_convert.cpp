// SPDX-License-Identifier: BSD-3-Clause
// Writes a map in another format.
#include "command_line.h"
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_files.h"
#include "map_content.h"
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
  const auto format = formatOfName(options.output);
  if (!format) {
    throw std::runtime_error(options.output + ": its name must end in one of " + knownEndings());
  }
  checkReplaceable(options.output);
  MapFile input = readMapFile(options.input, options.model);
  throwIfInterrupted();
  MapSnapshot& map = input.snapshot;
  if (!options.frame_id.empty()) map.frame_id = options.frame_id;
  const std::size_t num_bytes = writeMapFile(options.output, map, showProgress("bricks written"));
  std::cout << options.output << ": " << describeContent(map, *format) << ", " << num_bytes
            << " bytes; " << options.input << " has " << input.num_bytes << " bytes" << std::endl;
  return 0;
}

int run(int argc, char** argv) {
  Options options;
  CommandLine line("map_convert",
                   "Converts a map; the extension of the output selects the format.");
  line.addArgument("input", options.input, "map: .cuboids, .ot or .bt");
  line.addArgument("output", options.output, "one of " + knownEndings());
  line.addText("frame", options.frame_id, "name of the frame to store in a native file");
  line.addNumber("sensor_model/min", options.model.alpha_min,
                 "lowest probability, for maps from OctoMap", {0.001, 0.499});
  line.addNumber("sensor_model/max", options.model.alpha_max,
                 "highest probability, for maps from OctoMap", {0.501, 0.999});
  if (const auto status = line.parse(argc, argv)) return *status;
  return convert(options);
}

}  // namespace
}  // namespace cuboid_mapping

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("map_convert", argc, argv, cuboid_mapping::run);
}
