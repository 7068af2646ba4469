// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/brick.h"
#include "cuboid_mapping/occupancy/cuboid_filter.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace cuboid_mapping {

/// Items by brick: a hash table with linear probing, and blocks of items, which do not move until
/// they are erased. Const functions may run side by side.
///
/// @tparam ItemT  Has a member `Cell brick`, and can be made without arguments.
template <typename ItemT>
class BrickTable {
 public:
  /// The item of a brick; null if there is none. @complexity O(1) on average.
  ///@{
  [[nodiscard]] ItemT* find(const Cell& brick) {
    return const_cast<ItemT*>(std::as_const(*this).find(brick));
  }
  [[nodiscard]] const ItemT* find(const Cell& brick) const {
    const std::uint32_t index = indexOf(brick);
    return index == kNoItem ? nullptr : &item(index);
  }
  ///@}

  /// Number that no item has.
  static constexpr std::uint32_t kNoItem = 0xFFFFFFFFU;
  /// The number of a brick's item, constant until it is erased; kNoItem if there is none.
  [[nodiscard]] std::uint32_t indexOf(const Cell& brick) const {
    return slots_.empty() ? kNoItem : slots_[slotOf(brick)];
  }
  /// Prefetches memory that indexOf() reads for a brick: first the slot, later the item in it.
  /// Inline: gcc drops calls of functions that do nothing else.
  ///@{
  [[gnu::always_inline]] void prefetchSlot(const Cell& brick) const {
    if (!slots_.empty()) __builtin_prefetch(&slots_[homeOf(brick)]);
  }
  [[gnu::always_inline]] void prefetchItem(const Cell& brick) const {
    if (slots_.empty()) return;
    const std::uint32_t index = slots_[homeOf(brick)];
    if (index != kNoItem) __builtin_prefetch(&item(index));
  }
  ///@}
  /// The item with a number. @pre It exists.
  ///@{
  [[nodiscard]] ItemT& item(std::uint32_t index) {
    return blocks_[index >> kBlockBits][index & (kBlockItems - 1)];
  }
  [[nodiscard]] const ItemT& item(std::uint32_t index) const {
    return blocks_[index >> kBlockBits][index & (kBlockItems - 1)];
  }
  ///@}
  /// One beyond the greatest number that an item has, or can have without more memory.
  [[nodiscard]] std::size_t endIndex() const { return blocks_.size() * kBlockItems; }

  /// Reserves memory for this many items, so that findOrAdd() does not throw.
  void reserve(std::size_t num_items) {
    while (num_items > blocks_.size() * kBlockItems) {
      blocks_.push_back(std::make_unique<ItemT[]>(kBlockItems));
    }
    if (3 * num_items > 2 * slots_.size()) grow(num_items + num_items / 2 + 1);
  }

  /// Finds or adds the item of a brick. @complexity O(1) on average.
  /// @throws std::bad_alloc  The table is unchanged then.
  ItemT& findOrAdd(const Cell& brick) {
    if (const std::uint32_t index = indexOf(brick); index != kNoItem) return item(index);
    reserve(num_items_ + 1);
    std::uint32_t& slot = slots_[slotOf(brick)];
    slot = takeIndex();
    item(slot).brick = brick;
    ++num_items_;
    return item(slot);
  }

  /// Removes a brick, if it is there. @complexity O(1) on average.
  void erase(const Cell& brick) noexcept {
    if (slots_.empty()) return;
    std::size_t hole = slotOf(brick);
    if (slots_[hole] == kFree) return;
    item(slots_[hole]) = ItemT();
    item(slots_[hole]).brick.x = static_cast<std::int32_t>(first_free_);
    first_free_ = slots_[hole];
    --num_items_;
    // Moves items up that lie behind the hole because it was taken.
    for (std::size_t slot = next(hole); slots_[slot] != kFree; slot = next(slot)) {
      const std::size_t home = homeOf(item(slots_[slot]).brick);
      if (((slot - home) & lastSlot()) < ((slot - hole) & lastSlot())) continue;
      slots_[hole] = slots_[slot];
      hole = slot;
    }
    slots_[hole] = kFree;
  }

  /// Removes all bricks, and frees the memory.
  void clear() { *this = BrickTable(); }

  /// Number of items.
  [[nodiscard]] std::size_t size() const { return num_items_; }
  /// Whether there is no item.
  [[nodiscard]] bool isEmpty() const { return num_items_ == 0; }

