// SPDX-License-Identifier: BSD-3-Clause
// Why an R-tree: other ways to find the cuboids of a map.
#pragma once

#include "cuboid_mapping/geometry/function_ref.h"
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/occupancy/cuboid_filter.h"
#include "cuboid_mapping/voxels/brick_store.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping::bench {

/// Finds the cuboids of a map. They are the same for all indexes, and are divided already.
class CuboidIndex {
 public:
  virtual ~CuboidIndex() = default;
  [[nodiscard]] virtual std::string name() const = 0;
  /// Bytes of the index; of a list with the cuboids, which the others leave in their bricks.
  [[nodiscard]] virtual std::size_t numBytes() const = 0;

  /// Visits the cuboids that share a cell with a window, in no particular order. @pre It is not empty.
  virtual void visitBox(const CellBox& window, CuboidFilter filter,
                        FunctionRef<Visit(const Cuboid&)> visit) const = 0;
  /// The cuboid that holds a cell.
  [[nodiscard]] virtual std::optional<Cuboid> find(const Cell& cell) const;
  /// Distances of the nearest cuboids from a point, ascending; both in cells. Fewer than `count` if
  /// there are no more.
  [[nodiscard]] virtual std::vector<double> nearest(const Eigen::Vector3d& point, std::size_t count,
                                                    CuboidFilter filter) const = 0;
};

/// The R-tree of the map; its leaf nodes are the bricks.
class TreeIndex : public CuboidIndex {
 public:
  /// @param map  Must outlive this object, and stay as it is.
  explicit TreeIndex(const CuboidMap& map) : map_(map) {}
  [[nodiscard]] std::string name() const override { return "rtree"; }
  [[nodiscard]] std::size_t numBytes() const override;
  void visitBox(const CellBox& window, CuboidFilter filter,
                FunctionRef<Visit(const Cuboid&)> visit) const override;
  [[nodiscard]] std::vector<double> nearest(const Eigen::Vector3d& point, std::size_t count,
                                            CuboidFilter filter) const override;

 private:
  const CuboidMap& map_;
};

/// A hash of the same bricks. Windows of more bricks than there are go through all of them; the
/// nearest are looked for in shells of bricks round the point.
class BrickHash : public CuboidIndex {
 public:
  /// @param map  As for TreeIndex.
  explicit BrickHash(const CuboidMap& map);
  [[nodiscard]] std::string name() const override { return "brick_hash"; }
  [[nodiscard]] std::size_t numBytes() const override { return table_.numBytes(); }
  void visitBox(const CellBox& window, CuboidFilter filter,
                FunctionRef<Visit(const Cuboid&)> visit) const override;
  [[nodiscard]] std::vector<double> nearest(const Eigen::Vector3d& point, std::size_t count,
                                            CuboidFilter filter) const override;

 private:
  struct Entry {
    Cell brick;
    bool has_occupied = false;
    const BrickCuboids* cuboids = nullptr;
  };

  template <typename VisitT>
  static Visit visitEntry(const Entry& entry, CuboidFilter filter, VisitT visit);
  template <typename VisitT>
  void visitEntries(VisitT visit) const;

  BrickTable<Entry> table_;  ///< Its items are numbered without gaps.
  std::optional<CellBox> bounds_;
};

/// All cuboids in one list, occupied ones first. Every search looks at all of a class.
class FlatList : public CuboidIndex {
 public:
  /// @param map  Is copied.
  explicit FlatList(const CuboidMap& map);
  [[nodiscard]] std::string name() const override { return "list"; }
  [[nodiscard]] std::size_t numBytes() const override {
    return cuboids_.capacity() * sizeof(Cuboid);
  }
  void visitBox(const CellBox& window, CuboidFilter filter,
                FunctionRef<Visit(const Cuboid&)> visit) const override;
  [[nodiscard]] std::vector<double> nearest(const Eigen::Vector3d& point, std::size_t count,
                                            CuboidFilter filter) const override;

 private:
  template <typename VisitT>
  void visitClass(CuboidFilter filter, VisitT visit) const;

  std::vector<Cuboid> cuboids_;
  std::size_t num_occupied_ = 0;
};

/// The three, of the same map.
[[nodiscard]] std::vector<std::unique_ptr<CuboidIndex>> makeIndexes(const CuboidMap& map);

}  // namespace cuboid_mapping::bench
