// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_adapter.h"

#include "timing.h"

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/point_query.h"
#include "cuboid_mapping/query/ray_query.h"
#include "cuboid_mapping/scan/scan_update.h"

namespace cuboid_mapping::bench {
namespace {

MapperConfig makeConfig(const InsertionConfig& insertion, const EngineOptions& engine) {
  MapperConfig config{insertion.map, insertion.max_range_m};
  config.map.fuse = engine.fuses_every_cloud ? FusionTime::kEveryCloud : FusionTime::kWhenRead;
  return config;
}

}  // namespace

CuboidAdapter::CuboidAdapter(const InsertionConfig& config, const EngineOptions& engine)
    : config_(makeConfig(config, engine)), mapper_(std::make_unique<Mapper>(config_)) {}

void CuboidAdapter::insert(const Scan& scan) { mapper_->integrate(scan); }

void CuboidAdapter::finish() {
  map_ = &mapper_->map();
  (void)countCuboids(*map_);  // Divides what nobody has read.
}

void CuboidAdapter::measureWalk(const std::vector<Scan>& scans, MapFigures& figures) const {
  ScanUpdater updater(map_->grid(), config_.max_range_m, config_.map.threads,
                      config_.map.beamSampling());
  figures.ray_walk_cpu_s = 0.0;
  figures.clouds_by_columns = 0.0;
  for (const Scan& scan : scans) {
    figures.ray_walk_cpu_s += timeOf([&] { updater.compute(scan); }).cpu_s;
    if (updater.numColumnSlabs() > 0) figures.clouds_by_columns += 1.0;
  }
}

void CuboidAdapter::dropScratch() {
  kept_map_ = std::make_unique<CuboidMap>(std::move(*map_));
  mapper_.reset();
}

MapFigures CuboidAdapter::figures() const {
  const TreeSize tree = measureTree(*map_);
  MapFigures figures;
  const CuboidCounts counts = countCuboids(*map_);
  figures.cells = counts.total();
  figures.occupied_cells = counts.occupied;
  figures.free_cells = counts.free;
  figures.leaf_nodes = tree.leaf_nodes;
  figures.inner_nodes = tree.inner_nodes;
  figures.bytes_own = map_->numBytes();
  return figures;
}

double CuboidAdapter::visitOccupied() const {
  double sum = 0.0;
  visitAll(*map_, CuboidFilter::kOccupied, [&sum](const Cuboid& cuboid) {
    sum += cuboid.box.min.x;
    return Visit::kContinue;
  });
  return sum;
}

Occupancy CuboidAdapter::classifyPoint(const Eigen::Vector3d& point_map) const {
  return cuboid_mapping::classifyPoint(*map_, point_map);
}

bool CuboidAdapter::isAnyOccupied(const CellBox& box) const {
  return cuboid_mapping::isAnyOccupied(*map_, box);
}

std::optional<double> CuboidAdapter::castRay(const RayQuery& ray) const {
  const auto hit =
      findFirstHit(*map_, ray.origin_map, ray.direction, kRayRange_m, Budget::unlimited());
  if (!hit.isFound()) return std::nullopt;
  return hit->distance_m;
}

}  // namespace cuboid_mapping::bench
