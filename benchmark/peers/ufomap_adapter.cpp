// SPDX-License-Identifier: BSD-3-Clause
#include "map_adapter.h"

#include "peers/beams.h"
#include "peers/known_cells.h"

#include "cuboid_mapping/geometry/grid.h"

#include <ufo/map/occupancy_map.h>

#include <cmath>

namespace cuboid_mapping::bench {
namespace {

using ufo::map::Point3;

template <typename VectorT>
Point3 toPoint3(const VectorT& v) {
  return {v.x(), v.y(), v.z()};
}

/// Filled as ufomap_mapping does it.
class UfomapAdapter : public PeerAdapter {
 public:
  explicit UfomapAdapter(const InsertionConfig& config)
      : grid_(config.map.resolution_m),
        max_range_m_(std::isinf(config.max_range_m) ? -1.0 : config.max_range_m),
        map_(makeMap(config.map)) {}

  [[nodiscard]] std::string name() const override { return "ufomap"; }
  [[nodiscard]] bool takesAnchors() const override { return false; }
  /// castRay() of UFOMap 1.0 does not compile.
  [[nodiscard]] bool offers(QueryKind kind) const override { return kind != QueryKind::kRay; }

  void insert(const Scan& scan) override {
    ufo::map::PointCloud cloud;
    cloud.reserve(scan.points.size());
    for (const Eigen::Vector3f& point : finitePoints(scan)) cloud.push_back(toPoint3(point));
    map_->insertPointCloudDiscrete(toPoint3(scan.origin), cloud, max_range_m_);
  }

  void dropScratch() override {}
  void dropMap() override { map_.reset(); }

  [[nodiscard]] MapFigures figures() const override {
    MapFigures figures;
    countCells([this](auto visit) { forEachKnown(visit); }, figures);
    figures.leaf_nodes = figures.cells;
    figures.inner_nodes = map_->getNumInnerNodes();
    figures.bytes_own = map_->memoryUsage();
    return figures;
  }

  [[nodiscard]] double visitOccupied() const override {
    double sum = 0.0;
    const auto end = map_->endLeaves();
    for (auto leaf = map_->beginLeaves(true, false, false); leaf != end; ++leaf) sum += leaf.getX();
    return sum;
  }

  [[nodiscard]] Occupancy classifyPoint(const Eigen::Vector3d& point_map) const override {
    const auto state = map_->getState(toPoint3(point_map));
    if (state == ufo::map::unknown) return Occupancy::kUnknown;
    return state == ufo::map::occupied ? Occupancy::kOccupied : Occupancy::kFree;
  }

  [[nodiscard]] bool isAnyOccupied(const CellBox& box) const override {
    // Smaller by a quarter of a voxel: it also gives leaves that only touch a box.
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(0.25);
    const Eigen::Vector3d min(box.min.x, box.min.y, box.min.z);
    const Eigen::Vector3d max(box.max.x, box.max.y, box.max.z);
    const ufo::geometry::AABB aabb(toPoint3(grid_.toMetres(min + margin)),
                                   toPoint3(grid_.toMetres(max - margin)));
    return map_->beginLeaves(ufo::geometry::BoundingVar(aabb), true, false, false) !=
           map_->endLeaves();
  }

  [[nodiscard]] std::optional<double> castRay(const RayQuery& /*ray*/) const override {
    return std::nullopt;
  }

  [[nodiscard]] Agreement compareWith(const CuboidMap& map) const override {
    return agreementOf([this](auto visit) { forEachKnown(visit); }, map);
  }

 private:
  using Map = ufo::map::OccupancyMap;

  static std::unique_ptr<Map> makeMap(const MapConfig& config) {
    constexpr int kLevels = 16;
    const SensorModelConfig& model = config.sensor_model;
    return std::make_unique<Map>(config.resolution_m, kLevels, true, 0.5, 0.5, model.hit,
                                 model.miss, model.alpha_min, model.alpha_max);
  }

  /// Calls visit(const CellBox&, float log_odds) for the leaves, pruned or not.
  template <typename VisitorT>
  void forEachKnown(VisitorT visit) const {
    const auto end = map_->endLeaves();
    for (auto leaf = map_->beginLeaves(true, true, false); leaf != end; ++leaf) {
      const std::int32_t edge = 1 << leaf.getDepth();
      const auto to_min = [&](double center_m) {
        return static_cast<std::int32_t>(std::lround(center_m / grid_.resolution() - 0.5 * edge));
      };
      const Cell min{to_min(leaf.getX()), to_min(leaf.getY()), to_min(leaf.getZ())};
      visit(CellBox{min, min + Cell{edge, edge, edge}}, leaf->occupancy);
    }
  }

  Grid grid_;
  double max_range_m_;  ///< -1 for none.
  std::unique_ptr<Map> map_;
};

}  // namespace

std::unique_ptr<PeerAdapter> makeUfomapAdapter(const InsertionConfig& config) {
  return std::make_unique<UfomapAdapter>(config);
}

}  // namespace cuboid_mapping::bench
