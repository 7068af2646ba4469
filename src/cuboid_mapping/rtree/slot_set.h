// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstring>

namespace cuboid_mapping {

/// Set of slots of a node: bit i stands for slot i.
using SlotSet = std::uint64_t;

/// Maximum number of slots of a node.
constexpr int kMaxSlots = 64;

/// Number of slots for one step of a loop over a node's arrays, whatever the number of branches, so
/// that the compiler turns each step into SIMD instructions; the arrays are padded to multiples.
constexpr int kSlotGroup = 16;

/// Number of slots rounded up to whole groups.
[[nodiscard]] constexpr int paddedSlots(int count) {
  return (count + kSlotGroup - 1) / kSlotGroup * kSlotGroup;
}

/// The first `count` slots. @pre 0 <= count <= kMaxSlots.
[[nodiscard]] constexpr SlotSet firstSlots(int count) {
  return count == 0 ? 0 : ~SlotSet{0} >> (kMaxSlots - count);
}

/// Least slot of a set. @pre the set is not empty.
[[nodiscard]] inline int firstSlot(SlotSet slots) { return __builtin_ctzll(slots); }

/// The set without its least slot: `for (; slots != 0; slots = withoutFirst(slots))`.
[[nodiscard]] constexpr SlotSet withoutFirst(SlotSet slots) { return slots & (slots - 1); }

/// A flag, 0 or 1, for each slot of a group.
using SlotFlags = std::uint8_t[kSlotGroup];

/// The flags of a group as bits 0 to kSlotGroup - 1.
[[nodiscard]] inline SlotSet packFlags(const SlotFlags& flags) {
  static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "flag 0 is the lowest byte of a word");
  std::uint64_t words[2];
  static_assert(sizeof(words) == sizeof(flags));
  std::memcpy(words, flags, sizeof(flags));
  constexpr std::uint64_t kBytesToBits = 0x0102040810204080ULL;  // Byte i to bit 56 + i.
  return words[0] * kBytesToBits >> 56 | words[1] * kBytesToBits >> 56 << 8;
}

/// Slots below `count` that pass a test.
/// @param test  (int slot) -> bool without a branch; called for the slots of whole groups.
template <typename TestT>
[[nodiscard]] SlotSet findSlots(int count, TestT test) {
  SlotSet found = 0;
  for (int first = 0; first < count; first += kSlotGroup) {
    SlotFlags flags;
    for (int i = 0; i < kSlotGroup; ++i) flags[i] = static_cast<std::uint8_t>(test(first + i));
    found |= packFlags(flags) << first;
  }
  return found & firstSlots(count);
}

}  // namespace cuboid_mapping
