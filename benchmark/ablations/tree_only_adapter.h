// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "map_adapter.h"

namespace cuboid_mapping::bench {

/// A map that answers from the cuboids of its R-tree alone, without the masks of its voxels.
class TreeOnlyAdapter : public MapAdapter {
 public:
  /// @pre `map` stays as it is.
  explicit TreeOnlyAdapter(const CuboidMap& map) : map_(map) {}

  [[nodiscard]] std::string name() const override { return "tree_only"; }
  void insert(const Scan& /*scan*/) override {}
  void dropScratch() override {}
  void dropMap() override {}
  [[nodiscard]] MapFigures figures() const override { return {}; }
  [[nodiscard]] double visitOccupied() const override;
  [[nodiscard]] Occupancy classifyPoint(const Eigen::Vector3d& point_map) const override;
  [[nodiscard]] bool isAnyOccupied(const CellBox& box) const override;
  [[nodiscard]] std::optional<double> castRay(const RayQuery& ray) const override;

 private:
  const CuboidMap& map_;
};

}  // namespace cuboid_mapping::bench
