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

/// Voxels of a brick that a change has touched.
struct VoxelChange {
  BrickMask changed;       ///< Voxels that are new, gone, or have other log-odds.
  BrickMask reclassified;  ///< Changed voxels that have another class.
};

/// Log-odds by voxelIndex(); undefined for unknown voxels.
using VoxelValues = std::array<float, kBrickVoxels>;

/// The voxels of one brick with their exact log-odds.
///
/// One block of memory holds the mask of the known voxels, the mask of the occupied ones, and each log-odds
/// that occurs once: first those of free voxels, then those of occupied ones. Each voxel has the number of its
/// log-odds in the list of its class; each bit of these numbers is a mask, too (a bit plane). Masks that follow
/// from the rest are left out, and so are the words of slices without a known voxel. The block has 8 bytes for
/// each slice and mask, and 4 for each log-odds: 4 bytes for a brick of known voxels with one log-odds, 72 with
/// one log-odds of each class.
///
/// An observation works on whole masks: all voxels of one log-odds go to their next one at once. The cost
/// depends on the number of different log-odds, not of voxels. Nothing is rounded. Const functions may run side
/// by side.
class PackedVoxels {
 public:
  /// A brick without a known voxel.
  PackedVoxels() = default;
  /// Copies or takes over voxels. A moved-from object has no known voxel.
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

  /// Voxels of known class, with the log-odds of the clamping thresholds.
  /// @param occupied  Occupied ones among the known voxels.
  [[nodiscard]] static PackedVoxels ofClasses(const BrickMask& known, const BrickMask& occupied,
                                              const SensorModel& model);

  /// Whether no voxel is known.
  [[nodiscard]] bool isEmpty() const { return shape_.slices == 0; }
  /// The voxels that have log-odds.
  [[nodiscard]] BrickMask known() const;
  /// Known voxels with log-odds >= 0.
  [[nodiscard]] BrickMask occupied() const;
  /// Known voxels with log-odds < 0.
  [[nodiscard]] BrickMask free() const { return known().without(occupied()); }
  /// Whether occupied() has a voxel.
  [[nodiscard]] bool isAnyOccupied() const { return shape_.num_occupied_values > 0; }
  /// Whether no log-odds is infinite or NaN.
  [[nodiscard]] bool isFinite() const;
  /// Whether all voxels are known and free.
  [[nodiscard]] bool isAllFree() const {
    return shape_.slices == kAllSlices && shape_.num_occupied_values == 0 && !shape_.has_known;
  }

  /// Class of a voxel. @param voxel  See voxelIndex().
  [[nodiscard]] Occupancy at(int voxel) const {
    const unsigned slice = 1U << (voxel >> 6);
    if ((shape_.slices & slice) == 0) return Occupancy::kUnknown;
    if (shape_.has_known && !test(0, voxel)) return Occupancy::kUnknown;
    const bool is_occupied =
        shape_.has_occupied ? test(shape_.has_known ? 1 : 0, voxel) : isAnyOccupied();
    return is_occupied ? Occupancy::kOccupied : Occupancy::kFree;
  }
  /// Log-odds of a voxel; nothing when it is unknown.
  [[nodiscard]] std::optional<float> logOddsAt(int voxel) const;
  /// Calls visit(float log_odds, const BrickMask& voxels) for each log-odds that occurs, with the
  /// voxels that have it, at least one.
  template <typename VisitorT>
  void forEachValue(VisitorT visit) const {
    const Masks masks(*this);
    const BrickMask free_voxels = masks.known.without(masks.occupied);
    for (int i = 0; i < shape_.num_free_values; ++i) {
      visit(values()[i], masks.voxelsOf(i, free_voxels));
    }
    for (int i = 0; i < shape_.num_occupied_values; ++i) {
      visit(values()[shape_.num_free_values + i], masks.voxelsOf(i, masks.occupied));
    }
  }
  /// Writes the log-odds of the known voxels.
  void getValues(VoxelValues& values) const;

  /// Observes each of some voxels once; an unknown one starts from 0. A voxel of both sets is
  /// a hit.
  /// @param after  Gets the new voxels; untouched when nothing changes. May be the object itself.
  /// @complexity O(v log v + m v) operations on masks for v different log-odds in the brick, m of which change.
  VoxelChange observe(const BrickMask& hits, const BrickMask& misses, const SensorModel& model,
                      PackedVoxels& after) const;

