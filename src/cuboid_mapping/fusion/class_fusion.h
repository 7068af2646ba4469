// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/fusion.h"

#include <cstdint>
#include <map>
#include <vector>

namespace cuboid_mapping {

/// How ClassFusion divides the voxels of a brick.
enum class BrickDivision : unsigned char {
  kBoxes,   ///< Into large boxes of one class, see divideBrick().
  kVoxels,  ///< Not at all: every voxel is a cuboid.
};

/// Fusion by class inside bricks: the cuboids of a brick are a function of the classes of its voxels
/// alone, so they depend neither on the order of clouds and reads, nor on threads, nor on the tree.
///
/// A brick that a cloud has changed waits until fuse(), at most until no cloud has changed a class
/// in it for kColdClouds clouds.
class ClassFusion : public Fusion {
 public:
  static constexpr std::uint64_t kColdClouds = 20;

  /// @param threads  >= 1; the result does not depend on it.
  ClassFusion(BrickDivision division, const RTreeConfig& rtree, int threads)
      : Fusion(rtree), division_(division), threads_(threads) {}

  void announce(const std::vector<BrickChange>& changed, ChangeSet& changes) override;
  void noteCloud(const VoxelStore& voxels, const ScanUpdate& update,
                 const std::vector<BrickChange>& changed, ChangeSet& changes) noexcept override;
  void noteEdit(const VoxelStore& /*voxels*/, const std::vector<BrickChange>& /*changed*/,
                ChangeSet& /*changes*/) noexcept override {}
  void setSensorModel(const VoxelStore& /*voxels*/, const SensorModel& /*model*/,
                      ChangeSet& /*changes*/) noexcept override {}
  void fuse(const VoxelStore& voxels, std::size_t max_bricks) override;
  void divide(const VoxelBrick& brick, std::vector<Cuboid>& cuboids) const override;
  void clear() noexcept override;
  [[nodiscard]] std::size_t numBytes() const override;

 private:
  /// Waiting bricks of one group that are put into the tree together.
  struct Batch {
    const Cell* first;
    const Cell* last;
    TreeChange change;
  };

  struct Scratch;

  void fuseCold(const VoxelStore& voxels);
  void queueAll(const VoxelStore& voxels);
  std::vector<Cell> takeDue(std::size_t max_bricks);
  void write(const VoxelStore& voxels, std::vector<Cell> bricks);
  void compare(const VoxelStore& voxels, Batch& batch, Scratch& scratch) const;

  BrickDivision division_;
  int threads_;
  std::uint64_t num_clouds_ = 0;
  /// Each waiting brick once, by the cloud after which to look whether it is cold.
  std::map<std::uint64_t, std::vector<Cell>> due_;
};

}  // namespace cuboid_mapping
