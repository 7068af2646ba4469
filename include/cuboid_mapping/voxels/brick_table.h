// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/brick.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace cuboid_mapping {

/// Items by brick: a hash table with linear probing beside blocks of items, which stay where they are
/// until they are erased. Const functions may run side by side.
///
/// @tparam ItemT  Has a member `Cell brick`, and can be made without arguments.
template <typename ItemT>
class BrickTable {
 public:
  /// Null when there is none. @complexity O(1).
  [[nodiscard]] ItemT* find(const Cell& brick) {
    return const_cast<ItemT*>(std::as_const(*this).find(brick));
  }
  [[nodiscard]] const ItemT* find(const Cell& brick) const {
    if (slots_.empty()) return nullptr;
    const std::uint32_t index = slots_[slotOf(brick)];
    return index == kFree ? nullptr : &item(index);
  }

  /// The item of a brick, added when it is new. @complexity O(1) on average.
  ItemT& at(const Cell& brick) {
    if (2 * (num_items_ + 1) > slots_.size()) grow();
    std::uint32_t& slot = slots_[slotOf(brick)];
    if (slot == kFree) {
      slot = takeIndex();
      item(slot).brick = brick;
      ++num_items_;
    }
    return item(slot);
  }

  /// Forgets a brick; nothing happens when it is not there. @complexity O(1) on average.
  void erase(const Cell& brick) {
    if (slots_.empty()) return;
    std::size_t hole = slotOf(brick);
    if (slots_[hole] == kFree) return;
    item(slots_[hole]) = ItemT();
    free_.push_back(slots_[hole]);
    --num_items_;
    // What was put behind the hole because of it moves up.
    for (std::size_t slot = next(hole); slots_[slot] != kFree; slot = next(slot)) {
      const std::size_t home = homeOf(item(slots_[slot]).brick);
      if (((slot - home) & lastSlot()) < ((slot - hole) & lastSlot())) continue;
      slots_[hole] = slots_[slot];
      hole = slot;
    }
    slots_[hole] = kFree;
  }

  void clear() { *this = BrickTable(); }

  [[nodiscard]] std::size_t size() const { return num_items_; }
  [[nodiscard]] bool isEmpty() const { return num_items_ == 0; }

  /// Calls visit(item) for each item, in no particular order. The table must not change meanwhile.
  template <typename VisitorT>
  void forEach(VisitorT visit) {
    for (const std::uint32_t index : slots_) {
      if (index != kFree) visit(item(index));
    }
  }
  template <typename VisitorT>
  void forEach(VisitorT visit) const {
    for (const std::uint32_t index : slots_) {
      if (index != kFree) visit(item(index));
    }
  }

  /// Calls visit(item) for each item whose brick shares a cell with a box.
  /// @complexity O(bricks of the box), or O(size()) if that is less.
  template <typename VisitorT>
  void forEachIn(const CellBox& box, VisitorT visit) const {
    if (numBricks(box) > static_cast<double>(slots_.size())) {
      forEach([&](const ItemT& item) {
        if (!intersect(brickBox(item.brick), box).isEmpty()) visit(item);
      });
      return;
    }
    forEachBrick(box, [&](const Cell& brick) {
      if (const ItemT* found = find(brick)) visit(*found);
    });
  }

  /// Bytes held from the allocator, without what items hold.
  [[nodiscard]] std::size_t numBytes() const {
    return slots_.capacity() * sizeof(std::uint32_t) +
           blocks_.size() * kBlockItems * sizeof(ItemT) + blocks_.capacity() * sizeof(blocks_[0]) +
           free_.capacity() * sizeof(std::uint32_t);
  }

  /// Slots that find() looks at for a brick of the table. For tests of the hash.
  [[nodiscard]] std::size_t numProbes(const Cell& brick) const {
    return ((slotOf(brick) - homeOf(brick)) & lastSlot()) + 1;
  }

 private:
  static constexpr std::uint32_t kFree = 0xFFFFFFFFU;
  static constexpr unsigned kBlockBits = 7;
  static constexpr std::uint32_t kBlockItems = 1U << kBlockBits;
  static constexpr std::size_t kFirstSlots = 16;

  [[nodiscard]] ItemT& item(std::uint32_t index) {
    return blocks_[index >> kBlockBits][index & (kBlockItems - 1)];
  }
  [[nodiscard]] const ItemT& item(std::uint32_t index) const {
    return blocks_[index >> kBlockBits][index & (kBlockItems - 1)];
  }
  [[nodiscard]] std::size_t lastSlot() const { return slots_.size() - 1; }
  [[nodiscard]] std::size_t next(std::size_t slot) const { return (slot + 1) & lastSlot(); }
  /// Neighbours along each axis, z too, come to slots far apart.
  [[nodiscard]] std::size_t homeOf(const Cell& brick) const {
    const auto bits = [](std::int32_t v) { return std::uint64_t{static_cast<std::uint32_t>(v)}; };
    const std::uint64_t mixed = bits(brick.x) * 0x9E3779B97F4A7C15ULL ^
                                bits(brick.y) * 0xC2B2AE3D27D4EB4FULL ^
                                bits(brick.z) * 0x165667B19E3779F9ULL;
    return (mixed ^ mixed >> 29) * 0x9E3779B97F4A7C15ULL >> 32 & lastSlot();
  }
  /// Where a brick is, or the free slot where it would be.
  [[nodiscard]] std::size_t slotOf(const Cell& brick) const {
    std::size_t slot = homeOf(brick);
    while (slots_[slot] != kFree && item(slots_[slot]).brick != brick) slot = next(slot);
    return slot;
  }
  std::uint32_t takeIndex() {
    if (!free_.empty()) {
      const std::uint32_t index = free_.back();
      free_.pop_back();
      return index;
    }
    const auto index = static_cast<std::uint32_t>(num_items_);
    if (index >> kBlockBits == blocks_.size()) {
      blocks_.push_back(std::make_unique<ItemT[]>(kBlockItems));
    }
    return index;
  }
  void grow() {
    std::vector<std::uint32_t> old(slots_.empty() ? kFirstSlots : 2 * slots_.size(), kFree);
    old.swap(slots_);
    for (const std::uint32_t index : old) {
      if (index != kFree) slots_[slotOf(item(index).brick)] = index;
    }
  }

  std::vector<std::uint32_t> slots_;  ///< Indices of items; at most half of them are taken.
  std::vector<std::unique_ptr<ItemT[]>> blocks_;
  std::vector<std::uint32_t> free_;
  std::size_t num_items_ = 0;
};

}  // namespace cuboid_mapping
