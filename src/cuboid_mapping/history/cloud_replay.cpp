// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/history/cloud_replay.h"

#include "cuboid_mapping/history/kept_clouds.h"

#include <utility>

namespace cuboid_mapping {

std::vector<Scan> placeScans(const Eigen::Isometry3d& T_map_body,
                             const std::vector<Scan>& scans_body, const ScanLimits& limits,
                             FilterCounts& counts) {
  std::vector<Scan> scans;
  scans.reserve(scans_body.size());
  const auto filter = [&](Scan& scan) {
    const FilterCounts filtered = filterScan(scan, limits);
    counts.num_too_near += filtered.num_too_near;
    counts.num_outside_crop += filtered.num_outside_crop;
  };
  for (const Scan& scan_body : scans_body) {
    Scan scan = placeScan(T_map_body, scan_body);
    filter(scan);
    scan.points.swap(scan.open_ends);  // The limits hold for open ends, too: they are measured.
    filter(scan);
    scan.points.swap(scan.open_ends);
    scans.push_back(std::move(scan));
  }
  return scans;
}

void CloudReplay::put(const std::vector<Scan>& scans_body, const Eigen::Isometry3d& T_map_body,
                      const ObservationConfig& config) {
  const MapConfig& of_map = map_.config();
  ScanUpdater& updater =
      updaters_
          .try_emplace(&config, map_.grid(), config.ranges, of_map.threads, of_map.beamSampling())
          .first->second;
  FilterCounts ignored;
  const std::vector<Scan> scans = placeScans(T_map_body, scans_body, config.limits, ignored);
  (void)updater.compute(scans.data(), scans.size());
  applying_.wait();
  updater.swapUpdate(update_);
  if (!config.clears) keepMarks(update_);
  if (!config.marks) keepClears(update_);
  const auto apply = [this, &config] {
    setThresholds(config.sensor_model);
    map_.apply(update_, SensorModel(config.sensor_model, map_.config().environment));
  };
  if (of_map.threads == 1) return apply();
  applying_ = BackgroundWork(apply);
}

/// The clamping thresholds that the map had when a cloud came: they may change between two clouds.
void CloudReplay::setThresholds(const SensorModelConfig& of_cloud) {
  SensorModelConfig model = map_.config().sensor_model;
  if (model.alpha_min == of_cloud.alpha_min && model.alpha_max == of_cloud.alpha_max) return;
  model.alpha_min = of_cloud.alpha_min;
  model.alpha_max = of_cloud.alpha_max;
  map_.setSensorModel(model);
}

}  // namespace cuboid_mapping
