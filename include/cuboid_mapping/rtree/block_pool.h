// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace cuboid_mapping {

/// Memory for items of one size, in blocks that never move, addressed by 32-bit indices.
///
/// Free items are used again; a block whose items are all free goes back to the allocator.
class BlockPool {
 public:
  /// @param item_bytes  A multiple of the items' alignment, at least 4.
  /// @param keeps_block  The last block stays, so that the item after clear() needs no memory.
  explicit BlockPool(std::size_t item_bytes, bool keeps_block = false)
      : item_bytes_(item_bytes), keeps_block_(keeps_block) {}

  /// Gives memory for one item: zeros, or what was left of an item that was there before.
  [[nodiscard]] std::uint32_t allocate();
  /// Takes an item back. @pre It is from allocate(), and has not been released since.
  void release(std::uint32_t index);
  /// Releases all items.
  void clear() noexcept;

  /// The bytes of an item; they stay where they are. @pre It is in use.
  [[nodiscard]] std::byte* operator[](std::uint32_t index) const {
    return blocks_[index >> kBlockBits].bytes.get() + (index & (kBlockItems - 1)) * item_bytes_;
  }

  /// Asks the processor to fetch an item that is soon to be read. This and what is built on it must
  /// be inline: gcc drops calls of functions that do nothing else.
  [[gnu::always_inline]] void prefetch(std::uint32_t index) const {
    constexpr std::size_t kCacheLine_bytes = 64;
    const std::byte* item = (*this)[index];
    for (std::size_t i = 0; i < item_bytes_; i += kCacheLine_bytes) __builtin_prefetch(item + i);
  }

  /// Items in use.
  [[nodiscard]] std::size_t numItems() const { return num_items_; }
  /// Bytes held from the allocator.
  [[nodiscard]] std::size_t numBytes() const;

 private:
  static constexpr unsigned kBlockBits = 6;
  static constexpr std::uint32_t kBlockItems = 1U << kBlockBits;

  struct Block {
    std::unique_ptr<std::byte[]> bytes;  ///< Nothing while no item is in use.
    std::uint8_t num_used = 0;
    std::uint8_t first_free = 0;  ///< Each free item holds the number of the next.
    bool is_open = false;         ///< In open_blocks_.
  };

  [[nodiscard]] std::uint32_t findOpenBlock();
  void acquire(Block& block);
  void linkItems(Block& block);

  std::size_t item_bytes_;
  bool keeps_block_;
  std::vector<Block> blocks_;
  std::vector<std::uint32_t> open_blocks_;  ///< All with a free item, some that are full.
  std::size_t num_items_ = 0;
  std::size_t num_held_blocks_ = 0;
};

}  // namespace cuboid_mapping
