// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/voxels/brick_table.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <unordered_map>
#include <vector>

namespace cuboid_mapping {

/// Cells that were split out of a fused cuboid, and must keep their value for some clouds before they may fuse
/// again: hysteresis, so that a flickering voxel does not split and rebuild a large cuboid at every cloud. Not
/// thread-safe.
class SettlingCells {
 public:
  /// @param clouds  Clouds for which a value must last, >= 0; with 0 no cell is held.
  explicit SettlingCells(int clouds) : clouds_(static_cast<std::uint64_t>(clouds)) {}

  /// Holds cells of a brick from this cloud on.
  void hold(const Cell& brick, const BrickMask& cells, std::uint64_t cloud);
  /// Notes that cells of a brick have changed their value, which restarts the time of held cells.
  void noteChanges(const Cell& brick, const BrickMask& cells, std::uint64_t cloud);
  /// Releases the cells that have kept their value long enough. @return These, in the order in
  /// which they were held. @complexity O(cells that are due).
  [[nodiscard]] std::vector<Cell> release(std::uint64_t cloud);
  /// The cells of a brick that are held.
  [[nodiscard]] BrickMask heldIn(const Cell& brick) const;
  /// Releases all cells.
  void clear();

  /// Number of held cells, in all bricks.
  [[nodiscard]] std::size_t size() const { return last_change_.size(); }

 private:
  struct HeldBrick {
    Cell brick;
    BrickMask cells;
  };

  std::uint64_t clouds_;
  std::map<std::uint64_t, std::vector<Cell>> due_;  ///< Held cells by the cloud of the next check.
  BrickTable<HeldBrick> held_;
  std::unordered_map<Cell, std::uint64_t, CellHash> last_change_;  ///< Cloud, of held cells.
};

}  // namespace cuboid_mapping
