// SPDX-License-Identifier: BSD-3-Clause
// What both ways to fill a map of ohm have in common.
#pragma once

#include "peers/known_cells.h"

#include <ohm/MapChunk.h>
#include <ohm/OccupancyMap.h>
#include <ohm/RaysQuery.h>
#include <ohm/VoxelBuffer.h>
#include <ohm/VoxelOccupancy.h>

#include <memory>
#include <vector>

namespace cuboid_mapping::bench {

/// A map whose regions of 32 x 32 x 32 voxels begin at multiples of 32.
class OhmAdapter : public PeerAdapter {
 public:
  explicit OhmAdapter(const MapConfig& config)
      : map_(std::make_unique<ohm::OccupancyMap>(config.resolution_m, glm::u8vec3(kRegionEdge),
                                                 ohm::MapFlag::kNone)) {
    const SensorModel model(config.sensor_model);
    map_->setOrigin(glm::dvec3(0.5 * kRegionEdge * config.resolution_m));
    map_->setHitValue(model.hit());
    map_->setMissValue(model.miss());
    map_->setMinVoxelValue(model.min());
    map_->setMaxVoxelValue(model.max());
    map_->setSaturateAtMinValue(config.environment == Environment::kStatic);
    map_->setSaturateAtMaxValue(config.environment == Environment::kStatic);
  }

  void dropMap() override {
    query_.reset();
    map_.reset();
  }

  [[nodiscard]] MapFigures figures() const override {
    MapFigures figures;
    countCells([this](auto visit) { forEachKnown(visit); }, figures);
    figures.leaf_nodes = map_->regionCount();
    figures.bytes_own = map_->calculateApproximateMemory();
    return figures;
  }

  [[nodiscard]] double visitOccupied() const override {
    return sumOccupied([this](auto visit) { forEachKnown(visit); });
  }

  [[nodiscard]] Occupancy classifyPoint(const Eigen::Vector3d& point_map) const override {
    const ohm::Key key = map_->voxelKey(toVec3(point_map));
    const ohm::Voxel<const float> voxel(map_.get(), layer(), key);
    if (ohm::isUnobservedOrNull(voxel)) return Occupancy::kUnknown;
    return ohm::isOccupied(voxel) ? Occupancy::kOccupied : Occupancy::kFree;
  }

  [[nodiscard]] bool isAnyOccupied(const CellBox& box) const override {
    const Cell first = regionOf(box.min);
    const Cell last = regionOf(box.max - Cell{1, 1, 1});
    for (int z = first.z; z <= last.z; ++z) {
      for (int y = first.y; y <= last.y; ++y) {
        for (int x = first.x; x <= last.x; ++x) {
          if (isAnyOccupiedIn({x, y, z}, box)) return true;
        }
      }
    }
    return false;
  }

  [[nodiscard]] std::optional<double> castRay(const RayQuery& ray) const override {
    if (!query_) {
      query_ = std::make_unique<ohm::RaysQuery>();
      query_->setMap(map_.get());
    }
    query_->clearRays();
    query_->addRay(toVec3(ray.origin_map), toVec3(ray.origin_map + kRayRange_m * ray.direction));
    query_->execute();
    if (*query_->terminalOccupancyTypes() != ohm::kOccupied) return std::nullopt;
    return *query_->ranges();
  }

  [[nodiscard]] Agreement compareWith(const CuboidMap& map) const override {
    return agreementOf([this](auto visit) { forEachKnown(visit); }, map);
  }

 protected:
  static glm::dvec3 toVec3(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

  static ohm::Key toKey(const Cell& cell) {
    const auto local = [](int i) { return static_cast<std::uint8_t>(i & (kRegionEdge - 1)); };
    return {toRegionKey(regionOf(cell)), local(cell.x), local(cell.y), local(cell.z)};
  }

  ohm::OccupancyMap& map() { return *map_; }
  [[nodiscard]] int layer() const { return map_->layout().occupancyLayer(); }

 private:
  static constexpr int kRegionEdge = 32;  // ohm's default

  using Buffer = ohm::VoxelBuffer<const ohm::VoxelBlock>;

  static Cell regionOf(const Cell& cell) { return {cell.x >> 5, cell.y >> 5, cell.z >> 5}; }
  static glm::i16vec3 toRegionKey(const Cell& region) { return {region.x, region.y, region.z}; }
  static Cell firstCell(const glm::i16vec3& region) {
    return {region.x * kRegionEdge, region.y * kRegionEdge, region.z * kRegionEdge};
  }

  /// Calls visit(const Cell&, float log_odds) for the known voxels of a region in a box until one returns true.
  template <typename VisitorT>
  [[nodiscard]] bool anyKnown(const ohm::MapChunk& region, const CellBox& box,
                              VisitorT visit) const {
    const Cell first = firstCell(region.region.coord);
    const CellBox part =
        intersect(box, {first, first + Cell{kRegionEdge, kRegionEdge, kRegionEdge}});
    Buffer buffer(region.voxel_blocks[static_cast<std::size_t>(layer())]);
    for (Cell cell = part.min; cell.z < part.max.z; ++cell.z) {
      for (cell.y = part.min.y; cell.y < part.max.y; ++cell.y) {
        for (cell.x = part.min.x; cell.x < part.max.x; ++cell.x) {
          const Cell offset = cell - first;
          const int index = (offset.z * kRegionEdge + offset.y) * kRegionEdge + offset.x;
          float log_odds = 0.0F;
          buffer.readVoxel(static_cast<unsigned>(index), &log_odds);
          if (!ohm::isUnobserved(log_odds) && visit(cell, log_odds)) return true;
        }
      }
    }
    return false;
  }

  [[nodiscard]] bool isAnyOccupiedIn(const Cell& region, const CellBox& box) const {
    const ohm::MapChunk* chunk =
        static_cast<const ohm::OccupancyMap&>(*map_).region(toRegionKey(region));
    return chunk != nullptr && anyKnown(*chunk, box, [](const Cell& /*cell*/, float log_odds) {
             return classify(log_odds) == Occupancy::kOccupied;
           });
  }

  template <typename VisitorT>
  void forEachKnown(VisitorT visit) const {
    std::vector<const ohm::MapChunk*> regions;
    map_->enumerateRegions(regions);
    for (const ohm::MapChunk* region : regions) {
      const Cell first = firstCell(region->region.coord);
      const CellBox all{first, first + Cell{kRegionEdge, kRegionEdge, kRegionEdge}};
      (void)anyKnown(*region, all, [&visit](const Cell& cell, float log_odds) {
        visit(CellBox::ofCell(cell), log_odds);
        return false;
      });
    }
  }

  std::unique_ptr<ohm::OccupancyMap> map_;
  mutable std::unique_ptr<ohm::RaysQuery> query_;  ///< Made at the first ray.
};

}  // namespace cuboid_mapping::bench
