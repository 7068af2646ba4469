// SPDX-License-Identifier: BSD-3-Clause
#include "peers/beams.h"
#include "peers/bonxai_grid.h"
#include "timing.h"

namespace cuboid_mapping::bench {
namespace {

Bonxai::CoordT toCoord(const Cell& cell) { return {cell.x, cell.y, cell.z}; }

float readLogOdds(const float& log_odds) { return log_odds; }

/// As OpenvdbAdapter: a grid takes the voxels of a cloud, then each is updated once.
class BonxaiGridAdapter : public BonxaiAdapter<float, readLogOdds> {
 public:
  explicit BonxaiGridAdapter(const InsertionConfig& config)
      : cells_(config.map.resolution_m),
        max_range_m_(config.max_range_m),
        sensor_model_(config.map.sensor_model, config.map.environment),
        update_(std::make_unique<UpdateGrid>(config.map.resolution_m)),
        map_(std::make_unique<Grid>(config.map.resolution_m)) {}

  [[nodiscard]] std::string name() const override { return "bonxai"; }

  void insert(const Scan& scan) override {
    ray_walk_cpu_s_ += timeOf([&] { computeUpdate(scan); }).cpu_s;
    auto accessor = map_->createAccessor();
    update_->forEachCell([&](const char& is_hit, const Bonxai::CoordT& coord) {
      float& log_odds = *accessor.value(coord, true);  // 0 where unknown
      log_odds =
          sensor_model_.update(log_odds, is_hit ? sensor_model_.hit() : sensor_model_.miss());
    });
  }

  void dropScratch() override { update_.reset(); }
  void dropMap() override { map_.reset(); }

  [[nodiscard]] MapFigures figures() const override {
    MapFigures figures = BonxaiAdapter::figures();
    figures.ray_walk_cpu_s = ray_walk_cpu_s_;
    return figures;
  }

 protected:
  [[nodiscard]] const Grid& grid() const override { return *map_; }

 private:
  /// An active voxel is observed, with 1 for a hit.
  using UpdateGrid = Bonxai::VoxelGrid<char>;

  void computeUpdate(const Scan& scan) {
    update_->clear(Bonxai::CLEAR_MEMORY);
    auto accessor = update_->createAccessor();
    forEachBeam(cells_, max_range_m_, scan, [&accessor](const Ray& ray, bool is_hit) {
      forEachMiss(ray, [&accessor](const Cell& cell) { accessor.setCellOn(toCoord(cell), 0); });
      if (is_hit) {
        accessor.setValue(toCoord(ray.end), 1);
      } else {
        accessor.setCellOn(toCoord(ray.end), 0);
      }
    });
  }

  cuboid_mapping::Grid cells_;
  double max_range_m_;
  SensorModel sensor_model_;
  std::unique_ptr<UpdateGrid> update_;
  std::unique_ptr<Grid> map_;
  double ray_walk_cpu_s_ = 0.0;
};

}  // namespace

std::unique_ptr<PeerAdapter> makeBonxaiAdapter(const InsertionConfig& config) {
  return std::make_unique<BonxaiGridAdapter>(config);
}

}  // namespace cuboid_mapping::bench
