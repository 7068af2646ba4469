// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/box_faces.h"
#include "cuboid_mapping/query/obstacles.h"

#include <array>
#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// The voxels of a brick that are in the way, at least one.
struct BrickObstacles {
  Cell brick;
  BrickMask voxels;
  CellBox box;  ///< Box around the voxels.
};

/// The obstacles of bricks. Neighbouring bricks are looked up once.
class ObstacleCache {
 public:
  ObstacleCache(const CuboidMap& map, UnknownPolicy policy, Budget& budget)
      : obstacles_(map, policy, budget) {
    found_.reserve(64);
  }

  [[nodiscard]] Budget& budget() const { return obstacles_.budget(); }

  /// Forgets all bricks when they are many. Their numbers end with this, and a new generation begins.
  void trim() {
    if (found_.size() < kMaxFound) return;
    slots_.fill(Slot());
    found_.clear();
    ++generation_;
  }

  /// Generation of the numbers of obstacles.
  [[nodiscard]] std::uint64_t generation() const { return generation_; }

  /// The obstacles of a brick; null: none. Valid until the next call; arbitrary if the budget is spent.
  [[nodiscard]] const BrickObstacles* find(const Cell& brick) {
    Slot& slot = slots_[static_cast<std::size_t>((brick.x >> 3 & 7) | (brick.y >> 3 & 7) << 3 |
                                                 (brick.z >> 3 & 3) << 6)];
    if (slot.brick != brick) look(brick, slot);
    return slot.number == kNothing ? nullptr : &found_[slot.number];
  }

  /// Number of obstacles that find() has just found, and the obstacles with a number.
  ///@{
  [[nodiscard]] std::uint32_t numberOf(const BrickObstacles* found) const {
    return static_cast<std::uint32_t>(found - found_.data());
  }
  [[nodiscard]] const BrickObstacles& operator[](std::uint32_t number) const {
    return found_[number];
  }
  ///@}

 private:
  static constexpr std::size_t kNumSlots = 256;
  static constexpr std::size_t kMaxFound = 1024;
  static constexpr std::uint32_t kNothing = 0xFFFFFFFFU;

  struct Slot {
    Cell brick{1, 1, 1};              ///< No brick at first.
    std::uint32_t number = kNothing;  ///< Index in found_, or kNothing.
  };

  void look(const Cell& brick, Slot& slot) {
    if (!budget().spend()) return;
    const BrickMask voxels = obstacles_.inBrick(brick);
    if (!voxels.isEmpty()) found_.push_back({brick, voxels, boundsOf(brick, voxels)});
    slot = {brick, voxels.isEmpty() ? kNothing : static_cast<std::uint32_t>(found_.size() - 1)};
  }

  Obstacles obstacles_;
  std::array<Slot, kNumSlots> slots_;
  std::vector<BrickObstacles> found_;
  std::uint64_t generation_ = 0;
};

}  // namespace cuboid_mapping
