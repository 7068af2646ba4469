// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/function_ref.h"
#include "cuboid_mapping/occupancy/cuboid_filter.h"
#include "cuboid_mapping/scan/brick_update.h"
#include "cuboid_mapping/voxels/packed_voxels.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace cuboid_mapping {

/// A brick with its voxels: in the map, in files, in octrees and in messages.
struct VoxelBrick {
  Cell brick;           ///< Its least cell.
  PackedVoxels voxels;  ///< Indexed by voxelIndex().
};

struct Brick;
template <typename ItemT>
class BrickTable;

/// All known voxels with their exact log-odds, by brick, and the cuboids of each brick. A brick without a known
/// voxel is not stored. Const functions may run side by side; a change needs exclusive access.
class VoxelStore {
 public:
  /// A store without voxels.
  VoxelStore();
  /// Takes over the voxels of another store, which may only be destroyed or assigned afterwards.
  ///@{
  VoxelStore(VoxelStore&& other) noexcept;
  VoxelStore& operator=(VoxelStore&& other) noexcept;
  ///@}
  ~VoxelStore();

  /// The voxels of a brick, without or with its least cell; null when none is known. Valid until the brick
  /// changes.
  /// @complexity O(1) on average.
  ///@{
  [[nodiscard]] const PackedVoxels* find(const Cell& brick) const {
    const VoxelBrick* found = findBrick(brick);
    return found == nullptr ? nullptr : &found->voxels;
  }
  [[nodiscard]] const VoxelBrick* findBrick(const Cell& brick) const;
  ///@}

  /// Class of a voxel. @complexity O(1) on average.
  [[nodiscard]] Occupancy at(const Cell& cell) const {
    const PackedVoxels* voxels = find(brickOf(cell));
    return voxels == nullptr ? Occupancy::kUnknown : voxels->at(voxelIndex(cell));
  }

  /// Log-odds of a voxel; nothing when it is unknown. @complexity O(1).
  [[nodiscard]] std::optional<float> logOddsAt(const Cell& cell) const {
    const PackedVoxels* voxels = find(brickOf(cell));
    return voxels == nullptr ? std::nullopt : voxels->logOddsAt(voxelIndex(cell));
  }

  /// Calls visit for each brick with a known voxel, in no particular order.
  void forEach(FunctionRef<void(const VoxelBrick&)> visit) const;
  /// Like forEach(), for the bricks that share a cell with a box.
  /// @complexity O(bricks of the box, or all known bricks if these are fewer).
  void forEachIn(const CellBox& box, FunctionRef<void(const VoxelBrick&)> visit) const;
  /// Like forEachIn(), until visit returns kStop. @return The last answer; kContinue without one.
  Visit visitIn(const CellBox& box, FunctionRef<Visit(const VoxelBrick&)> visit) const;

  /// Copies of these bricks, along the Morton curve. @complexity As forEachIn(), and O(n log n) for n bricks.
  [[nodiscard]] std::vector<VoxelBrick> copyIn(const CellBox& box) const;

  /// Maximum number of bricks that forEachIn() visits. 0 for an empty box.
  [[nodiscard]] std::uint64_t maxBricksIn(const CellBox& box) const;

  /// Number of bricks with a known voxel.
  [[nodiscard]] std::size_t size() const;
  /// Numbers of voxels of each class; exact up to 2^53.
  ///@{
  [[nodiscard]] double numFreeVoxels() const { return num_free_; }
  [[nodiscard]] double numOccupiedVoxels() const { return num_occupied_; }
  ///@}
  /// Bytes held from the allocator, with the cuboids. @complexity O(n) for n bricks.
  [[nodiscard]] std::size_t numBytes() const;
  /// The bricks by number, with their cuboids.
  [[nodiscard]] const BrickTable<Brick>& bricks() const { return *bricks_; }

  /// The new state of one brick: internal.
  struct PendingBrick;

  /// A change that is computed, and not made yet. Once made, it holds the replaced bricks; its
  /// destructor frees their memory.
  class PendingChange {
   public:
    /// An empty change.
    PendingChange();
    /// A change can be made once.
    ///@{
    PendingChange(PendingChange&& other) noexcept;
    PendingChange& operator=(PendingChange&& other) noexcept;
    ///@}
    ~PendingChange();

    /// All examined bricks, changed or not: internal.
    std::vector<PendingBrick> bricks;
    std::vector<std::uint32_t> changed;  ///< Indices in `bricks` of those that change.
    std::size_t num_new = 0;             ///< Bricks that the store does not have yet.
    std::size_t num_gone = 0;            ///< Bricks that it will not have any more.
  };

  /// Settings for the computation of a change. The result does not depend on them.
  struct Work {
    int threads = 1;  ///< Number of threads, >= 1.
    /// Divides bricks with other classes into cuboids; else their cuboids are stale.
    bool divides = false;
  };

  /// Computes the result of observing voxels, see PackedVoxels::observe(). Changes nothing: const functions may
  /// run beside it. @param update  Each brick once. @throws std::bad_alloc
  [[nodiscard]] PendingChange prepare(const std::vector<BrickUpdate>& update,
                                      const SensorModel& model, const Work& work) const;
  /// Computes the result of replacing everything inside a box.
  /// @param bricks  New content of the box. If a brick comes twice, the later one counts. Voxels outside the
  ///                box are ignored. @throws std::bad_alloc
  /// @complexity O(m + n log n) for m bricks of the box, or all known bricks if these are fewer, and n old and
  /// new bricks in it.
  [[nodiscard]] PendingChange prepareReplace(const CellBox& box, std::vector<VoxelBrick> bricks,
                                             const Work& work) const;
  /// As above, for whole bricks anywhere: others stay. @complexity O(n log n), or O(n) along the Morton curve.
  [[nodiscard]] PendingChange prepareReplace(std::vector<VoxelBrick> bricks,
                                             const Work& work) const;
  /// Reserves memory for a change. @throws std::bad_alloc  Nothing has changed then.
  void reserve(const PendingChange& change);
  /// Makes a change. @pre It was computed for the current content of this store, and reserve() was called.
  /// @param follow  Called for each brick that changes, after it; must not throw.
  void commit(PendingChange& change, FunctionRef<void(const PendingBrick&)> follow) noexcept;

  /// prepare(), reserve() and commit() in one. @throws std::bad_alloc  Nothing has changed then.
  void apply(const std::vector<BrickUpdate>& update, const SensorModel& model, const Work& work);

 private:
  struct Source;
  [[nodiscard]] PendingChange prepareReplace(std::vector<Source> sources, const CellBox& box,
                                             const Work& work) const;
  template <typename BrickOfT, typename WorkT>
  PendingChange prepare(std::size_t count, const Work& work, BrickOfT brick_of,
                        WorkT change_of) const;
  void commit(PendingBrick& brick) noexcept;

  std::unique_ptr<BrickTable<Brick>> bricks_;
  double num_free_ = 0.0;
  double num_occupied_ = 0.0;
};

}  // namespace cuboid_mapping
