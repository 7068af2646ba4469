// SPDX-License-Identifier: BSD-3-Clause
// Times the map beside OctoMap and OpenVDB: same process, same clouds, and how far they agree.
#include "command_line.h"
#include "comparison.h"
#include "dataset.h"
#include "report.h"
#include "result_file.h"

namespace cuboid_mapping::bench {
namespace {

int run(int argc, char** argv) {
  Options options;
  if (const auto status = parseOptions(argc, argv, options)) return *status;
  std::optional<ResultFile> json;
  if (!options.json_file.empty()) json.emplace(options.json_file);
  const std::vector<Scan> scans =
      readScans({options.dataset, options.cloud_topic, options.map_frame, options.clouds,
                 options.laps, options.point_step, options.every});
  const Comparison comparison = compareMaps(options, scans);
  printReport(options, scans, comparison);
  if (json) json->write(makeJsonReport(options, scans, comparison));
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("compare_maps", argc, argv, cuboid_mapping::bench::run);
}
