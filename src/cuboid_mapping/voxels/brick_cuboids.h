// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/brick.h"
#include "cuboid_mapping/occupancy/cuboid_filter.h"
#include "cuboid_mapping/voxels/voxel_store.h"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

namespace cuboid_mapping {

/// A box inside a brick in 18 bits: its least voxel, and its edges less one.
using PackedBox = std::uint32_t;

namespace packed_box_detail {

using Lanes = std::int32_t __attribute__((vector_size(16)));
/// Three numbers along the axes, and a class in the least byte of the fourth: as the end of a Cuboid.
struct alignas(Lanes) Numbers {
  std::int32_t values[4];

  [[nodiscard]] Lanes load() const {
    Lanes lanes;
    std::memcpy(&lanes, values, sizeof(lanes));
    return lanes;
  }
};
static_assert(sizeof(Cuboid) == offsetof(CellBox, max) + sizeof(Numbers) &&
              offsetof(Cuboid, occupancy) == offsetof(CellBox, max) + 12 &&
              __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);

static_assert(static_cast<int>(Occupancy::kFree) == 1 &&
              static_cast<int>(Occupancy::kOccupied) == 2);
/// One voxel beyond a corner, by class.
constexpr Numbers kEnds[] = {{{1, 1, 1, 0}}, {{1, 1, 1, 1}}, {{1, 1, 1, 2}}};
/// By nine bits of a box.
inline constexpr auto kCorners = [] {
  std::array<Numbers, kBrickVoxels> corners{};
  for (std::int32_t bits = 0; bits < kBrickVoxels; ++bits) {
    corners[static_cast<std::size_t>(bits)] = {{bits & 7, bits >> 3 & 7, bits >> 6, 0}};
  }
  return corners;
}();

}  // namespace packed_box_detail

/// A box of a brick in cells of the map. Four numbers at once: where a cuboid is written number by number and then read
/// as a whole, the processor waits.
/// @param brick  Least cell of the brick.
[[nodiscard]] inline Cuboid unpackCuboid(const Cell& brick, PackedBox box, Occupancy occupancy) {
  using namespace packed_box_detail;
  const Lanes min = Lanes{brick.x, brick.y, brick.z, 0} + kCorners[box & 511].load();
  const Lanes max =
      min + kCorners[box >> 9].load() + kEnds[static_cast<std::size_t>(occupancy)].load();
  Cuboid cuboid;
  auto* bytes = reinterpret_cast<std::byte*>(&cuboid);
  std::memcpy(bytes, &min, sizeof(min));
  std::memcpy(bytes + offsetof(CellBox, max), &max, sizeof(max));
  return cuboid;
}

/// A brick divided into boxes of one class; occupied ones first.
struct DividedBrick {
  int num_occupied = 0;
  int count = 0;
  /// Boxes, `count` of them. A union, so that the others are not set to 0 each time.
  union {
    std::array<PackedBox, kBrickVoxels> boxes;
  };

  DividedBrick() {}  // NOLINT(modernize-use-equals-default): because of the union

  [[nodiscard]] PackedBox box(int i) const { return boxes[static_cast<std::size_t>(i)]; }

  /// Divides voxels of one class into disjoint boxes that cover exactly these, and appends them.
  ///
  /// The least remaining voxel (in the order z, y, x) takes the largest box of which it is the
  /// least corner; ties go to the lower box. The result depends on the set only.
  void add(BrickMask voxels) noexcept;
};

/// Divides the voxels of both classes. Pure. Takes about 1 us.
[[nodiscard]] inline DividedBrick divide(const BrickMask& occupied,
                                         const BrickMask& free) noexcept {
  DividedBrick divided;
  divided.add(occupied);
  divided.num_occupied = divided.count;
  divided.add(free);
  return divided;
}

/// Divides voxels of one class of a brick, as DividedBrick::add(), and appends the cuboids.
void divideVoxels(const Cell& brick, const BrickMask& voxels, Occupancy occupancy,
                  std::vector<Cuboid>& cuboids);
/// The same for both classes, occupied ones first.
void divideBrick(const VoxelBrick& brick, std::vector<Cuboid>& cuboids);

/// The cuboids of one brick, packed: 18 bits each, up to three in the object itself. Stale cuboids
/// no longer fit the voxels; the next reader divides these.
///
/// Const functions may run side by side, keep() too; a change needs exclusive access.
class BrickCuboids {
 public:
  /// Stale cuboids.
  BrickCuboids() = default;
  /// @throws std::bad_alloc
  explicit BrickCuboids(const DividedBrick& divided) : word_(pack(divided)) {}
  BrickCuboids(BrickCuboids&& other) noexcept : word_(other.word_.exchange(kStale)) {}
  BrickCuboids& operator=(BrickCuboids&& other) noexcept {
    swap(other);
    return *this;
  }
  ~BrickCuboids() { release(word_.load(std::memory_order_relaxed)); }

