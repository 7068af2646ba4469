// SPDX-License-Identifier: BSD-3-Clause
#include "dataset.h"

#include "command_line.h"
#include "progress_bar.h"

#include "data_sets/scan_dataset.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <utility>

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

/// Keeps the first of `step` items.
template <typename ItemT>
void keepEvery(std::vector<ItemT>& items, int step) {
  if (step == 1) return;
  std::size_t count = 0;
  for (std::size_t i = 0; i < items.size(); i += static_cast<std::size_t>(step)) {
    if (i > 0) items[count] = std::move(items[i]);
    ++count;
  }
  items.resize(count);
}

}  // namespace

std::vector<Scan> readScans(const DatasetChoice& choice) {
  const bool is_bag = std::filesystem::path(choice.path).extension() == ".bag";
  std::vector<Scan> scans = is_bag ? readBagScans(choice) : readDatasetScans(choice);
  if (std::all_of(scans.begin(), scans.end(), [](const Scan& s) { return s.points.empty(); })) {
    throw std::runtime_error(choice.path + " holds no points");
  }
  keepEvery(scans, choice.every);
  for (Scan& scan : scans) keepEvery(scan.points, choice.point_step);
  return repeatElsewhere(scans, choice.laps);
}

std::vector<Scan> repeatElsewhere(const std::vector<Scan>& scans, int laps) {
  if (laps == 1) return scans;
  double least_x = std::numeric_limits<double>::max();
  double greatest_x = std::numeric_limits<double>::lowest();
  for (const Scan& scan : scans) {
    for (const Eigen::Vector3f& point : scan.points) {
      if (!point.allFinite()) continue;
      least_x = std::min(least_x, scan.anchor_map.x() + point.x());
      greatest_x = std::max(greatest_x, scan.anchor_map.x() + point.x());
    }
  }
  constexpr double kUnit_m = 64.0;
  const double lap_m = kUnit_m * (std::ceil((greatest_x - least_x) / kUnit_m) + 1.0);
  std::vector<Scan> drive;
  for (int lap = 0; lap < laps; ++lap) {
    // Around the origin, where the numbers are the finest.
    const int laps_from_middle = lap - laps / 2;
    const auto shift_m = static_cast<float>(lap_m * laps_from_middle);
    for (Scan scan : scans) {
      scan.origin.x() += shift_m;
      for (Eigen::Vector3f& point : scan.points) point.x() += shift_m;
      for (Eigen::Vector3f& point : scan.no_returns) point.x() += shift_m;
      drive.push_back(std::move(scan));
    }
  }
  return drive;
}

}  // namespace cuboid_mapping::bench
