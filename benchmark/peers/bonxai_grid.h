// SPDX-License-Identifier: BSD-3-Clause
// What maps in a grid of Bonxai have in common.
#pragma once

#include "map_adapter.h"
#include "peers/agreement_counter.h"

#include "cuboid_mapping/geometry/brick.h"

#include <bonxai/bonxai.hpp>

#include <optional>

namespace cuboid_mapping::bench {

/// A map whose known voxels are the active ones of a grid with leaves of 8 x 8 x 8.
/// @tparam ToLogOdds  Log-odds of a voxel.
template <typename DataT, float (*ToLogOdds)(const DataT&)>
class BonxaiAdapter : public PeerAdapter {
 public:
  /// Bonxai has no search along a ray.
  [[nodiscard]] bool offers(QueryKind kind) const override { return kind != QueryKind::kRay; }

  [[nodiscard]] MapFigures figures() const override {
    MapFigures figures;
    grid().forEachCell([&figures](const DataT& voxel, const Bonxai::CoordT&) {
      ++(isOccupied(voxel) ? figures.occupied_cells : figures.free_cells);
    });
    figures.cells = figures.occupied_cells + figures.free_cells;
    for (const auto& [key, inner] : grid().rootMap()) {
      ++figures.inner_nodes;
      figures.leaf_nodes += inner.mask().countOn();
    }
    figures.bytes_own = grid().memUsage();
    return figures;
  }

  [[nodiscard]] double visitOccupied() const override {
    double sum = 0.0;
    grid().forEachCell([&sum](const DataT& voxel, const Bonxai::CoordT& coord) {
      if (isOccupied(voxel)) sum += coord.x;
    });
    return sum;
  }

  [[nodiscard]] Occupancy classifyPoint(const Eigen::Vector3d& point_map) const override {
    const auto coord = grid().posToCoord(point_map.x(), point_map.y(), point_map.z());
    const DataT* voxel = accessor().value(coord);
    return voxel != nullptr ? classify(ToLogOdds(*voxel)) : Occupancy::kUnknown;
  }

  [[nodiscard]] bool isAnyOccupied(const CellBox& box) const override {
    const Cell first = brickOf(box.min);
    for (int z = first.z; z < box.max.z; z += kBrickEdge) {
      for (int y = first.y; y < box.max.y; y += kBrickEdge) {
        for (int x = first.x; x < box.max.x; x += kBrickEdge) {
          const auto* leaf = accessor().getLeafGrid({x, y, z});
          if (leaf != nullptr && isAnyOccupied(*leaf, {x, y, z}, box)) return true;
        }
      }
    }
    return false;
  }

  [[nodiscard]] std::optional<double> castRay(const RayQuery& /*ray*/) const override {
    return std::nullopt;
  }

  [[nodiscard]] Agreement compareWith(const CuboidMap& map) const override {
    AgreementCounter counter(map);
    grid().forEachCell([&counter](const DataT& voxel, const Bonxai::CoordT& coord) {
      counter.add(CellBox::ofCell({coord.x, coord.y, coord.z}), ToLogOdds(voxel));
    });
    return counter.result();
  }

 protected:
  using Grid = Bonxai::VoxelGrid<DataT>;

  [[nodiscard]] virtual const Grid& grid() const = 0;

 private:
  static_assert(kBrickEdge == 8, "a leaf is a brick");

  [[nodiscard]] static bool isOccupied(const DataT& voxel) {
    return classify(ToLogOdds(voxel)) == Occupancy::kOccupied;
  }

  /// @param brick  Of the leaf.
  [[nodiscard]] static bool isAnyOccupied(const typename Grid::LeafGrid& leaf, const Cell& brick,
                                          const CellBox& box) {
    const bool is_whole = box.contains(brickBox(brick));
    for (auto index = leaf.mask().beginOn(); index; ++index) {
      if (!isOccupied(leaf.cell(*index))) continue;
      const auto at = static_cast<int>(*index);
      const Cell offset{at % kBrickEdge, at / kBrickEdge % kBrickEdge,
                        at / (kBrickEdge * kBrickEdge)};
      if (is_whole || box.contains(brick + offset)) return true;
    }
    return false;
  }

  /// Made at the first query: it remembers leaves that are missing, too.
  [[nodiscard]] const typename Grid::ConstAccessor& accessor() const {
    if (!accessor_) accessor_.emplace(grid());
    return *accessor_;
  }

  mutable std::optional<typename Grid::ConstAccessor> accessor_;
};

}  // namespace cuboid_mapping::bench
