// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/brick_mask.h"
#include "cuboid_mapping/occupancy/sensor_model.h"

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <utility>

namespace cuboid_mapping {

/// Which voxels of a brick a change has touched.
struct VoxelChange {
  BrickMask changed;       ///< New, gone, or another log-odds.
  BrickMask reclassified;  ///< Those of them that have another class.
};

/// Log-odds by voxelIndex(); says nothing of unknown voxels.
using VoxelValues = std::array<float, kBrickVoxels>;

/// The voxels of one brick with their exact log-odds.
///
/// One block of memory holds the mask of the known voxels, the mask of the occupied ones, and the
/// log-odds that occur, each once: first those of free voxels, then those of occupied ones. Which of
/// them a voxel has is a number, bit by bit in as many masks (bit planes) as the longer of the two
/// lists needs. A mask that follows from the rest is left out. So a brick of one log-odds takes
/// 8 bytes, and others 0.6 to 6 bits a voxel.
///
/// An observation works on whole masks: all voxels of one log-odds go to their next one at once. That
/// costs the number of different log-odds, not of voxels, and there is no unpacked form. Nothing is
/// rounded. Const functions may run side by side.
class PackedVoxels {
 public:
  /// No voxel is known.
  PackedVoxels() = default;
  /// The same voxels; one that was moved from has no known voxel.
  ///@{
  PackedVoxels(const PackedVoxels& other);
  PackedVoxels(PackedVoxels&& other) noexcept { swap(other); }
  PackedVoxels& operator=(PackedVoxels other) noexcept {
    swap(other);
    return *this;
  }
  ///@}
  ~PackedVoxels() = default;

  /// @param known  Voxels whose values count. @pre These are finite.
  PackedVoxels(const BrickMask& known, const VoxelValues& values);
  /// Voxels of one log-odds. @pre It is finite.
  PackedVoxels(const BrickMask& known, float log_odds);

  /// Whether no voxel is known.
  [[nodiscard]] bool isEmpty() const { return numValues() == 0; }
  /// The voxels that have log-odds.
  [[nodiscard]] const BrickMask& known() const;
  /// Those of the known voxels whose log-odds are >= 0.
  [[nodiscard]] const BrickMask& occupied() const;
  /// Those of the known voxels whose log-odds are < 0.
  [[nodiscard]] BrickMask free() const { return known().without(occupied()); }
  /// Whether occupied() has a voxel.
  [[nodiscard]] bool isAnyOccupied() const { return shape_.num_occupied_values > 0; }
  /// All voxels are known, none is occupied.
  [[nodiscard]] bool isAllFree() const {
    return !isEmpty() && shape_.num_occupied_values == 0 && !shape_.has_known;
  }

  /// Class of a voxel. @param voxel  See voxelIndex().
  [[nodiscard]] Occupancy occupancyAt(int voxel) const {
    if (!known().test(voxel)) return Occupancy::kUnknown;
    return occupied().test(voxel) ? Occupancy::kOccupied : Occupancy::kFree;
  }
  /// Log-odds of a voxel; nothing when it is unknown.
  [[nodiscard]] std::optional<float> at(int voxel) const;
  /// Calls visit(float log_odds, const BrickMask& voxels) for each log-odds that occurs, with the
  /// voxels that have it, which are some.
  template <typename VisitorT>
  void forEachValue(VisitorT visit) const {
    const BrickMask free_voxels = free();
    for (int i = 0; i < shape_.num_free_values; ++i) visit(values()[i], voxelsOf(i, free_voxels));
    for (int i = 0; i < shape_.num_occupied_values; ++i) {
      visit(values()[shape_.num_free_values + i], voxelsOf(i, occupied()));
    }
  }
  /// Writes the log-odds of the known voxels.
  void getValues(VoxelValues& values) const;

  /// What comes of observing voxels once each; an unknown one starts from 0. A voxel of both sets is
  /// a hit.
  /// @param after  Gets the voxels; left alone when nothing changes. May be the object itself.
  /// @complexity O(different log-odds in the brick).
  VoxelChange observe(const BrickMask& hits, const BrickMask& misses, const SensorModel& model,
                      PackedVoxels& after) const;

  /// What comes of putting the voxels of `other` that are in `part` in the place of those here.
  /// @param after  As in observe(). @return What differs.
  VoxelChange replace(const BrickMask& part, const PackedVoxels& other, PackedVoxels& after) const;

  /// Bytes of the block.
  [[nodiscard]] std::size_t numBytes() const { return numBytes(shape_); }

  /// The same voxels are known, with the same log-odds.
  ///@{
  friend bool operator==(const PackedVoxels& a, const PackedVoxels& b);
  friend bool operator!=(const PackedVoxels& a, const PackedVoxels& b) { return !(a == b); }
  ///@}

 private:
  /// What the block holds: masks first, then values.
  struct Shape {
    std::uint16_t num_free_values = 0;
    std::uint16_t num_occupied_values = 0;
    std::uint8_t num_planes = 0;
    bool has_known = false;     ///< Else all voxels are known, or none.
    bool has_occupied = false;  ///< Else all known voxels are of one class.
  };
  struct Unpacked;

  void swap(PackedVoxels& other) noexcept {
    std::swap(shape_, other.shape_);
    std::swap(block_, other.block_);
  }
  [[nodiscard]] int numValues() const {
    return shape_.num_free_values + shape_.num_occupied_values;
  }
  [[nodiscard]] const BrickMask* masks() const {
    return reinterpret_cast<const BrickMask*>(block_.get());
  }
  [[nodiscard]] const BrickMask* planes() const {
    return masks() + (shape_.has_known ? 1 : 0) + (shape_.has_occupied ? 1 : 0);
  }
  [[nodiscard]] const float* values() const {
    return reinterpret_cast<const float*>(planes() + shape_.num_planes);
  }
  /// The voxels of a class that have the log-odds of this number.
  [[nodiscard]] BrickMask voxelsOf(int number, const BrickMask& of_class) const {
    BrickMask voxels = of_class;
    for (int i = 0; i < shape_.num_planes; ++i) {
      voxels &= (number >> i & 1) != 0 ? planes()[i] : ~planes()[i];
    }
    return voxels;
  }
  [[nodiscard]] static std::size_t numBytes(const Shape& shape);
  void pack(const Unpacked& unpacked);

  Shape shape_;
  std::unique_ptr<std::byte[]> block_;
};

}  // namespace cuboid_mapping
