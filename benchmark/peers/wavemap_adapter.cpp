// SPDX-License-Identifier: BSD-3-Clause
#include "map_adapter.h"

#include "peers/known_cells.h"
#include "peers/our_voxels.h"

#include "cuboid_mapping/geometry/grid.h"

#include <wavemap/core/indexing/index_conversions.h>
#include <wavemap/core/map/hashed_chunked_wavelet_octree.h>
#include <wavemap/core/utils/query/query_accelerator.h>

#include <cmath>
#include <optional>

namespace cuboid_mapping::bench {
namespace {

using WaveletMap = wavemap::HashedChunkedWaveletOctree;

wavemap::Index3D toIndex(const Cell& cell) { return {cell.x, cell.y, cell.z}; }

/// Unknown voxels are those near 0. wavemap::OccupancyClassifier draws the line at 0.001, but what its pruning
/// leaves out adds up to 0.01 in voxels that nothing has observed.
Occupancy classifyWavelet(float log_odds) {
  constexpr float kUnknown = 0.02F;
  return std::abs(log_odds) < kUnknown ? Occupancy::kUnknown : classify(log_odds);
}

/// Filled voxel by voxel with our update of each cloud.
class WavemapAdapter : public PeerAdapter {
 public:
  explicit WavemapAdapter(const InsertionConfig& config)
      : grid_(config.map.resolution_m),
        sensor_model_(config.map.sensor_model),
        voxels_(grid_, config.max_range_m),
        map_(std::make_unique<WaveletMap>(makeConfig(config.map, sensor_model_))) {}

  [[nodiscard]] std::string name() const override { return "wavemap"; }
  /// It has neither a search of boxes nor one along a ray.
  [[nodiscard]] bool offers(QueryKind kind) const override { return kind == QueryKind::kPoint; }

  void insert(const Scan& scan) override {
    OurVoxels::forEach(
        voxels_.compute(scan), [this](const Cell& cell) { add(cell, sensor_model_.miss()); },
        [this](const Cell& cell) { add(cell, sensor_model_.hit()); });
    map_->threshold();
  }

  void finish() override { map_->prune(); }
  void dropScratch() override { voxels_.drop(); }

  void dropMap() override {
    accessor_.reset();
    map_.reset();
  }

  [[nodiscard]] MapFigures figures() const override {
    MapFigures figures;
    countCells([this](auto visit) { forEachKnown(visit); }, figures);
    figures.inner_nodes = map_->size();
    figures.bytes_own = map_->getMemoryUsage();
    figures.ray_walk_cpu_s = voxels_.rayWalkCpu_s();
    return figures;
  }

  [[nodiscard]] double visitOccupied() const override {
    return sumOccupied([this](auto visit) { forEachKnown(visit); });
  }

  [[nodiscard]] Occupancy classifyPoint(const Eigen::Vector3d& point_map) const override {
    const auto cell = grid_.toCell(point_map);
    if (!cell) return Occupancy::kUnknown;
    if (!accessor_) accessor_.emplace(*map_);
    return classifyWavelet(accessor_->getCellValue(toIndex(*cell)));
  }

  [[nodiscard]] bool isAnyOccupied(const CellBox& /*box*/) const override { return false; }
  [[nodiscard]] std::optional<double> castRay(const RayQuery& /*ray*/) const override {
    return std::nullopt;
  }

  [[nodiscard]] Agreement compareWith(const CuboidMap& map) const override {
    return agreementOf([this](auto visit) { forEachKnown(visit); }, map);
  }

 private:
  static wavemap::HashedChunkedWaveletOctreeConfig makeConfig(const MapConfig& config,
                                                              const SensorModel& sensor_model) {
    wavemap::HashedChunkedWaveletOctreeConfig wavelets;
    wavelets.min_cell_width = static_cast<float>(config.resolution_m);
    wavelets.min_log_odds = sensor_model.min();
    wavelets.max_log_odds = sensor_model.max();
    return wavelets;
  }

  void add(const Cell& cell, float observation) {
    map_->addToCellValue(toIndex(cell), observation);
  }

  /// Calls visit(const CellBox&, float log_odds) for the leaves, large or small.
  template <typename VisitorT>
  void forEachKnown(VisitorT visit) const {
    map_->forEachLeaf([&visit](const wavemap::OctreeIndex& index, float log_odds) {
      if (classifyWavelet(log_odds) == Occupancy::kUnknown) return;
      const wavemap::Index3D min = wavemap::convert::nodeIndexToMinCornerIndex(index);
      const std::int32_t edge = 1 << index.height;
      const Cell first{min.x(), min.y(), min.z()};
      visit(CellBox{first, first + Cell{edge, edge, edge}}, log_odds);
    });
  }

  Grid grid_;
  SensorModel sensor_model_;
  OurVoxels voxels_;
  std::unique_ptr<WaveletMap> map_;
  /// Made at the first query.
  mutable std::optional<wavemap::QueryAccelerator<WaveletMap>> accessor_;
};

}  // namespace

std::unique_ptr<PeerAdapter> makeWavemapAdapter(const InsertionConfig& config) {
  return std::make_unique<WavemapAdapter>(config);
}

}  // namespace cuboid_mapping::bench
