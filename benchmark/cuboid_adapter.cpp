// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_adapter.h"

#include "timing.h"

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/point_query.h"
#include "cuboid_mapping/query/ray_query.h"

namespace cuboid_mapping::bench {
namespace {

MapConfig withEngine(MapConfig config, const EngineOptions& engine) {
  config.threads = engine.threads;
  return config;
}

}  // namespace

CuboidAdapter::CuboidAdapter(const InsertionConfig& config, const EngineOptions& engine)
    : map_(std::make_unique<CuboidMap>(withEngine(config.map, engine))),
      updater_(std::make_unique<ScanUpdater>(map_->grid(), config.max_range_m, engine.threads,
                                             config.map.beamSampling())),
      fuses_every_cloud_(engine.fuses_every_cloud) {}

void CuboidAdapter::insert(const Scan& scan) {
  const ScanUpdate* update = nullptr;
  ray_walk_cpu_s_ += timeOf([&] { update = &updater_->compute(scan); }).cpu_s;
  map_->apply(*update);
  if (fuses_every_cloud_) map_->fuse();
}

void CuboidAdapter::finish() { map_->fuse(); }

MapFigures CuboidAdapter::figures() const {
  const RTree& tree = map_->tree();
  MapFigures figures;
  figures.cells = tree.size();
  const CuboidCounts counts = countCuboids(*map_);
  figures.occupied_cells = counts.occupied;
  figures.free_cells = counts.free;
  figures.leaf_nodes = tree.numLeafNodes();
  figures.inner_nodes = tree.numInnerNodes();
  figures.bytes_own = map_->numBytes();
  figures.ray_walk_cpu_s = ray_walk_cpu_s_;
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
  const auto hit = findFirstHit(*map_, ray.origin_map, ray.direction, kRayRange_m);
  if (!hit) return std::nullopt;
  return hit->distance_m;
}

}  // namespace cuboid_mapping::bench
