// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/brick_update.h"
#include "cuboid_mapping/voxels/brick_table.h"
#include "cuboid_mapping/voxels/packed_voxels.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace cuboid_mapping {

/// A brick with its voxels: in the map, in files, in octrees and in messages.
struct VoxelBrick {
  Cell brick;           ///< Its least cell.
  PackedVoxels voxels;  ///< By voxelIndex().
};

/// What has changed in one brick.
struct BrickChange {
  Cell brick;                    ///< Its least cell.
  BrickMask changed;             ///< Voxels that are new, gone, or have another log-odds.
  bool is_reclassified = false;  ///< Some have another class.
};

/// All known voxels with their exact log-odds, by brick. A brick without a known voxel leaves no
/// trace. Const functions may run side by side; a change needs exclusive access.
class VoxelStore {
 public:
  /// The voxels of a brick, without or with its name; null when none is known. Valid until the
  /// brick changes. @complexity O(1).
  ///@{
  [[nodiscard]] const PackedVoxels* find(const Cell& brick) const {
    const VoxelBrick* found = findBrick(brick);
    return found == nullptr ? nullptr : &found->voxels;
  }
  [[nodiscard]] const VoxelBrick* findBrick(const Cell& brick) const { return bricks_.find(brick); }
  ///@}

  /// Class of a voxel. @complexity O(1).
  [[nodiscard]] Occupancy at(const Cell& cell) const {
    const PackedVoxels* voxels = find(brickOf(cell));
    return voxels == nullptr ? Occupancy::kUnknown : voxels->occupancyAt(voxelIndex(cell));
  }

  /// Log-odds of a voxel; nothing when it is unknown. @complexity O(1).
  [[nodiscard]] std::optional<float> logOddsAt(const Cell& cell) const {
    const PackedVoxels* voxels = find(brickOf(cell));
    return voxels == nullptr ? std::nullopt : voxels->at(voxelIndex(cell));
  }

  /// Whether any voxel of a box is occupied; false for an empty one.
  /// @complexity O(bricks that the box shares a cell with, or all known bricks if these are fewer).
  [[nodiscard]] bool isAnyOccupied(const CellBox& box) const;

  /// Calls visit(const VoxelBrick&) for each brick with a known voxel, in no particular order.
  template <typename VisitorT>
  void forEach(VisitorT visit) const {
    bricks_.forEach(visit);
  }
  /// As forEach() for the bricks that share a cell with a box.
  /// @complexity O(bricks of the box, or all known bricks if these are fewer).
  template <typename VisitorT>
  void forEachIn(const CellBox& box, VisitorT visit) const {
    bricks_.forEachIn(box, visit);
  }

  /// Bricks that forEachIn() looks at, at most.
  [[nodiscard]] std::uint64_t countLooks(const CellBox& box) const {
    return static_cast<std::uint64_t>(std::min(numBricks(box), static_cast<double>(size())));
  }

  /// Bricks with a known voxel.
  [[nodiscard]] std::size_t size() const { return bricks_.size(); }
  /// Voxels of a class; exact up to 2^53.
  ///@{
  [[nodiscard]] double numFreeVoxels() const { return num_free_; }
  [[nodiscard]] double numOccupiedVoxels() const { return num_occupied_; }
  ///@}
  /// Box around all known bricks; nothing when there is none.
  [[nodiscard]] const std::optional<CellBox>& bounds() const { return bounds_; }
  /// Bytes held from the allocator.
  [[nodiscard]] std::size_t numBytes() const;

  /// A change that is worked out, and not made yet. Holds what it replaced once it is made, so that
  /// the memory is given back when it goes.
  class PendingChange;

  /// Told what is about to change, while everything is as it was.
  using Announce = std::function<void(const std::vector<BrickChange>&)>;

  /// Observes voxels, see PackedVoxels::observe(). @param threads  The result does not depend on it.
  /// @return What has changed, brick by brick in the order of the update.
  /// @throws std::bad_alloc, and what `announce` throws: nothing has changed then.
  std::vector<BrickChange> apply(const std::vector<BrickUpdate>& update, const SensorModel& model,
                                 int threads, const Announce& announce = {});

  /// The two halves of apply(), for those who let others read as long as possible.
  /// @pre Nothing changes the store between them.
  ///@{
  /// Changes nothing: const functions may run beside it. @throws std::bad_alloc
  [[nodiscard]] PendingChange prepare(const std::vector<BrickUpdate>& update,
                                      const SensorModel& model, int threads);
  /// @return What has changed, as apply(); belongs to `change`.
  /// @throws std::bad_alloc, and what `announce` throws: nothing has changed then.
  const std::vector<BrickChange>& commit(PendingChange& change, const Announce& announce = {});
  ///@}

  /// Puts voxels in the place of everything inside a box. @param bricks  Each once; voxels outside
  /// the box are not looked at. @return What has changed, along the Morton curve.
  /// @throws As apply().
  /// @complexity O(bricks that the box shares a cell with, or all known bricks if these are fewer,
  /// and `bricks`).
  std::vector<BrickChange> replace(const CellBox& box, const std::vector<VoxelBrick>& bricks,
                                   const Announce& announce = {});

  /// Forgets all voxels, and gives the memory back.
  void clear() { *this = VoxelStore(); }

 private:
  /// What becomes of a brick.
  struct NewBrick {
    VoxelBrick* place = nullptr;  ///< Null: it is new.
    PackedVoxels voxels;
    BrickMask changed;
    bool is_reclassified = false;
    int free = 0;  ///< Voxels that become free, less those that do not stay so.
    int occupied = 0;
  };

  template <typename BrickOfT, typename WorkT>
  PendingChange prepare(std::size_t count, int threads, BrickOfT brick_of, WorkT work);
  void commit(const Cell& cell, NewBrick& brick) noexcept;
  void computeBounds();

  BrickTable<VoxelBrick> bricks_;
  double num_free_ = 0.0;
  double num_occupied_ = 0.0;
  std::optional<CellBox> bounds_;
  bool is_shrinking_ = false;  ///< A brick that has gone touched the bounds.
};
/// See VoxelStore::prepare().
class VoxelStore::PendingChange {
  friend class VoxelStore;
  std::vector<NewBrick> bricks_;
  std::vector<BrickChange> changes_;  ///< Of those bricks that change, in their order.
  std::size_t num_new_ = 0;           ///< Bricks that the store does not have yet.
};

}  // namespace cuboid_mapping
