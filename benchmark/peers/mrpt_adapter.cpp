// SPDX-License-Identifier: BSD-3-Clause
#include "map_adapter.h"

#include "peers/known_cells.h"
#include "peers/our_voxels.h"

#include <mrpt/maps/COccupancyGridMap3D.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace cuboid_mapping::bench {
namespace {

using GridMap = mrpt::maps::COccupancyGridMap3D;
using Value = GridMap::voxelType;

/// Log-odds are integers of 1/16 there, and positive for free.
constexpr float kValuesPerLogOdds = 16.0F;

Value toValue(float log_odds) {
  return static_cast<Value>(std::lround(-kValuesPerLogOdds * log_odds));
}
float logOddsOf(Value value) { return -static_cast<float>(value) / kValuesPerLogOdds; }

/// Filled voxel by voxel with our update of each cloud, and clamped as our map; grows with the clouds.
class MrptAdapter : public PeerAdapter {
 public:
  explicit MrptAdapter(const InsertionConfig& config)
      : grid_(config.map.resolution_m),
        sensor_model_(config.map.sensor_model),
        voxels_(grid_, config.max_range_m) {}

  [[nodiscard]] std::string name() const override { return "mrpt"; }
  /// It has no search along a ray.
  [[nodiscard]] bool offers(QueryKind kind) const override { return kind != QueryKind::kRay; }

  void insert(const Scan& scan) override {
    const ScanUpdate& update = voxels_.compute(scan);
    if (update.bricks.empty()) return;
    growTo(update.bricks);
    OurVoxels::forEach(
        update, [this](const Cell& cell) { add(cell, toValue(sensor_model_.miss())); },
        [this](const Cell& cell) { add(cell, toValue(sensor_model_.hit())); });
  }

  void dropScratch() override { voxels_.drop(); }
  void dropMap() override { map_.reset(); }

  [[nodiscard]] MapFigures figures() const override {
    MapFigures figures;
    countCells([this](auto visit) { forEachKnown(visit); }, figures);
    figures.cells = map_->m_grid.getVoxelCount();
    figures.bytes_own = figures.cells * sizeof(Value);
    figures.ray_walk_cpu_s = voxels_.rayWalkCpu_s();
    return figures;
  }

  [[nodiscard]] double visitOccupied() const override {
    return sumOccupied([this](auto visit) { forEachKnown(visit); });
  }

  [[nodiscard]] Occupancy classifyPoint(const Eigen::Vector3d& point_map) const override {
    const auto cell = grid_.toCell(point_map);
    if (!cell || !cells_.contains(*cell)) return Occupancy::kUnknown;
    return classifyValue(*valueOf(*cell));
  }

  [[nodiscard]] bool isAnyOccupied(const CellBox& box) const override {
    return anyVoxel(intersect(box, cells_), [](const Cell& /*cell*/, Value value) {
      return classifyValue(value) == Occupancy::kOccupied;
    });
  }

  [[nodiscard]] std::optional<double> castRay(const RayQuery& /*ray*/) const override {
    return std::nullopt;
  }

  [[nodiscard]] Agreement compareWith(const CuboidMap& map) const override {
    return agreementOf([this](auto visit) { forEachKnown(visit); }, map);
  }

 private:
  /// 0 is unknown, as its drawings have it.
  static Occupancy classifyValue(Value value) {
    return value == 0 ? Occupancy::kUnknown : classify(logOddsOf(value));
  }

  [[nodiscard]] Value* valueOf(const Cell& cell) const {
    const Cell index = cell - cells_.min;
    return map_->m_grid.cellByIndex(static_cast<unsigned>(index.x), static_cast<unsigned>(index.y),
                                    static_cast<unsigned>(index.z));
  }

  void add(const Cell& cell, Value observation) {
    Value& value = *valueOf(cell);
    value = static_cast<Value>(std::clamp<int>(value + observation, toValue(sensor_model_.max()),
                                               toValue(sensor_model_.min())));
  }

  /// Makes the grid hold some bricks, with a margin when it grows.
  void growTo(const std::vector<BrickUpdate>& bricks) {
    CellBox needed = brickBox(bricks.front().brick);
    for (const BrickUpdate& brick : bricks) needed = unite(needed, brickBox(brick.brick));
    if (map_ && cells_.contains(needed)) return;
    constexpr double kMargin_m = 2.0;  // mrpt's default
    const auto margin = static_cast<std::int32_t>(std::ceil(kMargin_m / grid_.resolution()));
    needed = {needed.min - Cell{margin, margin, margin}, needed.max + Cell{margin, margin, margin}};
    if (map_) needed = unite(needed, cells_);
    const MetricBox box = grid_.toMetricBox(needed);
    const mrpt::math::TPoint3D min(box.min_m.x(), box.min_m.y(), box.min_m.z());
    const mrpt::math::TPoint3D max(box.max_m.x(), box.max_m.y(), box.max_m.z());
    if (map_) {
      map_->resizeGrid(min, max);
    } else {
      map_ = std::make_unique<GridMap>(min, max, static_cast<float>(grid_.resolution()));
    }
    cells_ = needed;
  }

  /// Calls visit(const Cell&, Value) for the voxels of a box inside the grid until one returns true.
  template <typename VisitorT>
  [[nodiscard]] bool anyVoxel(const CellBox& box, VisitorT visit) const {
    for (Cell cell = box.min; cell.z < box.max.z; ++cell.z) {
      for (cell.y = box.min.y; cell.y < box.max.y; ++cell.y) {
        cell.x = box.min.x;
        if (cell.x >= box.max.x) continue;
        for (const Value* value = valueOf(cell); cell.x < box.max.x; ++cell.x, ++value) {
          if (visit(cell, *value)) return true;
        }
      }
    }
    return false;
  }

  template <typename VisitorT>
  void forEachKnown(VisitorT visit) const {
    (void)anyVoxel(cells_, [&visit](const Cell& cell, Value value) {
      if (value != 0) visit(CellBox::ofCell(cell), logOddsOf(value));
      return false;
    });
  }

  Grid grid_;
  SensorModel sensor_model_;
  OurVoxels voxels_;
  std::unique_ptr<GridMap> map_;
  CellBox cells_;  ///< Of the grid.
};

}  // namespace

std::unique_ptr<PeerAdapter> makeMrptAdapter(const InsertionConfig& config) {
  return std::make_unique<MrptAdapter>(config);
}

}  // namespace cuboid_mapping::bench
