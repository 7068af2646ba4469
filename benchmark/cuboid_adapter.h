// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "map_adapter.h"

#include "cuboid_mapping/map/mapper.h"

namespace cuboid_mapping::bench {

/// How the engine of cuboid_mapping runs: nothing that changes the voxels.
struct EngineOptions {
  bool fuses_every_cloud = false;  ///< Else bricks wait as long as they may.
};

/// The map of this package.
class CuboidAdapter : public MapAdapter {
 public:
  CuboidAdapter(const InsertionConfig& config, const EngineOptions& engine);

  [[nodiscard]] const CuboidMap& map() const { return *map_; }
  /// Walks the rays of these scans, which insert() has done already, once more on their own.
  void measureWalk(const std::vector<Scan>& scans, MapFigures& figures) const;

  [[nodiscard]] std::string name() const override { return "cuboid_mapping"; }
  void insert(const Scan& scan) override;
  void finish() override;
  void dropScratch() override;
  void dropMap() override { kept_map_.reset(); }
  [[nodiscard]] MapFigures figures() const override;
  [[nodiscard]] double visitOccupied() const override;
  [[nodiscard]] Occupancy classifyPoint(const Eigen::Vector3d& point_map) const override;
  [[nodiscard]] bool isAnyOccupied(const CellBox& box) const override;
  [[nodiscard]] std::optional<double> castRay(const RayQuery& ray) const override;

 private:
  MapperConfig config_;
  std::unique_ptr<Mapper> mapper_;
  CuboidMap* map_ = nullptr;             ///< All scans are in it, after finish().
  std::unique_ptr<CuboidMap> kept_map_;  ///< After dropScratch().
};

}  // namespace cuboid_mapping::bench