  /// The voxels after `other` replaces this brick inside `part`. A whole brick is taken over.
  /// @param after  As in observe(). @return Nothing if all log-odds are the same; else all voxels of `part` count as
  ///               changed that are known before or after.
  VoxelChange replace(const BrickMask& part, PackedVoxels other, PackedVoxels& after) const;

  /// Prefetches the first masks. Inline: gcc drops calls of functions that do nothing else.
  [[gnu::always_inline]] void prefetch() const { __builtin_prefetch(block_.get()); }

  /// Bytes of the block, without the object.
  [[nodiscard]] std::size_t numBytes() const { return numBytes(shape_); }

  /// Number of bricks that this thread has encoded so far; copies do not count. For tests of work.
  [[nodiscard]] static std::uint64_t numEncoded();

  /// Whether the same voxels are known, with the same log-odds.
  ///@{
  friend bool operator==(const PackedVoxels& a, const PackedVoxels& b);
  friend bool operator!=(const PackedVoxels& a, const PackedVoxels& b) { return !(a == b); }
  ///@}

 private:
  static constexpr unsigned kAllSlices = 0xFF;
  static constexpr int kMaxPlanes = 9;

  /// Content of the block: masks first, then values.
  struct Shape {
    std::uint16_t num_free_values = 0;
    std::uint16_t num_occupied_values = 0;
    std::uint8_t num_planes = 0;
    std::uint8_t slices = 0;    ///< Bit z: the slice has a known voxel; each mask has its word.
    bool has_known = false;     ///< Stores a known mask; else all voxels of the slices are known.
    bool has_occupied = false;  ///< Stores an occupied mask; else all known voxels have one class.
  };

  /// The masks with all their words.
  struct Masks {
    BrickMask known;
    BrickMask occupied;
    int num_planes = 0;
    /// Masks, 0 for unknown voxels. A union, so that masks behind the last are not set to 0 each time.
    union {
      std::array<BrickMask, kMaxPlanes> planes;
    };

    Masks() {}  // NOLINT(modernize-use-equals-default): because of the union
    explicit Masks(const PackedVoxels& packed);
    /// The voxels of a class that have the log-odds of this number.
    [[nodiscard]] BrickMask voxelsOf(int number, const BrickMask& of_class) const {
      BrickMask voxels = of_class;
      for (int i = 0; i < num_planes; ++i) {
        const BrickMask& plane = planes[static_cast<std::size_t>(i)];
        voxels &= (number >> i & 1) != 0 ? plane : ~plane;
      }
      return voxels;
    }
  };
  struct Unpacked;

  void swap(PackedVoxels& other) noexcept {
    std::swap(shape_, other.shape_);
    std::swap(block_, other.block_);
  }
  /// Number of slices in a set. Not every x86-64 has an instruction for it.
  [[nodiscard]] static constexpr int countSlices(unsigned slices) {
    slices -= slices >> 1 & 0x55;
    slices = (slices & 0x33) + (slices >> 2 & 0x33);
    return static_cast<int>((slices + (slices >> 4)) & 0x0F);
  }
  [[nodiscard]] static int numMasks(const Shape& shape) {
    return (shape.has_known ? 1 : 0) + (shape.has_occupied ? 1 : 0) + shape.num_planes;
  }
  /// Words of a mask; the planes come last.
  [[nodiscard]] const std::uint64_t* words(int mask) const {
    return reinterpret_cast<const std::uint64_t*>(block_.get()) + mask * countSlices(shape_.slices);
  }
  [[nodiscard]] int firstPlane() const { return numMasks(shape_) - shape_.num_planes; }
  [[nodiscard]] BrickMask maskOf(int mask) const;
  /// Whether a mask has a voxel. @pre The voxel's slice has a known voxel.
  [[nodiscard]] bool test(int mask, int voxel) const {
    const unsigned before = shape_.slices & ((1U << (voxel >> 6)) - 1U);
    return (words(mask)[countSlices(before)] >> (voxel & 63) & 1) != 0;
  }
  [[nodiscard]] const float* values() const {
    return reinterpret_cast<const float*>(words(numMasks(shape_)));
  }
  [[nodiscard]] static std::size_t numBytes(const Shape& shape);
  void pack(const Unpacked& unpacked);

  Shape shape_;
  std::unique_ptr<std::byte[]> block_;
};

}  // namespace cuboid_mapping