  /// Calls visit(item) for each item, in no particular order. The table must not change meanwhile.
  ///@{
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
  ///@}

  /// Calls visit(item) -> Visit for each item whose brick shares a cell with a box, until it is kStop.
  /// @return The last answer. @complexity O(bricks of the box), or O(slots of the table) if these are fewer.
  template <typename VisitorT>
  Visit visitIn(const CellBox& box, VisitorT visit) const {
    const auto stops = [&](const ItemT& item) { return visit(item) == Visit::kStop; };
    bool is_stopped = false;
    if (numBricks(box) > static_cast<double>(slots_.size())) {
      is_stopped = std::any_of(slots_.begin(), slots_.end(), [&](std::uint32_t index) {
        return index != kFree && brickBox(item(index).brick).intersects(box) && stops(item(index));
      });
    } else {
      is_stopped = anyBrick(box, [&](const Cell& brick) {
        const ItemT* found = find(brick);
        return found != nullptr && stops(*found);
      });
    }
    return is_stopped ? Visit::kStop : Visit::kContinue;
  }
  /// Calls visit(item) for each item whose brick shares a cell with a box. @complexity As visitIn().
  template <typename VisitorT>
  void forEachIn(const CellBox& box, VisitorT visit) const {
    (void)visitIn(box, [&](const ItemT& item) {
      visit(item);
      return Visit::kContinue;
    });
  }

  /// Bytes held from the allocator, without memory held by items.
  [[nodiscard]] std::size_t numBytes() const {
    return slots_.capacity() * sizeof(std::uint32_t) +
           blocks_.size() * kBlockItems * sizeof(ItemT) + blocks_.capacity() * sizeof(blocks_[0]);
  }

  /// Number of slots that find() reads for a brick of the table. For tests of the hash.
  [[nodiscard]] std::size_t numProbes(const Cell& brick) const {
    return ((slotOf(brick) - homeOf(brick)) & lastSlot()) + 1;
  }

 private:
  static constexpr std::uint32_t kFree = kNoItem;
  static constexpr unsigned kBlockBits = 7;
  static constexpr std::uint32_t kBlockItems = 1U << kBlockBits;
  static constexpr std::size_t kFirstSlots = 16;

  [[nodiscard]] std::size_t lastSlot() const { return slots_.size() - 1; }
  [[nodiscard]] std::size_t next(std::size_t slot) const { return (slot + 1) & lastSlot(); }
  /// Preferred slot: neighbours along each axis, also z, have slots far apart.
  [[nodiscard]] std::size_t homeOf(const Cell& brick) const {
    const auto bits = [](std::int32_t v) { return std::uint64_t{static_cast<std::uint32_t>(v)}; };
    const std::uint64_t mixed = bits(brick.x) * 0x9E3779B97F4A7C15ULL ^
                                bits(brick.y) * 0xC2B2AE3D27D4EB4FULL ^
                                bits(brick.z) * 0x165667B19E3779F9ULL;
    return (mixed ^ mixed >> 29) * 0x9E3779B97F4A7C15ULL >> 32 & lastSlot();
  }
  /// Slot of a brick, or the free slot for it.
  [[nodiscard]] std::size_t slotOf(const Cell& brick) const {
    std::size_t slot = homeOf(brick);
    while (slots_[slot] != kFree && item(slots_[slot]).brick != brick) slot = next(slot);
    return slot;
  }
  /// @pre Memory is reserved.
  std::uint32_t takeIndex() {
    if (first_free_ == kFree) return static_cast<std::uint32_t>(num_items_);
    const std::uint32_t index = first_free_;
    first_free_ = static_cast<std::uint32_t>(item(index).brick.x);
    return index;
  }
  void grow(std::size_t num_wanted) {
    std::size_t num_slots = std::max(kFirstSlots, slots_.size());
    while (num_slots < num_wanted) num_slots *= 2;
    std::vector<std::uint32_t> old(num_slots, kFree);
    old.swap(slots_);
    for (const std::uint32_t index : old) {
      if (index != kFree) slots_[slotOf(item(index).brick)] = index;
    }
  }

  std::vector<std::uint32_t> slots_;  ///< Indices of items; at most two thirds of them are used.
  std::vector<std::unique_ptr<ItemT[]>> blocks_;
  std::uint32_t first_free_ = kFree;  ///< Erased items; each holds the next one in brick.x.
  std::size_t num_items_ = 0;
};

}  // namespace cuboid_mapping
