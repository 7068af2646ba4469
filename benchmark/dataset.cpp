// SPDX-License-Identifier: BSD-3-Clause
#include "dataset.h"

#include "command_line.h"
#include "progress_bar.h"

#include "cuboid_mapping/io/scan_dataset.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

namespace cuboid_mapping::bench {
namespace {

std::vector<Scan> readDatasetScans(const DatasetChoice& choice) {
  const auto dataset = openScanDataset(choice.path);
  const std::size_t count = std::min(dataset->size(), choice.max_scans);
  ProgressBar progress("clouds read", count);
  std::vector<Scan> scans;
  for (std::size_t i = 0; i < count; ++i) {
    throwIfInterrupted();
    const ScanDataset::Item item = dataset->read(i);
    scans.push_back(
        makeScan(item.T_map_sensor, item.T_map_sensor.translation(), item.points_sensor));
    progress.update(i + 1);
  }
  return scans;
}

}  // namespace

std::vector<Scan> readScans(const DatasetChoice& choice) {
  const bool is_bag = std::filesystem::path(choice.path).extension() == ".bag";
  std::vector<Scan> scans = is_bag ? readBagScans(choice) : readDatasetScans(choice);
  if (std::all_of(scans.begin(), scans.end(), [](const Scan& s) { return s.points.empty(); })) {
    throw std::runtime_error(choice.path + " holds no points");
  }
  return scans;
}

}  // namespace cuboid_mapping::bench