  /// Whether the voxels have to be divided.
  [[nodiscard]] bool isStale() const { return load() == kStale; }
  void swap(BrickCuboids& other) noexcept {
    const Word mine = word_.load(std::memory_order_relaxed);
    word_.store(other.word_.exchange(mine, std::memory_order_relaxed), std::memory_order_relaxed);
  }
  /// Keeps the division that a reader of stale cuboids has made, if there is memory for it.
  void keep(const DividedBrick& divided) const noexcept;
  /// Prefetches memory outside the object.
  [[gnu::always_inline]] void prefetch() const {
    const Word word = word_.load(std::memory_order_relaxed);
    if ((word & kInline) == 0) __builtin_prefetch(blockOf(word));
  }

  /// Calls visit(PackedBox, Occupancy) -> Visit for each box that passes the filter.
  /// @pre !isStale().
  template <typename VisitT>
  Visit visit(CuboidFilter filter, VisitT visit) const {
    return visitBoxes(look(), filter, visit);
  }
  /// As above, for a brick that was just divided.
  template <typename VisitT>
  static Visit visit(const DividedBrick& divided, CuboidFilter filter, VisitT visit) {
    return visitBoxes(divided, filter, visit);
  }

  /// Bytes outside the object.
  [[nodiscard]] std::size_t numBytes() const;

 private:
  /// Stale, or up to three boxes with kInline set, or the address of a block.
  using Word = std::uint64_t;
  static constexpr Word kStale = 0;
  static constexpr Word kInline = 1;
  static constexpr int kMostInline = 3;
  static constexpr int kBoxBits = 18;
  static constexpr PackedBox kBoxMask = (1U << kBoxBits) - 1;

  /// A block begins with the number of boxes and that of occupied ones, 10 bits each; the boxes follow.
  static constexpr int kCountBits = 10;
  static constexpr std::uint32_t kCountMask = (1U << kCountBits) - 1;
  struct View {
    int num_occupied;
    int count;
    Word inline_boxes;
    const std::byte* block;  ///< Null: inline.

    [[nodiscard]] PackedBox box(int i) const {
      if (block == nullptr) return static_cast<PackedBox>(inline_boxes >> i * kBoxBits) & kBoxMask;
      PackedBox box = 0;
      std::memcpy(&box, block + byteOf(i), sizeof(box));
      return box >> shiftOf(i) & kBoxMask;
    }
  };

  [[nodiscard]] static constexpr std::pair<int, int> rangeOf(CuboidFilter filter, int num_occupied,
                                                             int count) {
    return {filter == CuboidFilter::kFree ? num_occupied : 0,
            filter == CuboidFilter::kOccupied ? num_occupied : count};
  }
  template <typename BoxesT, typename VisitT>
  static Visit visitBoxes(const BoxesT& boxes, CuboidFilter filter, VisitT visit) {
    const auto [first, end] = rangeOf(filter, boxes.num_occupied, boxes.count);
    for (int i = first; i < end; ++i) {
      const auto occupancy = i < boxes.num_occupied ? Occupancy::kOccupied : Occupancy::kFree;
      if (visit(boxes.box(i), occupancy) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }
  [[nodiscard]] static Word pack(const DividedBrick& divided);
  /// Place of a box in a block: in 4 bytes from this one on, above this bit.
  ///@{
  [[nodiscard]] static constexpr std::size_t byteOf(int i) {
    return static_cast<std::size_t>((2 * kCountBits + i * kBoxBits) / 8 - 1);
  }
  [[nodiscard]] static constexpr int shiftOf(int i) {
    return (2 * kCountBits + i * kBoxBits) % 8 + 8;
  }
  ///@}
  [[nodiscard]] static constexpr std::size_t blockBytes(int count) {
    return byteOf(count - 1) + sizeof(PackedBox);
  }
  /// The block at the address in a word.
  [[nodiscard]] static std::byte* blockOf(Word word) {
    std::byte* block = nullptr;
    static_assert(sizeof(block) <= sizeof(word) && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);
    std::memcpy(&block, &word, sizeof(block));
    return block;
  }
  static void release(Word word) noexcept;
  [[nodiscard]] Word load() const { return word_.load(std::memory_order_acquire); }
  [[nodiscard]] View look() const {
    const Word word = load();
    if ((word & kInline) != 0) {
      return {static_cast<int>(word >> 3 & 3), static_cast<int>(word >> 1 & 3), word >> 5, nullptr};
    }
    const std::byte* block = blockOf(word);
    std::uint32_t counts = 0;
    std::memcpy(&counts, block, sizeof(counts));
    return {static_cast<int>(counts >> kCountBits & kCountMask),
            static_cast<int>(counts & kCountMask), 0, block};
  }

  mutable std::atomic<Word> word_{kStale};
};

}  // namespace cuboid_mapping
